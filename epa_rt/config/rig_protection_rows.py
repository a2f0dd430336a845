"""Rules on the rows of the table: limits within what the sensor shows, freshness, commands within
what is measured.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from epa_rt.config.devices import Entry
from epa_rt.config.rig_protection_rule import (
    Breach,
    Rule,
    entry_of,
    has_toggle,
    line_of,
    native_range,
    of_row,
    place,
    range_shown,
    shown,
)
from epa_rt.config.rig_rows import SignalRow, native_pair
from epa_rt.config.units import unit

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig

WATCHED_UNITS = {
    "N": "force",
    "Pa": "pressure",
    "m/s": "speed",
    "rad/s": "speed",
    "A": "current",
    "m": "travel",
    "rad": "travel",
}
# of what a sensor shows; limits that fill less: another unit, or nothing is resolved there
LEAST_OF_RANGE = 0.1
# a travel limit further out than the whole range that may be asked for stops nothing in time
BEYOND_RANGES = 1.0
# a speed limit above this multiple of what may be asked for is reached by a runaway alone
BEYOND_SPEEDS = 4.0
# at five times the continuous current the winding's heat passes its limit in 1/25 of its time
# constant: the limit of the row has to come first
BEYOND_CURRENTS = 5.0
# NAMUR NE 43: below and above a 4-20 mA sensor says that it has failed
FAILED_A = (3.6e-3, 21e-3)
_EXACT_A = 1e-9
_CURRENT, _COUNT = unit("A")[1], unit("count")[1]


def _watched(rig: "Rig") -> Iterator[SignalRow]:
    return (r for r in rig.inputs if r.si_unit in WATCHED_UNITS and not r.name.endswith("_raw"))


def _limits(rig: "Rig") -> Iterator[Breach]:
    for row in _watched(rig):
        if row.limits is None:
            what = WATCHED_UNITS[row.si_unit]
            yield of_row(
                rig, row, "name", f"a {what} without limits", "limits: [low, high], which trip"
            )


def _within_sensor(rig: "Rig") -> Iterator[Breach]:
    """Limits beyond what the sensor shows never trip: the reading ends before them."""
    for row in _watched(rig):
        if row.limits is None:
            continue
        slope, intercept = line_of(rig, row)
        ends = sorted(slope * native + intercept for native in native_range(rig, row))
        slack = 1e-6 * (ends[1] - ends[0])
        if row.limits[0] < ends[0] - slack or row.limits[1] > ends[1] + slack:
            yield of_row(
                rig,
                row,
                "limits",
                f"limits of {range_shown(row.limits, row.si_unit)}",
                "limits within what calibration, terminal and 'valid' let it show,"
                f" {range_shown((ends[0], ends[1]), row.si_unit)}",
            )


def _of_range(rig: "Rig") -> Iterator[Breach]:
    """A calibration in a unit a thousand times too large shows a whole fill as a breath."""
    for row in _watched(rig):
        if row.limits is None or not has_toggle(rig, row):
            continue
        if unit(entry_of(rig, row).unit)[1] == _COUNT:
            continue  # a counter counts on far beyond what it is used for
        slope, intercept = line_of(rig, row)
        low, high = sorted(slope * native + intercept for native in native_range(rig, row))
        if row.limits[1] - row.limits[0] < LEAST_OF_RANGE * (high - low):
            yield of_row(
                rig,
                row,
                "limits",
                f"limits of {range_shown(row.limits, row.si_unit)} on a sensor that shows"
                f" {range_shown((low, high), row.si_unit)}",
                "limits over a tenth of that at least: is the unit of its calibration right?",
            )


def _at_rest(rig: "Rig") -> Iterator[Breach]:
    """A rig at rest must lie within its limits, or no run starts and a vented one trips."""
    for row in _watched(rig):
        if row.limits is None or row.si_unit in ("m", "rad"):
            continue
        rest = rig.atmosphere_pa if row.si_unit == "Pa" else 0.0
        if not row.limits[0] < rest < row.limits[1]:
            yield of_row(
                rig,
                row,
                "limits",
                f"limits of {range_shown(row.limits, row.si_unit)}",
                f"limits on both sides of {shown(rest, row.si_unit)}, where it is at rest",
            )


def _valid(rig: "Rig") -> Iterator[Breach]:
    """A broken wire reads 0 V or the end of the range; 'valid' tells it from a value."""
    for row in rig.inputs:
        if not has_toggle(rig, row) or row.name.endswith("_raw"):
            continue
        entry = entry_of(rig, row)
        if unit(entry.unit)[1] == _COUNT:
            continue  # a counter has no voltage to judge: its terminal tells of open circuits
        if row.valid is None:
            yield of_row(
                rig,
                row,
                "name",
                f"an analog input at {row.entry} without 'valid'",
                "valid: [low, high] of the sensor's own signal, so that a broken wire trips",
            )
            continue
        valid, ends = native_pair(row.valid, entry.unit), entry.native_ends
        if unit(entry.unit)[1] == _CURRENT:
            yield from _live_zero(rig, row, entry, valid)
            continue
        if valid[0] <= ends[0] or valid[1] >= ends[1]:
            yield of_row(
                rig,
                row,
                "valid",
                f"{range_shown(valid, entry.unit)}",
                f"a range inside of what the terminal shows, {range_shown(ends, entry.unit)}",
            )
        if row.calibration is not None:
            points = native_pair(row.calibration.native, entry.unit)
            if min(points) > 0.0 and valid[0] <= 0.0:
                yield of_row(
                    rig,
                    row,
                    "valid",
                    f"{range_shown(valid, entry.unit)} on a sensor that begins at"
                    f" {shown(min(points), entry.unit)}",
                    "a lower end above 0 V, which a broken wire reads",
                )


def _live_zero(
    rig: "Rig", row: SignalRow, entry: Entry, valid: tuple[float, float]
) -> Iterator[Breach]:
    """4 to 20 mA: a sound sensor gives 3.8 to 20.5 mA and says outside of 3.6 to 21 mA that it has
    failed; a broken wire carries none (NAMUR NE 43).
    """
    ampere = unit(entry.unit)[0]
    low, high = (end * ampere for end in valid)
    if low < FAILED_A[0] - _EXACT_A or high > FAILED_A[1] + _EXACT_A:
        yield of_row(
            rig,
            row,
            "valid",
            f"{range_shown(valid, entry.unit)}",
            "a range within 3.6 to 21 mA, outside of which a sensor or its wire has failed",
        )
    if row.calibration is not None:
        points = native_pair(row.calibration.native, entry.unit)
        if min(points) < valid[0] or max(points) > valid[1]:
            yield of_row(
                rig,
                row,
                "valid",
                f"{range_shown(valid, entry.unit)} on a sensor of"
                f" {range_shown((min(points), max(points)), entry.unit)}",
                "a range that holds all of its signal: 'valid: [3.6 mA, 21 mA]' for 4 to 20 mA",
            )


def _stale_after(rig: "Rig") -> Iterator[Breach]:
    """A converter that stands must show before the slaves themselves would give up."""
    most = int(rig.safety.watchdog / rig.period_s + 1e-9)
    for row in rig.inputs:
        if not has_toggle(rig, row) or row.name.endswith("_raw"):
            continue
        if row.stale_after is None:
            found = f"an analog input at {row.entry} without 'stale_after'"
            expected = "stale_after: CYCLES, so that a converter that stands trips"
            yield of_row(rig, row, "name", found, expected)
        elif row.stale_after > most:
            milliseconds = 1e3 * rig.safety.watchdog
            yield of_row(
                rig,
                row,
                "stale_after",
                f"{row.stale_after} cycles of {1e3 * rig.period_s:g} ms",
                f"at most {most}, the watchdog's {milliseconds:g} ms",
            )


def _slew(rig: "Rig") -> Iterator[Breach]:
    for row in rig.outputs:
        if row.limits is not None and row.slew is None:
            yield of_row(
                rig, row, "name", "a command without slew", "slew: RATE, so that it cannot jump"
            )


def _pairs(rig: "Rig") -> Iterator[tuple[SignalRow, SignalRow]]:
    """Commands of the motor with the row that measures what they ask for."""
    motor = rig.motor
    for target, measured in (
        (motor.position_target, motor.position),
        (motor.speed_target, motor.speed),
    ):
        if target is not None and measured is not None:
            yield rig.row(target), rig.row(measured)


def _command_in_measured(rig: "Rig") -> Iterator[Breach]:
    """What may be asked for must not trip, and what trips must not be asked for."""
    for command, measured in _pairs(rig):
        if command.limits is None or measured.limits is None:
            continue
        low, high = measured.limits
        if command.limits[0] < low - 1e-9 or command.limits[1] > high + 1e-9:
            yield of_row(
                rig,
                command,
                "limits",
                f"limits of {range_shown(command.limits, command.si_unit)}",
                f"limits within those of {measured.name},"
                f" {range_shown(measured.limits, measured.si_unit)}",
            )
    motor = rig.motor
    speed_limits = rig.row(motor.speed).limits if motor.speed else None
    if speed_limits is None:
        return
    fastest = min(abs(end) for end in speed_limits)
    si_unit = rig.row(motor.speed).si_unit if motor.speed else ""
    if motor.position_target is not None:
        target = rig.row(motor.position_target)
        if target.slew is not None and target.slew > fastest + 1e-9:
            yield of_row(
                rig,
                target,
                "slew",
                shown(target.slew, si_unit),
                f"at most the limit of {motor.speed}, {shown(fastest, si_unit)}",
            )
    if motor.speed_max > fastest + 1e-9:
        expected = f"at most the limit of {motor.speed}, {shown(fastest, si_unit)}"
        found = shown(motor.speed_max, si_unit)
        yield Breach("", ("motor", "speed_max"), f"speed_max: {found}", expected)


def _reach(rig: "Rig") -> Iterator[Breach]:
    """Limits of motion must lie near what may be asked for, or they are passed by a runaway only
    after it has done its damage.
    """
    yield from _travel_reach(rig)
    motor = rig.motor
    row = rig.row(motor.speed) if motor.speed else None
    if row is not None and row.limits is not None:
        target = rig.row(motor.speed_target).limits if motor.speed_target else None
        asked = max(motor.speed_max, *(abs(end) for end in target or (0.0,)))
        widest = max(abs(end) for end in row.limits)
        if widest > BEYOND_SPEEDS * asked:
            yield of_row(
                rig,
                row,
                "limits",
                shown(widest, row.si_unit),
                f"at most {BEYOND_SPEEDS:g} times what may be asked for,"
                f" {shown(asked, row.si_unit)}",
            )
    commanded = rig.row(motor.speed_target) if motor.speed_target else None
    if commanded is not None and commanded.limits is not None:
        widest = max(abs(end) for end in commanded.limits)
        if widest > BEYOND_SPEEDS * motor.speed_max:
            yield of_row(
                rig,
                commanded,
                "limits",
                shown(widest, commanded.si_unit),
                f"at most {BEYOND_SPEEDS:g} times motor.speed_max,"
                f" {shown(motor.speed_max, commanded.si_unit)}",
            )
    i2t = rig.safety.i2t
    current = rig.row(i2t.current) if i2t is not None else None
    if i2t is not None and current is not None and current.limits is not None:
        widest = max(abs(end) for end in current.limits)
        if widest > BEYOND_CURRENTS * i2t.continuous:
            yield of_row(
                rig,
                current,
                "limits",
                shown(widest, "A"),
                f"at most {BEYOND_CURRENTS:g} times the continuous current,"
                f" {shown(i2t.continuous, 'A')}",
            )


def _travel_reach(rig: "Rig") -> Iterator[Breach]:
    motor, row = rig.motor, rig.row(rig.motor.position)
    asked = list(motor.places.values())
    if motor.position_target is not None:
        asked += rig.row(motor.position_target).limits or ()
    if row.limits is None or len(asked) < 2 or max(asked) == min(asked):
        return
    low, high = min(asked), max(asked)
    room = BEYOND_RANGES * (high - low)
    if row.limits[0] < low - room or row.limits[1] > high + room:
        yield of_row(
            rig,
            row,
            "limits",
            f"limits of {range_shown(row.limits, row.si_unit)}",
            "limits that end at most one range outside of what may be asked for,"
            f" {range_shown((low, high), row.si_unit)}",
        )


def _watched_speed(rig: "Rig") -> Iterator[Breach]:
    """Position and speed of the motor check each other; without limits on speed they cannot."""
    if rig.motor.speed is None:
        yield Breach(
            "",
            ("motor",),
            "no 'speed'",
            "speed: ROW, which limits the motor's speed and contradicts a dead encoder",
        )
    if rig.motor.current is None:
        yield Breach("", ("motor",), "no 'current'", "current: ROW, the motor's current")


def _pressure_rises(rig: "Rig") -> Iterator[Breach]:
    for row in rig.inputs:
        if row.si_unit == "Pa" and line_of(rig, row)[0] < 0.0:
            yield Breach(
                row.name,
                place(rig, row.name, "calibration"),
                "a pressure that falls as the signal rises",
                "a pressure that rises with its signal, as every gauge's does",
            )


ROW_RULES = (
    Rule(
        "limits", _limits, "every force, pressure, speed, current and travel has limits, which trip"
    ),
    Rule(
        "within_sensor",
        _within_sensor,
        "limits lie within what calibration, terminal and `valid` can show",
    ),
    Rule(
        "range_used",
        _of_range,
        "limits of an analog input fill at least a tenth of what it can show",
    ),
    Rule(
        "at_rest",
        _at_rest,
        "limits enclose the rig at rest: atmosphere, no force, no speed, no current",
    ),
    Rule(
        "valid",
        _valid,
        "an analog input has `valid`, narrower than its terminal and fit for its sensor",
    ),
    Rule(
        "stale_after", _stale_after, "an analog input has `stale_after`, within the watchdog's time"
    ),
    Rule("slew", _slew, "a command with limits has `slew`"),
    Rule(
        "command_in_measured",
        _command_in_measured,
        "what may be asked for lies within the limits of what measures it",
    ),
    Rule("reach", _reach, "limits of travel, speed and current lie near what may be asked for"),
    Rule("motor_measured", _watched_speed, "the motor names its `speed` and `current`"),
    Rule("pressure_rises", _pressure_rises, "a pressure rises with its signal"),
)
