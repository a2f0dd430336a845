"""What a rule of protection is: a name, and a function that yields what a rig breaks of it."""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, NamedTuple

from epa_rt.config.devices import Entry
from epa_rt.config.rig_checks import conversion_of, entries_of
from epa_rt.config.rig_row_checks import reading_line
from epa_rt.config.rig_rows import SignalRow, native_pair
from epa_rt.config.source import Location
from epa_rt.config.units import readable, readable_range

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig, Slave


class Breach(NamedTuple):
    """What breaks a rule: the row ('' where it is none), the place in the file, found, expected."""

    row: str
    where: Location
    found: str
    expected: str


class Rule(NamedTuple):
    """``breaches`` yields what a rig breaks; ``needs``: what the rule asks for, as the operator's
    page has it; ``excusable``: whether a reason may stand for it.
    """

    name: str
    breaches: Callable[["Rig"], Iterable[Breach]]
    needs: str
    excusable: bool = True


def place(rig: "Rig", name: str, *key: str) -> Location:
    """Where a row, or a key of it, stands in the file."""
    return ("signals", [row.name for row in rig.signals].index(name), *key)


def of_row(rig: "Rig", row: SignalRow, key: str, found: str, expected: str) -> Breach:
    """A breach at a key of a row."""
    return Breach(row.name, place(rig, row.name, key), found, expected)


def slave_of(rig: "Rig", row: SignalRow) -> "Slave":
    """The slave that carries a row."""
    return next(slave for slave in rig.slaves if slave.name == row.entry.split(".")[0])


def entry_of(rig: "Rig", row: SignalRow) -> Entry:
    """The entry of the process image that a row stands at."""
    name = row.entry.split(".")[1]
    return next(e for e in entries_of(slave_of(rig, row), row.is_output) if e.name == name)


def has_toggle(rig: "Rig", row: SignalRow) -> bool:
    """Whether the row's terminal tells with a toggle bit that a value is new: an analog input."""
    if row.is_output:
        return False
    return conversion_of(slave_of(rig, row), row.entry.split(".")[1]) is not None


def line_of(rig: "Rig", row: SignalRow) -> tuple[float, float]:
    """Slope and intercept from the native unit to SI; absolute pressure where the row reads
    gauge.
    """
    slope, intercept = reading_line(row, entry_of(rig, row), rig)
    return slope, intercept + (rig.atmosphere_pa if row.reads == "gauge" else 0.0)


def native_range(rig: "Rig", row: SignalRow) -> tuple[float, float]:
    """What the entry can show and ``valid`` lets pass, in the native unit."""
    entry = entry_of(rig, row)
    low, high = entry.native_ends
    if row.valid is not None:
        valid = native_pair(row.valid, entry.unit)
        low, high = max(low, valid[0]), min(high, valid[1])
    return low, high


def shown(value: float, si_unit: str) -> str:
    """A value in a sentence: '31 mm', '901.325 kPa abs'."""
    return readable(value, _ABSOLUTE.get(si_unit, si_unit))


def range_shown(ends: tuple[float, float], si_unit: str) -> str:
    """Two ends in a sentence."""
    return readable_range(ends, _ABSOLUTE.get(si_unit, si_unit))


_ABSOLUTE = {"Pa": "Pa abs"}
