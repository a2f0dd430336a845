"""What each fault of the plant does: ``begin`` and ``end`` once, ``hold`` after every latch of the
outputs, ``change`` on the inputs.
"""

from struct import pack_into, unpack_from
from typing import TYPE_CHECKING

import numpy as np

from epa_rt.config.devices import STATUS_ERROR, STATUS_OVER_RANGE, STATUS_UNDER_RANGE
from epa_rt.config.ports import VALVE_PORTS
from epa_rt.config.rig import Rig
from epa_rt.config.terminal import Sampling
from epa_rt.signals.image import image_of
from sim_backend.devices import SWITCH_ON_DISABLED

if TYPE_CHECKING:
    from sim_backend.rig_model import RigModel


class Effect:
    """Base: does nothing. Constructed from rig, place, value and seed; raises ValueError for a
    place that is not there.
    """

    def __init__(self, rig: Rig, where: str, value: float | None, seed: int):
        self.rig, self.where, self.value, self.seed = rig, where, value, seed
        self.prepare()

    def prepare(self) -> None: ...

    def begin(self, model: "RigModel") -> None: ...

    def hold(self, model: "RigModel") -> None: ...

    def change(self, inputs: bytearray) -> None: ...

    def end(self, model: "RigModel") -> None: ...


class _Sensor(Effect):
    """A fault of one input row."""

    def prepare(self) -> None:
        row = next((row for row in self.rig.inputs if self.where in (row.name, row.entry)), None)
        if row is None:
            raise ValueError(
                f"found the input {self.where!r}, expected one of"
                f" {', '.join(row.name for row in self.rig.inputs)}"
            )
        places = image_of(self.rig, outputs=False).places
        self.place = places[row.entry]
        self.status = places.get(f"{row.entry}_status")
        name = self.place.slave
        slave = next(slave for slave in self.rig.slaves if slave.name == name)
        self.sampling = None if slave.description.is_drive else slave.description.sampling
        if self.status is not None and not self.status.entry.faults:
            self.status = None
        self.generator = np.random.default_rng(self.seed)
        self.held: int | None = None

    def counts(self, inputs: bytearray) -> int:
        return unpack_from("<" + self.place.entry.code, inputs, self.place.byte)[0]

    def put(self, inputs: bytearray, counts: float) -> None:
        low, high = self.place.entry.counts
        sampling = self.sampling or Sampling()
        under = low if sampling.under is None else sampling.under
        floor = low if sampling.floor is None else sampling.floor
        worst = high if sampling.over_error is None else sampling.over_error
        pack_into(
            "<" + self.place.entry.code,
            inputs,
            self.place.byte,
            floor if counts <= under else int(min(max(round(counts), low), high)),
        )
        if self.status is not None and self.sampling is not None:
            out = STATUS_UNDER_RANGE | STATUS_ERROR if counts <= under else 0
            out |= STATUS_OVER_RANGE if counts > high else 0
            out |= STATUS_ERROR if counts > worst else 0
            word = unpack_from("<H", inputs, self.status.byte)[0] & ~(
                STATUS_UNDER_RANGE | STATUS_OVER_RANGE | STATUS_ERROR
            )
            pack_into("<H", inputs, self.status.byte, word | out & self.status.entry.faults)


class WireBroken(_Sensor):
    def prepare(self) -> None:
        super().prepare()
        if self.sampling is None:
            raise ValueError(
                f"found {self.where!r}, expected a row on an analog input: only those have a wire"
                " that breaks here"
            )

    def change(self, inputs: bytearray) -> None:
        entry = self.place.entry
        native = self.value if self.value is not None else self.sampling.broken_wire
        if native is None and entry.unit not in ("count", "1"):
            native = 0.0
        if native is not None:
            self.put(inputs, entry.to_counts(native))
            return
        if self.held is None:  # a counter stands, and says that its line is open
            self.held = self.counts(inputs)
        pack_into("<" + entry.code, inputs, self.place.byte, self.held)
        if self.status is not None:
            word = unpack_from("<H", inputs, self.status.byte)[0]
            pack_into("<H", inputs, self.status.byte, word | STATUS_ERROR)


class SensorStuck(_Sensor):
    def change(self, inputs: bytearray) -> None:
        if self.held is None:
            self.held = self.counts(inputs)
        self.put(inputs, self.held)


class SensorNoisy(_Sensor):
    def change(self, inputs: bytearray) -> None:
        rms = self.value if self.sampling is None else self.value / self.place.entry.per_count
        self.put(inputs, self.counts(inputs) + rms * self.generator.standard_normal())


