"""SI inside, kPa, mm and degrees where a person reads: the units of a page."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from epa_rt.config.rig_rows import si_unit_of
from epa_rt.config.units import UnitError

_FACTORS = {
    "m": (1e3, "mm"),
    "m/s": (1e3, "mm/s"),
    "rad": (180.0 / math.pi, "deg"),
    "rad/s": (180.0 / math.pi, "deg/s"),
    "Pa": (1e-3, "kPa"),
    "N*m": (1e3, "mNm"),
    "N*m/s": (1e3, "mNm/s"),
    "1": (1.0, ""),
    "": (1.0, ""),
}
_SUPERSCRIPTS = (("^2", "²"), ("^3", "³"), ("*", "·"))


class Scale(NamedTuple):
    """``shown = (si - zero) * factor``, in ``unit``."""

    factor: float
    zero: float
    unit: str

    def of(self, values: "np.ndarray | float") -> "np.ndarray | float":
        return (values - self.zero) * self.factor


@dataclass(frozen=True)
class Shown:
    """How one page shows quantities: ``gauge`` pressures are above ``atmosphere_pa``, others
    absolute.
    """

    atmosphere_pa: float = 101_325.0
    gauge: bool = False

    def scale(self, si_unit: str) -> Scale:
        """For values."""
        factor, unit = _FACTORS.get(si_unit, (1.0, si_unit))
        if si_unit == "Pa":
            return Scale(
                factor,
                self.atmosphere_pa if self.gauge else 0.0,
                "kPa gauge" if self.gauge else "kPa abs",
            )
        return Scale(factor, 0.0, pretty(unit))

    def difference_scale(self, si_unit: str) -> Scale:
        """For errors and other differences, in which gauge and absolute are the same."""
        factor, unit = _FACTORS.get(si_unit, (1.0, si_unit))
        return Scale(factor, 0.0, pretty(unit))

    def value(self, value: float, si_unit: str, digits: int = 4) -> str:
        """A value with its unit; a dash for NaN."""
        return _text(value, self.scale(si_unit), digits)

    def difference(
        self,
        value: float,
        si_unit: str,
        digits: int = 3,
        signed: bool = False,
        like: float | None = None,
    ) -> str:
        """A difference with its unit, to four decimals at most; a dash for NaN. With ``like``, to
        as many as that one.
        """
        scale = self.difference_scale(si_unit)
        return _text(
            value,
            scale,
            digits,
            signed,
            min(_decimals(scale.of(value if like is None else like), digits), 4),
        )


def shown_for(experiment_text: str, atmosphere_pa: float) -> Shown:
    """Gauge or absolute, whichever the experiment file writes its pressures in."""
    return Shown(atmosphere_pa, experiment_text.count("gauge") > experiment_text.count(" abs"))


def unit_of(name: str) -> str:
    """SI unit of a signal of any prefix; '' for names that end in none."""
    if name.endswith("_nm_s"):
        return "N*m/s"
    try:
        return si_unit_of(name)
    except UnitError:
        return ""


def pretty(unit: str) -> str:
    """'N*m' as 'N·m', 'm/s^2' as 'm/s²'."""
    for plain, sign in _SUPERSCRIPTS:
        unit = unit.replace(plain, sign)
    return unit


def number(value: float, digits: int = 4) -> str:
    """A number of so many significant digits, never in powers of ten below a million; a dash for
    NaN.
    """
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    decimals = _decimals(value, digits)
    if decimals > 9 or abs(value) >= 1e7:
        return f"{value:.{digits}g}"
    return f"{value:.{decimals}f}".replace("-", "−")


def seconds(value: float) -> str:
    """A duration: '4.212 s', '3 min 20.0 s', '1 h 5 min'."""
    if not math.isfinite(value):
        return "–"
    if value < 100.0:
        return f"{value:.3f} s"
    minutes, rest = divmod(value, 60.0)
    if minutes < 100:
        return f"{minutes:.0f} min {rest:.1f} s"
    return f"{minutes // 60:.0f} h {minutes % 60:.0f} min"


def count(value: int, one: str, many: str | None = None) -> str:
    """'1 cycle', '1,490,689 cycles'."""
    return f"{value:,} {one if value == 1 else many or one + 's'}"


def _decimals(value: float, digits: int) -> int:
    return (
        max(digits - 1 - math.floor(math.log10(abs(value))), 0)
        if math.isfinite(value) and value
        else digits
    )


def _text(
    value: float, scale: Scale, digits: int, signed: bool = False, decimals: int | None = None
) -> str:
    shown = scale.of(value)
    if not math.isfinite(shown):
        return "–"
    text = number(shown, digits) if decimals is None else f"{shown:.{decimals}f}".replace("-", "−")
    sign = "+" if signed and shown > 0.0 else ""
    return f"{sign}{text} {scale.unit}".strip()
