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
from tests.bus.driver.emulated import Remote, served

_MOVING_RAD_S = 30.0  # motor side
_GAUGE_PA = 20e3


class Row(NamedTuple):
    """One plant cycle, from the plant itself: is the drive on, which valves stand open, motor and
    first muscle in SI.
    """

    cycle: int
    enabled: bool
    inlet_open: tuple[float, ...]
    exhaust_open: tuple[float, ...]
    torque_nm: float
    speed_rad_s: float
    travel_m: float
    pressure_pa: float
    force_n: float


class TracedBus(EmulatedBus):
    """``plan``: what ``faults.add`` takes, and in ``when`` and ``after`` the situation and for how
    many cycles it has lasted.
    """

    def __init__(self, rig: Rig, lock_step: bool, plan: dict | None):
        self.rows: list[Row] = []
        self.injected_at: int | None = None
        self.last_frame_cycle = 0
        self._plan, self._lasted = plan, 0
        super().__init__(
            rig, load_plant(Path("config/plants") / Path(rig.plant).name), 1, lock_step
        )

    def receive(self, frame: bytearray, now_ns: int) -> bool:
        if self._plan is not None and self._lasted >= self._plan["after"]:
            plan, self._plan = self._plan, None
            for fault in plan["faults"]:
                self.faults.add(
                    **{
                        "at_cycle": self.cycle + fault.get("after", 0),
                        **{k: v for k, v in fault.items() if k != "after"},
                    }
                )
            self.injected_at = self.cycle
        return super().receive(frame, now_ns)

    def _outputs_arrived(self, plan: "object") -> None:
        if self._frame_steps:
            self.last_frame_cycle = self.cycle
        super()._outputs_arrived(plan)

    def _step(self) -> None:
        super()._step()
        command, inner = self.plant.command[0], self.plant.state[0]["truth"]
        muscles = len(self.rig.muscles)
        row = Row(
            self.cycle - 1,
            bool(command["enabled"] > 0.5),
            tuple(command["inlet"][:muscles].tolist()),
            tuple(command["exhaust"][:muscles].tolist()),
            float(inner["motor_torque_nm"]),
            float(inner["motor_speed_rad_s"]),
            float(inner["travel_m"]),
            float(inner["pressure_pa"][0]),
            float(inner["muscle_force_n"][0]),
        )
        self.rows.append(row)
        if self._plan is not None and SITUATIONS[self._plan["when"]](row, self.rig.atmosphere_pa):
            self._lasted += 1

    def time_goes_on(self, cycles: int) -> None:
        """The master is silent, time passes; in real time by itself."""
        for _ in range(cycles if self.lock_step else 0):
            self._step()


def _moving(row: Row, atmosphere_pa: float) -> bool:
    return (
        row.enabled
        and abs(row.speed_rad_s) > _MOVING_RAD_S
        and not any(row.inlet_open)
        and not any(row.exhaust_open)
    )


def _filling(row: Row, atmosphere_pa: float) -> bool:
    return row.enabled and row.inlet_open[0] > 0.5


def _holding(row: Row, atmosphere_pa: float) -> bool:
    return (
        row.enabled
        and not row.inlet_open[0]
        and not row.exhaust_open[0]
        and row.pressure_pa > atmosphere_pa + _GAUGE_PA
    )


def _venting(row: Row, atmosphere_pa: float) -> bool:
    return row.enabled and row.exhaust_open[0] > 0.5 and row.pressure_pa > atmosphere_pa + _GAUGE_PA


SITUATIONS: dict[str, Callable[[Row, float], bool]] = {
    "start": lambda row, atmosphere_pa: True,
    "moving": _moving,
    "filling": _filling,
    "holding": _holding,
    "venting": _venting,
}


@contextmanager
def traced(rig: Rig, lock_step: bool, plan: dict | None) -> Iterator[Remote]:
    """A traced bus on an interface; the master takes the other end, MASTER_END."""
    with served(TracedBus(rig, lock_step, plan)) as remote:
        yield remote
