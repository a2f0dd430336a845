"""The straight line from a foreign column to SI: unit, scale and offset in one, checked against the
signal's name.
"""

import math
from typing import NamedTuple

from epa_rt.config.rig_rows import si_unit_of
from epa_rt.config.units import UnitError, parse_quantity, split_quantity, unit

_PRESSURE_WORDS = ("gauge", "abs", "difference")


class Line(NamedTuple):
    """SI value = ``slope`` x column + ``intercept``."""

    slope: float
    intercept: float


def line_of(
    name: str, unit_text: str, scale: float | str, offset: float | str | None, atmosphere_pa: float
) -> Line:
    """The line of a signal. A pressure's unit ends in gauge, abs or difference; gauge adds the
    atmosphere.

    Raises UnitError where the unit times the scale's is not what the name ends in, and for a scale
    of zero.
    """
    si_unit = si_unit_of(name) or "1"
    plain, zero = _plain_unit(unit_text, si_unit, atmosphere_pa)
    factor, dimension = unit(plain)
    number, scale_unit = split_quantity(scale)
    scale_factor, scale_dimension = unit(scale_unit)
    if tuple(a + b for a, b in zip(dimension, scale_dimension, strict=True)) != unit(si_unit)[1]:
        times = f" times '{scale_unit}'" if scale_unit else ""
        raise UnitError(
            f"found the unit '{unit_text}'{times}, expected a unit of"
            f" {'no dimension' if si_unit == '1' else si_unit}, as the name {name} says"
        )
    if number == 0.0:
        raise UnitError("found a scale of zero, expected another number")
    slope = factor * number * scale_factor
    intercept = zero + (0.0 if offset is None else parse_quantity(offset, si_unit))
    if not (slope and math.isfinite(slope) and math.isfinite(intercept)):
        raise UnitError(f"found a scale of {slope:g}, expected a number that a double can hold")
    return Line(slope, intercept)


def _plain_unit(text: str, si_unit: str, atmosphere_pa: float) -> tuple[str, float]:
    """The unit without its word, and what is added for that word."""
    if si_unit != "Pa":
        return text, 0.0
    words = text.split()
    if not words or words[-1] not in _PRESSURE_WORDS:
        raise UnitError(
            f"found the unit '{text}', expected a pressure that says what it is against: 'bar"
            " gauge', 'bar abs' or 'bar difference'"
        )
    return " ".join(words[:-1]), atmosphere_pa if words[-1] == "gauge" else 0.0
