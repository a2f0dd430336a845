"""One simulated rig over several runs: it keeps its motor's place, its air and its zero between
them.
"""

from pathlib import Path

from epa_rt.cli.inputs import Inputs
from epa_rt.experiments.homing import Homing, SettingZero
from epa_rt.experiments.index_homing import SeekingIndex
from epa_rt.experiments.jogging import Jogging, Keys, Script, parse_order
from epa_rt.loop.assembly import Assembly, assemble
from epa_rt.loop.by_hand import assemble_homing, assemble_index, assemble_jog, assemble_setting
from epa_rt.loop.run import RunResult, run
from epa_rt.models import plant as nominal_physics
from epa_rt.signals.codec import Encoder
from sim_backend.backend import SimBackend
from sim_backend.faults import PLANT_FAULTS, FaultyRigModel, make_fault
from tests.loop.rigging import Memory, Quiet, tiny_inputs

PULSE_CYCLES = 500  # for the plant to come to rest after a run, with its outputs safe


class Pressing(Quiet):
    """Requests that press keys on the way, as the terminal's do."""

    def __init__(self, keys: Keys, presses: dict[int, str]):
        super().__init__()
        self._keys, self._presses = keys, presses

    def poll(self, cycle: int) -> int:
        if cycle in self._presses:
            self._keys.press(self._presses[cycle], cycle)
        return super().poll(cycle)


class OneRig:
    """``experiment``, ``jog``, ``home`` and ``set_zero`` run on the rig as the last one left it.

    ``memory`` holds the last run's samples and events.
    """

    def __init__(self, folder: Path, name: str = "bench", loop: str = "motor_speed"):
        self.inputs: Inputs = tiny_inputs(folder, name, loop)
        self.rig = self.inputs.rig
        self.model = FaultyRigModel(self.rig, self.inputs.plant, 1)
        self.memory = Memory()

    def stop_at(self, angle_rad: float) -> None:
        """Puts an end stop in the way of the motor, without give."""
        from epa_rt.models.ports import ANGLE, SPEED

        def advance(params, state, *others):
            nominal_physics.advance(params, state, *others)
            smooth = state["smooth"][0]
            if smooth[ANGLE] > angle_rad:
                smooth[ANGLE], smooth[SPEED] = angle_rad, min(smooth[SPEED], 0.0)

        self.model._advance = advance

    def break_it(self, kind: str, where: str = "", at_cycle: int = 0, **more) -> None:
        fault = make_fault(PLANT_FAULTS, kind, where, at_cycle=at_cycle, **more)
        self.model.faults.add(fault)

    def mend(self, rest_cycles: int = PULSE_CYCLES) -> None:
        """Ends all faults; time goes on without power and with the muscles open."""
        self.model.faults.clear(self.model)
        safe = Encoder(self.rig).safe_raw
        for _ in range(rest_cycles):
            self.model.cycle(safe)

    @property
    def travel_m(self) -> float:
        """Where the motor truly is."""
        return float(self.model.state["truth"]["travel_m"][0])

    def experiment(self) -> RunResult:
        return self._run(assemble(self.rig, self.inputs.experiment))

    def jog(self, *orders: str, known: bool = True) -> tuple[RunResult, Jogging]:
        script = Script([parse_order(order, self.rig) for order in orders])
        assembly, jog = assemble_jog(self.rig, script, known)
        return self._run(assembly), jog

    def keys(self, presses: dict[int, str]) -> tuple[RunResult, Jogging]:
        """A jog by keys, by the cycle in which each is pressed."""
        keys = Keys()
        assembly, jog = assemble_jog(self.rig, keys)
        return self._run(assembly, Pressing(keys, presses)), jog

    def home(self) -> tuple[RunResult, Homing]:
        assembly, plan = assemble_homing(self.rig, self.rig.motor.zero)
        return self._run(assembly), plan

    def set_zero(self, place: float | None = None) -> tuple[RunResult, SettingZero]:
        assembly, plan = assemble_setting(self.rig, self.rig.motor.zero, place)
        return self._run(assembly), plan

    def seek_index(self, requests: object = None) -> tuple[RunResult, SeekingIndex]:
        """The drive's own homing on its index pulse, as the rig's zero section says."""
        assembly, plan = assemble_index(self.rig)
        self.assembly = assembly
        return self._run(assembly, requests), plan

    def _run(self, assembly: Assembly, requests: object = None) -> RunResult:
        backend = SimBackend(self.rig, self.inputs.plant, model=self.model, homing=assembly.homing)
        self.memory = Memory()
        return run(
            self.rig,
            backend,
            assembly.supervisor,
            assembly.envelope,
            assembly.decoder,
            assembly.encoder,
            self.memory,
            requests or Quiet(),
        )

    def measured(self, name: str) -> list[float]:
        return [sample[6][name] for sample in self.memory.samples]
