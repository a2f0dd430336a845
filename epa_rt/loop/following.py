"""A following error: what is measured stays away from what is asked for. Finds a dead encoder and a frozen joint sensor."""

from epa_rt.config.rig import Rig
from epa_rt.experiments.coordinate import coordinate_of, possible_loops

LONGEST_S = 0.050  # a step that the drive is still catching up with passes; a sensor that stands does not

Fault = tuple[str, str, str]  # cause, signal, sentence


class Following:
    """``step`` once per cycle of motion; a fault once the error has been too large for LONGEST_S.

    Watches the loop's own coordinate against its reference, and the motor's position against its target. An axis
    without ``following_error`` in the rig file is not watched.
    """

    def __init__(self, rig: Rig):
        self._allowed_cycles = max(1, round(LONGEST_S / rig.period_s))
        self._pairs = {}
        for loop in possible_loops(rig):
            coordinate = coordinate_of(rig, loop)
            axis = rig.joint if loop == "joint_angle" else rig.motor
            if coordinate.measured is not None and axis.following_error is not None:
                self._pairs[loop] = (coordinate.position_key, coordinate.measured, axis.following_error)
        self._target, self._position, self._allowed = rig.motor.position_target, rig.motor.position, rig.motor.following_error
        self._away = 0

    def step(self, loop: str, measured: dict[str, float], reference: dict[str, float], command: dict[str, float]) -> Fault | None:
        """Takes one cycle; all values SI."""
        error, allowed, name = 0.0, 1.0, ""
        pair = self._pairs.get(loop)
        if pair is not None:
            error, allowed, name = reference[pair[0]] - measured[pair[1]], pair[2], pair[1]
        if self._target is not None and self._allowed is not None and abs(error) <= allowed:
            error, allowed, name = command[self._target] - measured[self._position], self._allowed, self._position
        if abs(error) <= allowed:
            self._away = 0
            return None
        self._away += 1
        if self._away < self._allowed_cycles:
            return None
        return "following error", name, f"{name} stays {error:.4g} away from what is asked for, more than {allowed:.4g}"
