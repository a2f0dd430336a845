"""Whether the motor's travel has a zero: the drive's own bit, or the count where it ended last."""

from collections.abc import Mapping

from epa_rt.config.rig import Rig
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import Scaling, scaling_of

REFERENCED = 0x8000  # status word bit 15: position referenced to home (maxon EPOS4, 0x6041)
HOME = "home it first: epa home --rig RIG"

Fault = tuple[str, str, str]  # cause, signal, sentence


def position_scaling(rig: Rig) -> Scaling:
    """The straight line between counts and the travel of the motor."""
    row = rig.row(rig.motor.position)
    return scaling_of(row, image_of(rig, outputs=False).places[row.entry].entry, rig)


class Referenced:
    """``refusal``: None, or why a run must not start.

    A wired drive has no bit: its count must be where the last run left it, within ``end_band``. In
    a simulation no file says where that was, and nothing is checked.
    """

    def __init__(self, rig: Rig):
        zero, applied = rig.motor.zero, rig.applied_zero
        self._position, self._status = rig.motor.position, ""
        self._end, self._band = None, 0.0
        if rig.drive.interface == "cia402":
            self._status = rig.drive.status_word
        elif applied is not None and applied.end is not None:
            self._end, self._band = position_scaling(rig).to_si(applied.end), zero.end_band

    def refusal(self, measured: Mapping[str, float]) -> Fault | None:
        """From one measured row, at rest."""
        if self._status and not int(measured[self._status]) & REFERENCED:
            return (
                "unreferenced",
                self._status,
                "the drive's position is not referenced to home (status word bit 15 is 0, as after"
                f" a loss of its supply), so travel has no zero; {HOME}",
            )
        if self._end is not None and not abs(measured[self._position] - self._end) <= self._band:
            away = measured[self._position] - self._end
            return (
                "unreferenced",
                self._position,
                f"the motor's count is {1e3 * away:.4g} mm from where the last run left it, more"
                f" than {1e3 * self._band:.4g} mm, so the zero may be lost; {HOME}",
            )
        return None

    def holds(self, measured: Mapping[str, float]) -> bool:
        """Whether travel has a zero, as far as this can tell."""
        return self.refusal(measured) is None
