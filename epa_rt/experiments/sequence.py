"""Runs an experiment cycle by cycle: references out, valves told, from phase to phase. Knows time
only as cycles.
"""

import math
from collections.abc import Mapping
from typing import Any

from epa_rt.config.rig import Rig
from epa_rt.experiments.coordinate import Coordinate, coordinate_of, possible_loops
from epa_rt.experiments.experiment import Experiment
from epa_rt.experiments.profiles import Braking, Profile
from epa_rt.experiments.valve_crew import Valve, ValveCrew, finite

Event = tuple[str, str, dict[str, Any]]


class Sequence:
    """``begin`` once, then ``step`` in every cycle.

    ``events`` grows by (kind, text, data); the caller drains it. ``loop_changed`` is True in a
    cycle in which the controller must be reset. A failure (a sentence) brakes the motion and ends
    the run.
    """

    def __init__(self, experiment: Experiment, rig: Rig, valves: Mapping[str, Valve]):
        self.experiment, self.period_s = experiment, rig.period_s
        self.events: list[Event] = []
        self.phase_index, self.phase = -1, experiment.phases[0]
        self.loop, self.loop_changed = self.phase.loop, False
        self.finished = False
        self.failure: str | None = None
        self._crew = ValveCrew(rig, valves)
        self._valves = tuple(valves.items())
        self._pressures = tuple(muscle.pressure for muscle in rig.muscles)
        coordinates = {loop: coordinate_of(rig, loop) for loop in possible_loops(rig)}
        self.reference_names = _reference_names(coordinates, self._pressures, experiment.loops)
        self._motion_keys = self.reference_names[: len(self.reference_names) - len(self._pressures)]
        self._cycle_in_phase, self._position, self._speed, self._speed_before = 0, 0.0, 0.0, 0.0
        self._profile: Profile | None = None
        self._braking = False

    def begin(self, measured: Mapping[str, float]) -> None:
        """Closes the valves and starts from where the rig is: the first reference is the measured
        position.
        """
        self._crew.begin(measured)
        self.phase_index, self.finished, self.failure = -1, False, None
        self._profile, self._braking = None, False

    def step(self, measured: Mapping[str, float], reference: dict[str, float], cycle: int) -> None:
        """Writes this cycle's ``ref_*`` in place; moves on to the next phase where the present one
        is over.
        """
        self.loop_changed = False
        if self._profile is None:
            if self.finished:
                return  # stopped before anything began
            self._at_due(measured, reference, cycle)
        elif self._cycle_in_phase >= self._due:
            self._at_due(measured, reference, cycle)
        for name, valve in self._valves:
            if valve.failure is not None and self.failure is None and not self.finished:
                self._fail(f"valves of the muscle {name}: {valve.failure}", cycle)
        self._speed_before = self._speed
        in_phase = self._cycle_in_phase
        self._position, self._speed = position, speed = self._at(in_phase * self.period_s)
        reference[self._position_key] = position
        reference[self._speed_key] = speed
        self._cycle_in_phase = in_phase + 1

    def brake(self, cycle: int = -1) -> None:
        """Operator stop: from the present reference to rest; ``finished`` once at rest.

        What fills is closed. What vents goes on, and a failed valve stays as it failed: both are on
        the safe side.
        """
        if self._profile is None:
            self._finish(cycle)
        if self._braking or self.finished:
            return
        self._braking = True
        self._crew.stop()
        deceleration = 0.5 * self.phase.coordinate.acceleration_max
        if math.isfinite(deceleration):
            acceleration = (self._speed - self._speed_before) / self.period_s
            acceleration = max(-2.0 * deceleration, min(2.0 * deceleration, acceleration))
            self._follow(Braking(self._position, self._speed, deceleration, acceleration))
        else:
            self._follow(Braking(0.0, 0.0, 1.0))  # a torque held would go on driving the motor
        self._due = self._motion_cycles
        self._cycle_in_phase = 1  # its time zero is the reference of the cycle before
        self.events.append(
            ("brake", f"braking in {self.phase.name}", {"phase": self.phase.name, "cycle": cycle})
        )

    def _at_due(
        self, measured: Mapping[str, float], reference: dict[str, float], cycle: int
    ) -> None:
        """The motion is over, or the run begins: on to the next phase, unless a condition has to be
        waited for.
        """
        if self._profile is None:
            self._enter(0, measured, reference, cycle)
        elif self._braking:
            self._finish(cycle)
        elif not self.finished and self._over(measured, cycle):
            self._end_phase(cycle)
            if self.phase_index + 1 < len(self.experiment.phases):
                self._enter(self.phase_index + 1, measured, reference, cycle)
            else:
                self._finish(cycle)

    def _over(self, measured: Mapping[str, float], cycle: int) -> bool:
        phase, waiting = self.phase, None
        for i, condition in enumerate(phase.conditions):
            if condition.signal is None:
                holds = all(valve.settled for _, valve in self._valves)
            else:
                holds = (
                    condition.sign * (measured[condition.signal] - condition.value) > 0.0
                )  # never for NaN
                self._steady[i] = self._steady[i] + 1 if holds else 0
                holds = self._steady[i] >= condition.steady_cycles
            if not holds and waiting is None:
                waiting = condition
        if waiting is None:
            return True
        if self._cycle_in_phase >= phase.timeout_cycles:
            self._fail(
                f"{phase.name}: timed out after {self._cycle_in_phase * self.period_s:g} s, waiting"
                f" for {waiting.text}",
                cycle,
            )
        return False

    def _enter(
        self, index: int, measured: Mapping[str, float], reference: dict[str, float], cycle: int
    ) -> None:
        phase, before = (
            self.experiment.phases[index],
            (self.phase if self._profile is not None else None),
        )
        self.loop_changed = before is None or phase.loop != before.loop
        start = self._position
        if self.loop_changed:  # where the rig is, so that nothing jumps; a torque starts from none
            start = measured[phase.coordinate.measured] if phase.coordinate.measured else 0.0
        valid = math.isfinite(start)
        self.phase_index, self.phase, self.loop = index, phase, phase.loop
        self._steady = [0] * len(phase.conditions)
        if self.loop_changed:
            # NaN: a coordinate that nothing controls now has no reference
            reference.update(dict.fromkeys(self._motion_keys, math.nan))
        self._position_key, self._speed_key = (
            phase.coordinate.position_key,
            phase.coordinate.speed_key,
        )
        self._position = start = start if valid else 0.0
        self._follow(phase.profile(start))
        self._due = self._motion_cycles if phase.cycles is None else phase.cycles
        self._crew.tell(phase.orders)
        reference.update(self._crew.targets)
        data = {
            "phase": phase.name,
            "index": index,
            "cycle": cycle,
            "loop": phase.loop,
            "trial_index": phase.trial_index,
            "repetition": phase.repetition,
            "values": dict(phase.values),
            "targets": finite(self._crew.targets),
            "pressures": finite({signal: measured[signal] for signal in self._pressures}),
        }
        self.events.append(("phase_start", phase.name, data))
        if not valid:
            self._fail(
                f"{phase.name}: {phase.coordinate.measured} is not valid where its loop takes over",
                cycle,
            )

    def _follow(self, profile: Profile) -> None:
        self._profile, self._at = profile, profile.at
        self._motion_cycles = max(math.ceil(profile.duration_s / self.period_s - 1e-6), 0)
        self._cycle_in_phase = 0

    def _end_phase(self, cycle: int) -> None:
        data = {
            "phase": self.phase.name,
            "index": self.phase_index,
            "cycle": cycle,
            "duration_s": self._cycle_in_phase * self.period_s,
        }
        self.events.append(("phase_end", self.phase.name, data))

    def _finish(self, cycle: int) -> None:
        if not self.finished:
            self.finished = True
            if self._profile is not None and math.isinf(self.phase.coordinate.acceleration_max):
                self._follow(
                    Braking(0.0, 0.0, 1.0)
                )  # the motor is to come to rest, which a torque does not let it
            self.events.append(
                ("finished", self.failure or "experiment finished", {"cycle": cycle})
            )

    def _fail(self, sentence: str, cycle: int) -> None:
        self.failure = sentence
        self.events.append(("failure", sentence, {"cycle": cycle, "phase": self.phase.name}))
        self.brake(cycle)


def _reference_names(
    coordinates: Mapping[str, Coordinate], pressures: tuple[str, ...], loops: tuple[str, ...]
) -> tuple[str, ...]:
    names: dict[str, None] = {}
    for loop, coordinate in coordinates.items():
        if loop != "motor_torque" or loop in loops:
            names.update({coordinate.position_key: None, coordinate.speed_key: None})
    names.update({f"ref_{signal}": None for signal in pressures})
    return tuple(names)