class ToggleFrozen(Effect):
    def prepare(self) -> None:
        image = image_of(self.rig, outputs=False)
        if not any(
            slave.name == self.where and slave.description.sampling for slave in self.rig.slaves
        ):
            raise ValueError(
                f"found the slave {self.where!r}, expected an analog input (as EL3004) of the rig"
            )
        self.start, self.size = image.slices[self.where]
        self.held: bytes | None = None

    def change(self, inputs: bytearray) -> None:
        if self.held is None:
            self.held = bytes(inputs[self.start : self.start + self.size])
        inputs[self.start : self.start + self.size] = self.held


class _Valve(Effect):
    opening = 0.0

    def prepare(self) -> None:
        row = next((row for row in self.rig.outputs if row.name == self.where), None)
        port = row.port if row is not None else self.where
        if port not in VALVE_PORTS:
            names = [row.name for row in self.rig.outputs if row.port in VALVE_PORTS]
            raise ValueError(f"found the valve {self.where!r}, expected one of {', '.join(names)}")
        self.muscle, self.is_exhaust = VALVE_PORTS[port]

    def hold(self, model: "RigModel") -> None:
        model.command["exhaust" if self.is_exhaust else "inlet"][0, self.muscle] = self.opening


class ValveStuckOpen(_Valve):
    opening = 1.0


class ValveStuckClosed(_Valve):
    pass


class Leak(Effect):
    def prepare(self) -> None:
        names = [muscle.name for muscle in self.rig.muscles]
        if self.where and self.where not in names:
            raise ValueError(f"found the muscle {self.where!r}, expected one of {', '.join(names)}")
        self.muscle = names.index(self.where) if self.where else 0

    def begin(self, model: "RigModel") -> None:
        self.before = float(model.params["gas"]["leak_per_s"][0, self.muscle])
        model.params["gas"]["leak_per_s"][0, self.muscle] = self.value

    def end(self, model: "RigModel") -> None:
        model.params["gas"]["leak_per_s"][0, self.muscle] = self.before


class SupplyLost(Effect):
    def begin(self, model: "RigModel") -> None:
        self.before = model.params["gas"]["supply_gauge_pa"].copy()
        model.params["gas"]["supply_gauge_pa"] = self.value

    def end(self, model: "RigModel") -> None:
        model.params["gas"]["supply_gauge_pa"] = self.before


class DriveFault(Effect):
    """Also STO and following error: only the code differs."""

    def begin(self, model: "RigModel") -> None:
        model.fail_drive(int(self.value))

    def hold(self, model: "RigModel") -> None:
        """A fault that is still there is not reset."""
        model.fail_drive(int(self.value))

    def end(self, model: "RigModel") -> None:
        if not model._drive["bus"][0]:  # commanded by wires: no control word that could reset it
            model.machine["state"], model.machine["error_code"] = SWITCH_ON_DISABLED, 0


class CountOffset(Effect):
    """The count is off by a value: a jump of the encoder, or a wrong one from the start. The
    drive's own loops are fooled too.
    """

    def prepare(self) -> None:
        slave = next((slave for slave in self.rig.slaves if slave.device == "EPOS4"), None)
        if slave is None or f"{slave.name}.position" not in image_of(self.rig, False).places:
            raise ValueError(
                "found a rig whose drive does not report its position, expected one that does"
            )

    def begin(self, model: "RigModel") -> None:
        model.machine["offset_counts"] += int(self.value)
        model.command["target_angle_rad"] -= self.value * model._drive["rad_per_count"][0]

    def end(self, model: "RigModel") -> None:
        model.machine["offset_counts"] -= int(self.value)


class DriveSupplyLost(Effect):
    def hold(self, model: "RigModel") -> None:
        model.lose_drive_supply()


EFFECTS: dict[str, type[Effect]] = {
    "wire_broken": WireBroken,
    "sensor_stuck": SensorStuck,
    "sensor_noisy": SensorNoisy,
    "toggle_frozen": ToggleFrozen,
    "valve_stuck_open": ValveStuckOpen,
    "valve_stuck_closed": ValveStuckClosed,
    "leak": Leak,
    "supply_lost": SupplyLost,
    "drive_fault": DriveFault,
    "sto": DriveFault,
    "following_error": DriveFault,
    "encoder_jump": CountOffset,
    "count_offset": CountOffset,
    "drive_supply_lost": DriveSupplyLost,
}
