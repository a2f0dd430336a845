"""A plan that moves the motor at speeds asked for while it runs: the base of jogging and homing."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping

from epa_rt.config.rig import Rig
from epa_rt.experiments.coordinate import coordinate_of
from epa_rt.experiments.experiment import ValveOrder
from epa_rt.experiments.plan import Event
from epa_rt.experiments.valve_crew import Valve, ValveCrew

RAMP_S = 0.1  # from rest to full speed: shorter than a hand feels, without a jerk
ARRIVED = 1e-9  # m or rad: rounding, not a distance


class SpeedPlan(ABC):
    """The reference travel follows ``_wanted`` (m/s or rad/s), or goes to ``_goal``; it is a
    ``Plan``.

    ``phase_names`` name the values of ``phase_index``. A subclass decides in ``_decide``.
    """

    phase_names: tuple[str, ...] = ()

    def __init__(self, rig: Rig, valves: Mapping[str, Valve], speed_max: float):
        coordinate = coordinate_of(rig, "motor_speed")
        self.events: list[Event] = []
        self.loop, self.loop_changed = "motor_speed", False
        self.failure: str | None = None
        self.finished, self.phase_index = False, -1
        self._position, self._valves = rig.motor.position, valves
        self._over = [(m.name, m.pressure, m.pressure_max) for m in rig.muscles]
        self._travel_key, self._speed_key = coordinate.position_key, coordinate.speed_key
        pressures = tuple(f"ref_{muscle.pressure}" for muscle in rig.muscles)
        self.reference_names = (self._travel_key, self._speed_key, *pressures)
        self._crew = ValveCrew(rig, valves)
        self._dt_s, self._speed_step = rig.period_s, speed_max * rig.period_s / RAMP_S
        self._deceleration = speed_max / RAMP_S
        self.travel = self._speed = self._wanted = self._goal_speed = 0.0
        self._goal: float | None = None
        self._first, self._braking = True, False

    @abstractmethod
    def _decide(self, measured: Mapping[str, float], cycle: int) -> None:
        """Sets ``_wanted`` or a goal, valves, phase, failure or ``finished``, once per cycle."""

    def begin(self, measured: Mapping[str, float]) -> None:
        """Starts from where the rig is. A muscle above its ``pressure_max`` vents."""
        self._crew.begin(measured)
        self._crew.tell(
            ValveOrder(name, "vent")
            for name, signal, most_pa in self._over
            if not measured[signal] <= most_pa
        )
        self.travel, self._speed, self._wanted, self._goal = (
            measured[self._position],
            0.0,
            0.0,
            None,
        )
        self.finished, self.failure, self._first, self._braking = False, None, True, False

    def step(self, measured: Mapping[str, float], reference: dict[str, float], cycle: int) -> None:
        """Writes this cycle's references in place."""
        self.loop_changed, self._first = self._first, False
        if self.phase_index < 0:
            self._enter(0, cycle)
        if not (self._braking or self.finished):
            self._decide(measured, cycle)
        self._advance()
        if self._braking and self._speed == 0.0:
            self._finish(self.failure or "stopped", cycle)
        reference[self._travel_key], reference[self._speed_key] = self.travel, self._speed
        reference.update(self._crew.targets)

    def brake(self, cycle: int = -1) -> None:
        """From the present speed to rest; ``finished`` once there. What vents goes on."""
        if not (self._braking or self.finished):
            self._braking, self._wanted, self._goal = True, 0.0, None
            self._crew.stop()

    @property
    def arrived(self) -> bool:
        """No goal is left, and the reference rests."""
        return self._goal is None and self._speed == 0.0

    def go_to(self, travel: float, speed: float) -> None:
        """To a travel (m or rad) at a speed above zero, and rest there."""
        self._goal, self._goal_speed = travel, speed

    def _advance(self) -> None:
        wanted, goal = self._wanted, self._goal
        if goal is not None:
            left = goal - self.travel
            if abs(left) <= max(ARRIVED, abs(self._speed) * self._dt_s) and (
                abs(self._speed) <= 2.0 * self._speed_step
            ):
                self.travel, self._speed, self._goal, self._wanted = goal, 0.0, None, 0.0
                return
            fastest = math.sqrt(2.0 * self._deceleration * abs(left))
            wanted = math.copysign(min(self._goal_speed, fastest), left)
        change = wanted - self._speed
        if abs(change) <= self._speed_step:
            self._speed = wanted
        else:
            self._speed += math.copysign(self._speed_step, change)
        self.travel += self._speed * self._dt_s

    def _rest_at(self, travel: float) -> None:
        """The reference stands at once, here: the motor has been stopped by something else."""
        self.travel, self._speed, self._wanted, self._goal = travel, 0.0, 0.0, None

    def _enter(self, index: int, cycle: int) -> None:
        self.phase_index = index
        name = self.phase_names[index]
        self.events.append(("phase_start", name, {"phase": name, "index": index, "cycle": cycle}))

    def _fail(self, sentence: str, cycle: int) -> None:
        self.failure = sentence
        self.events.append(("failure", sentence, {"cycle": cycle}))
        self.brake(cycle)

    def _finish(self, text: str, cycle: int) -> None:
        if not self.finished:
            self.finished = True
            self.events.append(("finished", text, {"cycle": cycle}))
