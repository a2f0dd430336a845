"""What one row of the table must fulfil: its kind of entry, its calibration, its port, what is
safe.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

from epa_rt.config.calibration_file import calibration_of
from epa_rt.config.devices import DEVICES, Entry
from epa_rt.config.ports import DRIVE_ENABLE_PORT, DRIVE_SPEED_PORT, MEASURED_PORTS, VALVE_PORTS
from epa_rt.config.rig_rows import SignalRow, native_pair, si_unit_of
from epa_rt.config.source import Located
from epa_rt.config.units import (
    UnitError,
    parse_quantity,
    readable,
    readable_range,
    split_quantity,
    unit,
)

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig


def calibration_line(row: SignalRow, entry: Entry) -> tuple[float, float]:
    """Slope and intercept from native unit to the row's SI unit (gauge where the row reads gauge).
    Raises UnitError.
    """
    if row.calibration is None:
        return 1.0, 0.0
    x0, x1 = native_pair(row.calibration.native, entry.unit)
    y0, y1 = (parse_quantity(value, row.si_unit or "1") for value in row.calibration.value)
    if x0 == x1 or y0 == y1:
        raise UnitError("found two calibration points that coincide, expected two different points")
    slope = (y1 - y0) / (x1 - x0)
    if not 1e-30 < abs(slope) < 1e30:
        raise UnitError(
            f"found a calibration of {slope:g} {row.si_unit or 1} per {entry.unit}, expected a line"
            " that is neither flat nor upright"
        )
    return slope, y0 - slope * x0


def reading_line(row: SignalRow, entry: Entry, rig: "Rig") -> tuple[float, float]:
    """As calibration_line; a line that was calibrated holds in place of the row's own."""
    found = calibration_of(rig, row.name)
    return calibration_line(row, entry) if found is None else (found.gain, found.offset)


def check_row(
    row: SignalRow,
    entry: Entry,
    conversion_s: float | None,
    rig: "Rig",
    where: tuple,
    located: Located,
) -> None:
    """Raises ConfigError for the first thing about a row that does not fit its entry.
    ``conversion_s``: how often its toggle bit flips (0: in each cycle); None where it has none.
    """
    _check_kind(row, entry, where, located)
    line = _of_row(calibration_line, "calibration", row, entry, where, located)
    if row.valid is not None:
        _of_row(_valid_counts, "valid", row, entry, where, located)
    if row.si_unit not in ("", "1") and entry.unit != row.si_unit and row.calibration is None:
        raise located.error(
            where,
            f"'{row.name}' without a calibration",
            f"two points from {entry.unit} to {row.si_unit}",
        )
    _check_port(row, where, located)
    if row.is_output:
        _check_output(row, entry, line, rig, where, located)
    else:
        _check_input(row, conversion_s, rig, where, located)


def _of_row(
    read: Callable, key: str, row: SignalRow, entry: Entry, where: tuple, located: Located
) -> tuple:
    try:
        return read(row, entry)
    except UnitError as error:
        found, expected = str(error).removeprefix("found ").split(", expected ", 1)
        raise located.error((*where, key), found, expected + _who_reads(found)) from None


def _who_reads(found: str) -> str:
    """The terminals whose own unit a quantity has that does not fit here: ' (mA is for EL3154)'."""
    try:
        text = split_quantity(found.strip("'"))[1]
        dimension = unit(text)[1]
    except UnitError:
        return ""
    names = [
        device.name
        for device in DEVICES.values()
        if not device.is_drive
        and any(entry.unit != "1" and unit(entry.unit)[1] == dimension for entry in device.inputs)
    ]
    return f" ({text} is for {', '.join(names)})" if names else ""


def _valid_counts(row: SignalRow, entry: Entry) -> tuple[float, float]:
    low, high = map(entry.to_counts, native_pair(row.valid, entry.unit))
    if not low < high:
        raise UnitError("found a valid range upside down, expected the lower end first")
    lowest, highest = entry.counts
    if high < lowest or low > highest:
        raise UnitError(
            "found a valid range that the entry never reaches, expected one within its range"
        )
    return low, high


