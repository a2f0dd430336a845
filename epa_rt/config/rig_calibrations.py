"""What a calibration must fulfil to be used on a rig: a reading of its own, near what is wired."""

from typing import TYPE_CHECKING

from epa_rt.config.calibration_file import APPLIED, LARGEST_CHANGE, SignalCalibration
from epa_rt.config.source import Located
from epa_rt.config.units import UnitError

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig


def check_calibrations(rig: "Rig", located: Located) -> None:
    """Raises ConfigError for the first calibration that does not fit its row."""
    seen: set[str] = set()
    for i, one in enumerate(rig.applied_calibrations):
        where = (APPLIED, i)
        if one.signal in seen:
            raise located.error(
                (*where, "signal"), f"'{one.signal}' a second time", "each signal once"
            )
        seen.add(one.signal)
        try:
            check_calibration(rig, one)
        except UnitError as error:
            found, expected = str(error).removeprefix("found ").split(", expected ", 1)
            place = ("calibrations",) if "calibrations" in located.data else where
            raise located.error(place, found, expected) from None


def check_calibration(rig: "Rig", one: SignalCalibration) -> None:
    """Raises UnitError where it is no reading that may be calibrated, or far from the row's own
    line: then the sensor or the unit is another one.
    """
    from epa_rt.config.rig_protection_rule import entry_of
    from epa_rt.config.rig_row_checks import calibration_line
    from epa_rt.config.rig_rows import native_pair

    rows = {row.name: row for row in rig.inputs}
    row = rows.get(one.signal)
    motor = rig.motor
    if row is None or row.calibration is None:
        raise UnitError(
            f"found a calibration of '{one.signal}', expected a measured signal of the rig that has"
            " a calibration of its own"
        )
    if row.name in (motor.position, motor.speed, motor.current):
        raise UnitError(
            f"found a calibration of '{row.name}', expected a sensor at a terminal: the drive's"
            " targets have the same scale"
        )
    if row.entry != one.entry:
        raise UnitError(
            f"found {row.name} calibrated at {one.entry}, expected {row.entry}, where it is wired"
        )
    entry = entry_of(rig, row)
    if entry.unit != one.native:
        raise UnitError(
            f"found {row.name} calibrated per {one.native}, expected per {entry.unit},"
            f" the entry's own unit"
        )
    slope, intercept = calibration_line(row, entry)
    if not 1.0 / LARGEST_CHANGE < one.gain / slope < LARGEST_CHANGE:
        raise UnitError(
            f"found a gain of {one.gain:.6g} {row.si_unit}/{one.native} for {row.name}, expected it"
            f" within a factor of {LARGEST_CHANGE:g} of the row's own, {slope:.6g}"
        )
    # a line that is shifted hides as much as one that is turned: the row's own middle tells
    ends = native_pair(row.calibration.native, entry.unit)
    middle, span = 0.5 * (ends[0] + ends[1]), abs(slope * (ends[1] - ends[0]))
    shift = (one.gain - slope) * middle + one.offset - intercept
    if not abs(shift) < 0.5 * (LARGEST_CHANGE - 1.0) * span:
        raise UnitError(
            f"found a calibration of {row.name} that shifts its reading by {shift:.6g}"
            f" {row.si_unit} in the middle of the row's own, expected less than"
            f" {0.5 * (LARGEST_CHANGE - 1.0) * span:.6g} {row.si_unit}"
        )
