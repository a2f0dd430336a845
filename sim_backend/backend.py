"""The simulated rig as a backend: as fast as it goes, or paced against the clock."""

from epa_rt.backend import BackendError, Event, Exchange
from epa_rt.config.rig import Rig
from epa_rt.config.rig_homing import HomingOptions
from epa_rt.models import plant as nominal_physics
from epa_rt.models.plant_file import PlantFile
from epa_rt.realtime.pace import Pace
from sim_backend.rig_model import RigModel


class SimBackend:
    """A Backend on a RigModel. ``speed`` 1 runs in real time, 2 twice as fast; None as fast as it
    goes.

    Without pace the clock is the simulated one (from zero) and lateness and busy time are zero, so
    that the same seed gives the same bytes. With pace, both are measured. ``physics``,
    ``referenced`` and ``count_offset`` as RigModel takes them. ``model``: a rig that an earlier run
    has left, to go on with. ``homing``: what the drive's own homing is set to, as the driver would
    write it. It has no bus that would tell ``events``.
    """

    def __init__(
        self,
        rig: Rig,
        plant: PlantFile,
        seed: int = 0,
        speed: float | None = None,
        physics=nominal_physics,
        referenced: bool = True,
        count_offset: int = 0,
        model: RigModel | None = None,
        homing: HomingOptions | None = None,
    ):
        self.period_s = rig.period_s
        self.events: list[Event] = []
        self.drive_off: bool | None = None
        self._model = model or RigModel(rig, plant, seed, physics, referenced, count_offset)
        self._model.set_homing(homing)
        self._pace = None if speed is None else Pace(rig.period_s / speed)
        self._cycle = -1
        self._size = len(self._model._outputs)
        self._is_open = False

    @property
    def model(self) -> RigModel:
        """The plant behind the bytes, for tests and reports that want the truth."""
        return self._model

    def open(self) -> None:
        self._is_open = True
        if self._pace is not None:
            self._pace.start()

    def exchange(self, outputs_raw: bytes) -> Exchange:
        """Raises BackendError where it is not open or the image has the wrong size."""
        if not self._is_open or len(outputs_raw) != self._size:
            found = f"{len(outputs_raw)} bytes" if self._is_open else "a closed backend"
            raise BackendError(
                f"found {found}, expected an open backend and {self._size} bytes of outputs"
            )
        self._cycle += 1
        lateness_ns = busy_ns = 0
        if self._pace is not None:
            lateness_ns, busy_ns = self._pace.wait()
        inputs_raw = self._model.cycle(outputs_raw)
        if self._pace is not None:
            self._pace.mark()
        t_ns = self._model.t_ns
        return Exchange(self._cycle, t_ns, inputs_raw, True, lateness_ns, busy_ns, t_ns)

    def close(self) -> None:
        was_open, self._is_open = self._is_open, False
        if was_open:
            try:
                self._model.cycle(bytes(self._size))  # all outputs de-energised: the safe state
            except BackendError:
                pass  # a plant that ran away has been reported by the exchange before