def _check_kind(row: SignalRow, entry: Entry, where: tuple, located: Located) -> None:
    """What a row of bits or of counts cannot have, and what its name must say."""
    is_bit, is_raw = entry.code == "?", row.name.endswith("_raw")
    if (
        row.name.endswith(("_open", "_enable"))
        and not is_bit
        or row.is_output
        and is_bit
        and is_raw
    ):
        raise located.error(
            (*where, "name"),
            f"'{row.name}' at an entry of {entry.bits} bits",
            "a digital row (_open, _enable) at one bit, any other at more",
        )
    if (row.si_unit == "Pa") != (row.reads is not None):
        if row.reads is None:
            raise located.error(
                where,
                f"the pressure '{row.name}' without 'reads'",
                "reads: gauge or reads: absolute",
            )
        raise located.error((*where, "reads"), f"'reads' on '{row.name}'", "it on pressures only")
    for key in ("calibration", "valid", "limits", "slew"):
        if (is_bit or is_raw) and getattr(row, key) is not None:
            raise located.error(
                (*where, key),
                f"'{key}' on a row of {'bits' if is_bit else 'counts'}",
                f"no '{key}'",
            )
    if row.inverted and not is_bit:
        raise located.error((*where, "inverted"), "a row of more than one bit", "a digital row")


def _check_port(row: SignalRow, where: tuple, located: Located) -> None:
    if row.port is None:
        return
    known = (*VALVE_PORTS, DRIVE_ENABLE_PORT, DRIVE_SPEED_PORT) if row.is_output else MEASURED_PORTS
    if row.port not in known:
        raise located.error(
            (*where, "port"), f"the port '{row.port}'", f"one of {', '.join(known)}"
        )
    if not row.is_output and si_unit_of(row.port) != row.si_unit:
        raise located.error(
            (*where, "port"),
            f"the port '{row.port}' on a row in {row.si_unit or 'counts'}",
            "a port of the row's own unit",
        )


def _check_input(
    row: SignalRow, conversion_s: float | None, rig: "Rig", where: tuple, located: Located
) -> None:
    for key in ("slew", "safe"):
        if key in row.model_fields_set:
            raise located.error((*where, key), f"'{key}' on a measured row", "it on commands only")
    if row.stale_after is None:
        return
    if conversion_s is None:
        raise located.error(
            (*where, "stale_after"),
            f"'stale_after' at {row.entry}, which has no toggle bit",
            "no 'stale_after'",
        )
    # the toggle flips with each conversion: seen once per period, it rests where nearly two (four,
    # ...) fall into one
    flips = rig.period_s / conversion_s if conversion_s else 1.0
    seen = abs(flips - 2.0 * round(flips / 2.0))
    if seen * row.stale_after < 1.0 - 1e-9:
        text = f"'stale_after: {row.stale_after}' at a period of {rig.period_s * 1e3:g} ms"
        raise located.error(
            (*where, "stale_after"),
            text,
            "another period, more cycles or no 'stale_after': the terminal converts every "
            f"{conversion_s * 1e3:g} ms, so that its toggle can look at rest for that long",
        )


def _check_output(
    row: SignalRow,
    entry: Entry,
    line: tuple[float, float],
    rig: "Rig",
    where: tuple,
    located: Located,
) -> None:
    for key in ("valid", "stale_after"):
        if getattr(row, key) is not None:
            raise located.error((*where, key), f"'{key}' on a command", "it on measured rows only")
    # A slave whose watchdog runs out drops digital and analog outputs to zero: safe must be the
    # same thing
    if entry.code == "?":
        if row.safe not in (0.0, 1.0) or (row.safe != 0.0) != row.inverted:
            raise located.error(
                (*where, "safe"),
                f"{row.safe:g} with inverted: {row.inverted}".lower(),
                "the de-energised state, to which the terminal's watchdog drops too",
            )
        return
    if row.name.endswith("_raw"):
        return
    if row.limits is None:
        raise located.error(
            where, f"the command '{row.name}' without limits", "limits: [low, high]"
        )
    if not row.limits[0] <= row.safe <= row.limits[1]:
        raise located.error(
            (*where, "safe"),
            readable(row.safe, row.si_unit),
            f"a safe value within the row's limits, {readable_range(row.limits, row.si_unit)}",
        )
    slope, intercept = (
        line[0] * entry.per_count,
        line[1] + line[0] * entry.offset + (rig.atmosphere_pa if row.reads == "gauge" else 0.0),
    )
    counts = sorted((limit - intercept) / slope for limit in row.limits)
    if counts[0] < entry.counts[0] - 1 or counts[1] > entry.counts[1] + 1:
        raise located.error(
            (*where, "limits"),
            f"limits that take {counts[0]:.6g} to {counts[1]:.6g} counts",
            f"limits within the entry's {entry.counts[0]} to {entry.counts[1]} counts",
        )
    slave = next(s for s in rig.slaves if s.name == row.entry.split(".")[0])
    if not slave.description.is_drive and abs((row.safe - intercept) / slope) > 1e-3:
        raise located.error(
            (*where, "safe"),
            readable(row.safe, row.si_unit),
            f"the value at {'0 V' if entry.unit == 'V' else 'count 0'}, to which the terminal's"
            " watchdog drops too",
        )
