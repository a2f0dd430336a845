"""Which reading of a rig is calibrated, and the scale it has now."""

from epa_rt.calibrate.refusals import Scale
from epa_rt.config.devices import Entry
from epa_rt.config.rig import Rig
from epa_rt.config.rig_protection_rule import entry_of, native_range, slave_of
from epa_rt.config.rig_row_checks import reading_line
from epa_rt.config.rig_rows import SignalRow
from epa_rt.signals.scaling import scaling_of

# terminals of 12 bits present them left-aligned in 16 (EL30xx manual)
PRESENTED_STEP = {"EL3004": 16}


class NoReading(Exception):
    """The rig has no such reading, or several; one sentence."""


def chosen_row(rig: Rig, kind: str, signal: str | None) -> SignalRow:
    """The row that is calibrated: the named one, or the only one of its kind. Raises NoReading."""
    rows = _rows(rig, kind)
    names = ", ".join(row.name for row in rows) or "none"
    if signal is None:
        if len(rows) != 1:
            raise NoReading(
                f"found {len(rows)} {kind} readings on {rig.name} ({names}), expected one, or"
                " --signal NAME"
            )
        return rows[0]
    for row in rows:
        if row.name == signal:
            return row
    raise NoReading(f"found --signal {signal}, expected one of the {kind} readings: {names}")


def _rows(rig: Rig, kind: str) -> list[SignalRow]:
    motor = rig.motor
    sensors = [
        row
        for row in rig.inputs
        if row.calibration is not None
        and row.name not in (motor.position, motor.speed, motor.current)
        and slave_of(rig, row).device != "EPOS4"
    ]
    if kind == "joint":
        place = rig.joint.position if rig.joint is not None else None
        return [row for row in sensors if row.name == place]
    return [row for row in sensors if row.si_unit == {"force": "N", "pressure": "Pa"}[kind]]


def scale_of(rig: Rig, row: SignalRow) -> Scale:
    """What the reading is at now, in its entry's native unit."""
    entry = entry_of(rig, row)
    gain, offset = reading_line(row, entry, rig)
    low, high = entry.counts
    step = PRESENTED_STEP.get(slave_of(rig, row).device, 1) * entry.per_count
    return Scale(
        row.name,
        row.si_unit,
        entry.unit,
        gain,
        offset,
        (low * entry.per_count, high * entry.per_count - step),
        native_range(rig, row),
        step,
        rig.atmosphere_pa if row.si_unit == "Pa" else None,
    )


def native_line(rig: Rig, row: SignalRow) -> tuple[float, float]:
    """Slope and intercept of the measured value over the native reading."""
    entry: Entry = entry_of(rig, row)
    scaling = scaling_of(row, entry, rig)
    return scaling.slope / entry.per_count, scaling.intercept
