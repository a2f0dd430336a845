"""A following error: what is measured stays away from what is asked for. Finds a dead encoder and a
frozen joint sensor.
"""

from epa_rt.config.rig import Rig
from epa_rt.control.valve import SetAndHold
from epa_rt.experiments.coordinate import coordinate_of, possible_loops

LONGEST_S = (
    0.050  # a step that the drive is still catching up with passes; a sensor that stands does not
)

AIR_SHARE = 0.1  # of a held pressure: more than motion alone makes of it

Fault = tuple[str, str, str]  # cause, signal, sentence


def of_the_air(valves: tuple[tuple[SetAndHold, str], ...]) -> str:
    """What the muscles' pressures have to do with it, or nothing: a valve that gives way moves the
    rig before the valve logic, which has to tell it from heat, can be sure.
    """
    for valve, name in valves:
        gained_pa = valve.estimate_pa - valve.target_pa
        if valve.drifting and abs(gained_pa) > AIR_SHARE * valve.target_pa:
            suspect = "inlet stuck open" if gained_pa > 0.0 else "exhaust stuck open or leak"
            return (
                f"; {name}: {suspect}? It is at {valve.estimate_pa / 1e3:.1f} kPa abs, with both"
                f" valves closed since {valve.target_pa / 1e3:.1f} kPa abs"
            )
    return ""


class Following:
    """``step`` once per cycle of motion; a fault once the error has been too large for LONGEST_S.

    Watches the loop's own coordinate against its reference, and the motor's position against its
    target. An axis without ``following_error`` in the rig file is not watched. ``valves`` by
    muscle, for what the air has to do with it.
    """

    def __init__(self, rig: Rig, valves: tuple[tuple[SetAndHold, str], ...] = ()):
        self._valves = valves
        self._units = {row.name: row.si_unit for row in rig.inputs}
        self._allowed_cycles = max(1, round(LONGEST_S / rig.period_s))
        self._pairs: dict[str, tuple[str, str, float]] = {}  # reference, measured, allowed
        for loop in possible_loops(rig):
            coordinate = coordinate_of(rig, loop)
            axis = rig.joint if loop == "joint_angle" and rig.joint else rig.motor
            if coordinate.measured is not None and axis.following_error is not None:
                self._pairs[loop] = (
                    coordinate.position_key,
                    coordinate.measured,
                    axis.following_error,
                )
        motor = rig.motor
        self._of_target = (  # target, measured, allowed
            (motor.position_target, motor.position, motor.following_error)
            if motor.position_target is not None and motor.following_error is not None
            else None
        )
        self._away = 0

    def step(
        self,
        loop: str,
        measured: dict[str, float],
        reference: dict[str, float],
        command: dict[str, float],
    ) -> Fault | None:
        """Takes one cycle; all values SI."""
        pair = self._pairs.get(loop)
        if pair is not None:
            wanted, name, allowed = pair
            error = reference[wanted] - measured[name]
            if not -allowed <= error <= allowed:
                return self._is_away(error, allowed, name)
        pair = self._of_target
        if pair is not None:
            wanted, name, allowed = pair
            error = command[wanted] - measured[name]
            if not -allowed <= error <= allowed:
                return self._is_away(error, allowed, name)
        self._away = 0
        return None

    def _is_away(self, error: float, allowed: float, name: str) -> Fault | None:
        self._away += 1
        if self._away < self._allowed_cycles:
            return None
        unit = self._units[name]
        text = (
            f"{name} stays {error:.4g} {unit} away from what is asked for, more than"
            f" {allowed:.4g} {unit}{of_the_air(self._valves)}"
        )
        return "following error", name, text
