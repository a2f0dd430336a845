"""One row of the rig file's table of signals."""

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema, field_validator

from epa_rt.config.fields import Frozen, Name, atmosphere_pa, written
from epa_rt.config.units import (
    UnitError,
    parse_pressure,
    parse_quantity,
    readable,
    readable_range,
    split_quantity,
    unit,
)

# suffix of a signal's name -> SI unit; longest first
SUFFIX_UNITS = {
    "_rad_s": "rad/s",
    "_m_s": "m/s",
    "_ratio": "1",
    "_open": "",
    "_enable": "",
    "_raw": "",
    "_rad": "rad",
    "_hz": "Hz",
    "_nm": "N*m",
    "_kg": "kg",
    "_pa": "Pa",
    "_n": "N",
    "_m": "m",
    "_s": "s",
    "_v": "V",
    "_a": "A",
    "_k": "K",
}
PLACES = ("_m", "_rad")  # how the name of a position or an angle ends; that of its speed in _s more


def si_unit_of(name: str) -> str:
    """SI unit that a signal's name ends in ('' for counts and booleans). Raises UnitError where it
    ends in none.
    """
    for suffix, si_unit in SUFFIX_UNITS.items():
        if name.endswith(suffix):
            return si_unit
    raise UnitError(
        f"found the name '{name}', expected a name that ends in its unit, one of"
        f" {', '.join(SUFFIX_UNITS)}"
    )


def reading(name: str, value: float) -> str:
    """A value of a signal, SI, as a person reads it: '12.3 mm', '910 kPa abs'."""
    return readable(value, _read_unit(name), 4)


def reading_and_limits(name: str, value: float, low: float, high: float) -> tuple[str, str]:
    """A value of a signal and its limits, SI, to six digits: '360.25 N' and '-40 to 350 N'."""
    unit_text = _read_unit(name)
    return readable(value, unit_text), readable_range((low, high), unit_text)


def reading_error(name: str, error: float) -> str:
    """A difference of a signal: '+3.1 kPa', '-2 deg'."""
    text = readable(error, _read_unit(name).removesuffix(" abs"), 3)
    return text if error < 0.0 else f"+{text}"


def _read_unit(name: str) -> str:
    """Never raises, for the safety's sentences are made while a rig trips."""
    si_unit = next((si for end, si in SUFFIX_UNITS.items() if name.endswith(end)), "")
    return "Pa abs" if si_unit == "Pa" else si_unit


def _pair(value: Any) -> tuple[Any, Any]:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise UnitError(f"found {value!r}, expected a pair [low, high]")
    return tuple(value)


def _native_pair(value: Any) -> tuple[float, str, float, str]:
    first, second = _pair(value)
    return (*split_quantity(first), *split_quantity(second))


_PAIR_SCHEMA = {
    "type": "array",
    "items": {"type": ["string", "number"]},
    "minItems": 2,
    "maxItems": 2,
}
Pair = Annotated[tuple[float, float], WithJsonSchema(_PAIR_SCHEMA)]
NativePair = Annotated[
    tuple[float, str, float, str], BeforeValidator(_native_pair), WithJsonSchema(_PAIR_SCHEMA)
]


def native_pair(pair: tuple[float, str, float, str], native_unit: str) -> tuple[float, float]:
    """Both ends of a pair as numbers in the entry's native unit ('V', 'count', 'rpm', ...). Raises
    UnitError.
    """
    wanted_factor, wanted = unit(native_unit)
    values = []
    for number, text in (pair[:2], pair[2:]):
        factor, dimension = unit(text)
        if dimension != wanted or not text:
            raise UnitError(
                f"found '{number:g} {text}', expected a quantity in {native_unit}, the entry's own"
                " unit"
            )
        values.append(number * factor / wanted_factor)
    return values[0], values[1]


class Calibration(Frozen):
    """Two points of a straight line: the entry's native unit (V, count, rpm, permille, mA) against
    the signal's.
    """

    native: NativePair
    value: Annotated[
        tuple[str, str],
        BeforeValidator(lambda v: tuple(str(x) for x in _pair(v))),
        WithJsonSchema(_PAIR_SCHEMA),
    ]


class SignalRow(Frozen):
    """A signal: where it stands in the process image, how counts become SI, what it may be."""

    name: Name
    entry: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*\.[a-z0-9_]+$")]
    port: str | None = None
    reads: Literal["gauge", "absolute"] | None = None
    calibration: Calibration | None = None
    valid: NativePair | None = None
    limits: Pair | None = None
    slew: Annotated[float, written("the signal's own unit per second")] | None = None
    safe: Annotated[float, written("the signal's own unit")] = 0.0
    inverted: bool = False
    stale_after: Annotated[int, Field(ge=1, le=100_000)] | None = None

    @field_validator("name")
    @classmethod
    def _name_ends_in_unit(cls, name: str) -> str:
        si_unit_of(name)
        return name

    @field_validator("limits", mode="before")
    @classmethod
    def _limits(cls, value: Any, info: ValidationInfo) -> Any:
        if value is None:
            return None
        low, high = (_signal_quantity(end, info) for end in _pair(value))
        if not low < high:
            raise UnitError(f"found {list(value)!r}, expected the lower limit below the upper one")
        return low, high

    @field_validator("safe", mode="before")
    @classmethod
    def _safe(cls, value: Any, info: ValidationInfo) -> Any:
        return _signal_quantity(value, info)

    @field_validator("slew", mode="before")
    @classmethod
    def _slew(cls, value: Any, info: ValidationInfo) -> Any:
        if value is None:
            return None
        si_unit = si_unit_of(info.data.get("name", "x_ratio"))
        rate = parse_quantity(value, f"{si_unit}/s" if si_unit not in ("", "1") else "Hz")
        if not rate > 0.0:
            raise UnitError(f"found '{value}', expected a rate above zero")
        return rate

    @property
    def is_output(self) -> bool:
        return self.name.startswith("cmd_")

    @property
    def si_unit(self) -> str:
        return si_unit_of(self.name)


def _signal_quantity(value: Any, info: ValidationInfo) -> float:
    """A value of the row's own kind: absolute pressure for _pa, a plain number for counts and
    booleans.
    """
    si_unit = si_unit_of(info.data.get("name", "x_ratio"))
    if si_unit == "Pa":
        result = parse_pressure(value, atmosphere_pa(info))
    else:
        result = parse_quantity(value, si_unit or "1")
    if not math.isfinite(result):
        raise UnitError(f"found '{value}', expected a finite number")
    return result
