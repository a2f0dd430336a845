"""Which calibrations a rig uses, how old they are, and where they may not be used."""

from datetime import UTC, datetime
from typing import TYPE_CHECKING

from epa_rt.cli.exits import VerbError

if TYPE_CHECKING:
    from epa_rt.config.calibration_file import SignalCalibration
    from epa_rt.config.rig import Rig

DAY_S = 86400.0
CLOCK_S = DAY_S  # of two machines: more means that a date or a clock is wrong


def age_s(one: "SignalCalibration", now: datetime | None = None) -> float:
    """Seconds since a calibration."""
    now = now or datetime.now(UTC)
    return (now - datetime.fromisoformat(one.when)).total_seconds()


def old_words(rig: "Rig", now: datetime | None = None) -> tuple[str, ...]:
    """A sentence for each calibration older than the rig file lets it be, or of days to come."""
    said = []
    for one in rig.applied_calibrations:
        seconds, valid = age_s(one, now), rig.calibration_valid_for
        if seconds > valid:
            said.append(
                f"{one.signal} was calibrated {seconds / DAY_S:.0f} days ago, more than"
                f" {valid / DAY_S:.0f} (calibration_valid_for): epa calibrate {one.kind}"
            )
        elif seconds < -CLOCK_S:
            said.append(
                f"{one.signal} was calibrated on {one.when[:10]}, which is still to come: check"
                " the clock"
            )
    return tuple(said)


def used_words(rig: "Rig", now: datetime | None = None) -> tuple[str, ...]:
    """Two lines for each calibration in use: when, by whom, how old; the line, how certain."""
    old = {words.split(" ", 1)[0] for words in old_words(rig, now)}
    said: list[str] = []
    for one in rig.applied_calibrations:
        days = max(age_s(one, now), 0.0) / DAY_S
        mark = " OLD" if one.signal in old else ""
        said += [f"{one.signal} {one.made}, {days:.0f} days old{mark}", f"  {one.line_words}"]
    return tuple(said)


def facts(rig: "Rig") -> dict[str, dict[str, str]]:
    """For a log's metadata; nothing where no calibration is used. No age: a log's bytes must not
    change with the day.
    """
    if not rig.applied_calibrations:
        return {}
    return {
        "calibration": {
            one.signal: f"{one.line_words}; {one.made}" for one in rig.applied_calibrations
        }
    }


def refuse_simulated(rig: "Rig") -> None:
    """A real rig does not read by what a simulation was calibrated to. Raises VerbError."""
    for one in rig.applied_calibrations:
        if one.source == "simulation":
            raise VerbError(
                f"{rig.name}: found {one.signal} calibrated on a simulation, expected a calibration"
                f" of the rig itself: epa calibrate {one.kind} --backend ethercat"
            )
