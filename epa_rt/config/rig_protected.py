"""What protects a rig, in words for the screen: its limits, its reaction times, its stops."""

from typing import TYPE_CHECKING

from epa_rt.config.rig_rows import SignalRow
from epa_rt.config.units import plain, with_unit

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig

# SI unit: the unit on the screen, how many of it make one SI unit
_SHOWN_UNITS = {
    "Pa": ("kPa gauge", 1e-3),
    "m": ("mm", 1e3),
    "m/s": ("mm/s", 1e3),
    "rad": ("deg", 57.29577951308232),
    "rad/s": ("deg/s", 57.29577951308232),
}


def protections(rig: "Rig") -> tuple[str, ...]:
    """A line for each row with limits, then the times and the stops."""
    lines = []
    for row in rig.signals:
        if row.limits is None:
            continue
        offset = rig.atmosphere_pa if row.si_unit == "Pa" else 0.0
        low, high = (_number(end - offset, row) for end in row.limits)
        slew = f", slew {_shown(row.slew, row, '/s')}" if row.slew is not None else ""
        kind = "commanded" if row.is_output else "trips outside"
        lines.append(f"{row.name}: {kind} {with_unit(f'{low} to {high}', _unit(row))}{slew}")
    safety, motor = rig.safety, rig.motor
    following = [
        f"{name} {_shown(axis.following_error, rig.row(axis.position))}"
        for name, axis in (("motor", motor), ("joint", rig.joint))
        if axis is not None and axis.following_error is not None
    ]
    if following:
        lines.append(f"following error: {', '.join(following)}")
    if safety.i2t is not None:
        i2t = safety.i2t
        lines.append(f"i2t: {i2t.continuous:g} A continuous, {i2t.time_constant:g} s")
    lines += [
        f"{m.name}: at most {(m.pressure_max - rig.atmosphere_pa) / 1e3:g} kPa gauge"
        for m in rig.muscles
    ]
    lines.append(
        f"reaction {1e3 * safety.reaction:g} ms ({safety.lost_cycles} lost cycles of"
        f" {1e3 * rig.period_s:g} ms), watchdog of the slaves {1e3 * safety.watchdog:g} ms"
    )
    return tuple(lines)


def _unit(row: SignalRow) -> str:
    return _SHOWN_UNITS.get(row.si_unit, (row.si_unit, 1.0))[0]


def _number(value: float, row: SignalRow) -> str:
    return plain(value * _SHOWN_UNITS.get(row.si_unit, ("", 1.0))[1], 4)


def _shown(value: float, row: SignalRow, rate: str = "") -> str:
    unit = f"{_unit(row)}{rate}".replace("/s/s", "/s^2")
    return f"{_number(value, row)} {unit}"
