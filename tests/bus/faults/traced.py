"""An emulated bus that keeps what acts on the plant, cycle by cycle, and that brings a fault on
when the rig is where it shall hit: mid-motion, while a muscle is filled, held or vented.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from epa_rt.config.rig import Rig
from epa_rt.models.plant_file import load_plant
from sim_backend.bus.emulated_bus import EmulatedBus
from sim_backend.rig_model import RigModel
from tests.bus.driver.emulated import Remote, served
from tests.faults.moments import MOMENTS, MomentWatch, row_of

_MOVING_RAD_S = 30.0  # motor side
_GAUGE_PA = 20e3
# Of the frames, for good. They come back with a wrong working counter: to the loop the same bad
# cycle as a lost one, and nobody has to wait for it.
TWO_OF_THREE = "two_of_three_lost"


class Row(NamedTuple):
    """One plant cycle, from the plant itself, in SI: what tests.faults.moments.Row has, and more.

    ``drive_state``: of its CiA 402 machine (sim_backend/drive_machine.py). ``torque_nm``: the
    motor's.
    """

    powered: bool
    inlet_open: tuple[bool, ...]
    exhaust_open: tuple[bool, ...]
    speed_m_s: float
    travel_m: float
    pressure_pa: tuple[float, ...]
    force_n: float
    cycle: int
    drive_state: int
    torque_nm: float
    speed_rad_s: float


def traced_row(model: RigModel, muscles: int, cycle: int) -> Row:
    """What the plant and the drive's machine are doing now."""
    truth = model.state[0]["truth"]
    return Row(
        *row_of(model, muscles),
        cycle,
        int(model.machine[0]["state"]),
        float(truth["motor_torque_nm"]),
        float(truth["motor_speed_rad_s"]),
    )


class TracedBus(EmulatedBus):
    """``plan``: what ``faults.add`` takes, and in ``when`` and ``after`` the situation (or one of
    tests.faults.moments.MOMENTS, which count for themselves) and for how many cycles it has lasted.
    """

    def __init__(self, rig: Rig, lock_step: bool, plan: dict | None):
        self.rows: list[Row] = []
        self.injected_at: int | None = None
        self.last_frame_cycle = 0
        self._plan, self._lasted, self._loses = plan, 0, False
        self._holds = None if plan is None else situation(rig, plan["when"])
        super().__init__(
            rig, load_plant(Path("config/plants") / Path(rig.plant).name), 1, lock_step
        )

    def receive(self, frame: bytearray, now_ns: int) -> bool:
        if self._plan is not None and self._lasted >= self._plan["after"]:
            plan, self._plan = self._plan, None
            for fault in plan["faults"]:
                self._begin(fault)
            self.injected_at = self.cycle
        before, passes = self.counters.process_frames, self._loses and self.faults.is_idle
        answered = super().receive(frame, now_ns)
        if passes and self.counters.process_frames > before:
            self._lose_two()
        return answered

    def _lose_two(self) -> None:
        self.faults.add("wrong_working_counter", cycles=2)

    def _begin(self, fault: dict) -> None:
        if fault["kind"] == TWO_OF_THREE:
            self._loses = True
            self._lose_two()
            return
        given = {key: value for key, value in fault.items() if key != "after"}
        self.faults.add(**{"at_cycle": self.cycle + fault.get("after", 0), **given})

    def _outputs_arrived(self, plan: "object") -> None:
        if self._frame_steps:
            self.last_frame_cycle = self.cycle
        super()._outputs_arrived(plan)

    def _step(self) -> None:
        super()._step()
        row = traced_row(self.plant, len(self.rig.muscles), self.cycle - 1)
        self.rows.append(row)
        if self._plan is not None and self._holds(row):
            self._lasted += 1

    def time_goes_on(self, cycles: int) -> None:
        """The master is silent, time passes; in real time by itself."""
        for _ in range(cycles if self.lock_step else 0):
            self._step()


def _moving(row: Row, atmosphere_pa: float) -> bool:
    return (
        row.powered
        and abs(row.speed_rad_s) > _MOVING_RAD_S
        and not any(row.inlet_open)
        and not any(row.exhaust_open)
    )


def _filling(row: Row, atmosphere_pa: float) -> bool:
    return row.powered and row.inlet_open[0]


def _holding(row: Row, atmosphere_pa: float) -> bool:
    return (
        row.powered
        and not row.inlet_open[0]
        and not row.exhaust_open[0]
        and row.pressure_pa[0] > atmosphere_pa + _GAUGE_PA
    )


def _venting(row: Row, atmosphere_pa: float) -> bool:
    return row.powered and row.exhaust_open[0] and row.pressure_pa[0] > atmosphere_pa + _GAUGE_PA


SITUATIONS: dict[str, Callable[[Row, float], bool]] = {
    "start": lambda row, atmosphere_pa: True,
    "moving": _moving,
    "filling": _filling,
    "holding": _holding,
    "venting": _venting,
}


def situation(rig: Rig, when: str) -> Callable[[Row], bool]:
    """Whether it holds in a row; a moment holds once."""
    if when in MOMENTS:
        return MomentWatch(rig, when).step
    holds = SITUATIONS[when]
    return lambda row: holds(row, rig.atmosphere_pa)


@contextmanager
def traced(rig: Rig, lock_step: bool, plan: dict | None) -> Iterator[Remote]:
    """A traced bus on an interface; the master takes the other end, MASTER_END."""
    with served(TracedBus(rig, lock_step, plan)) as remote:
        yield remote
