"""Quantities as people write them ("20.78 cm", "460 kPa gauge") turned into SI numbers.

Every number in a rig, experiment or plant file carries its unit, so that a wrong unit is an error
and not a factor of a thousand. Expressions: ``N*s/m``, ``kg*m^2``, ``m^3/(s*Pa)``; a pressure that
is not a difference ends in ``gauge`` or ``abs``.
"""

import math
import re
from decimal import Decimal
from functools import lru_cache

Dimension = tuple[int, ...]  # exponents of m, kg, s, A, K, rad, count

_BASES = ("m", "kg", "s", "A", "K", "rad", "count")
NONE: Dimension = (0,) * len(_BASES)


def _dim(**exponents: int) -> Dimension:
    return tuple(exponents.get(base, 0) for base in _BASES)


# SI unit: what a person reads it in, from which size in SI on, finest first
_READ_IN: dict[str, tuple[tuple[str, float, float], ...]] = {
    "m": (("mm", 1e3, 0.0), ("m", 1.0, 1.0)),
    "rad": (("deg", 180 / math.pi, 0.0),),
    "s": (("ms", 1e3, 0.0), ("s", 1.0, 1.0)),
    "N": (("N", 1.0, 0.0), ("kN", 1e-3, 1e4)),
    "Pa": (("kPa", 1e-3, 0.0), ("MPa", 1e-6, 1e7)),
}


ZEROS = 12  # the largest power of ten that is written out: of more nobody counts the zeros


def plain(value: float, digits: int = 6) -> str:
    """A number to so many digits, with an exponent only beyond ZEROS: '40000', '0.00002',
    '1e+300'.
    """
    text = f"{value:.{digits}g}"
    power = text.partition("e")[2]
    return f"{Decimal(text):f}" if power and abs(int(power)) <= ZEROS else text


def readable(value: float, si_unit: str, digits: int = 6) -> str:
    """A value in SI as a person reads it: '31 mm', '40 kN', '2000 kPa abs' of 'Pa abs'."""
    factor, unit_text = _read_in(abs(value), si_unit)
    return with_unit(plain(factor * value, digits), unit_text)


def readable_range(ends: tuple[float, float], si_unit: str) -> str:
    """Two ends in SI, in one unit: '-10 to 31 mm'."""
    factor, unit_text = _read_in(max(map(abs, ends)), si_unit)
    low, high = (plain(factor * end) for end in ends)
    return with_unit(f"{low} to {high}", unit_text)


def _read_in(size: float, si_unit: str) -> tuple[float, str]:
    """How many of the unit make one SI unit, and its name with what the SI unit ends in."""
    base = re.split(r"[ /]", si_unit, maxsplit=1)[0]
    for name, factor, least in reversed(_READ_IN.get(base, ())):
        if size > 0.0 and size >= least:
            return factor, name + si_unit[len(base) :]
    return 1.0, si_unit


def with_unit(number: str, si_unit: str) -> str:
    """A number or a range as text with its unit; one that has none ("1") stands alone."""
    return number if si_unit in ("1", "") else f"{number} {si_unit}"


def suffix_of(si_unit: str) -> str:
    """How a name ends that counts in a unit: 'N*s/m' as '_n_s_m', '1' as '_ratio'."""
    if si_unit == "1":
        return "_ratio"
    words = si_unit.replace("N*m", "nm").replace("1/", "per_")
    return "_" + re.sub(r"[*/]", "_", re.sub(r"[\^()]", "", words)).lower()


_LBF = 4.4482216152605  # N, exact: 0.453 592 37 kg at 9.806 65 m/s^2 (NIST SP 811, B.8)
_UNITS: dict[str, tuple[float, Dimension]] = {
    "m": (1.0, _dim(m=1)),
    "g": (1e-3, _dim(kg=1)),
    "s": (1.0, _dim(s=1)),
    "A": (1.0, _dim(A=1)),
    "K": (1.0, _dim(K=1)),
    "rad": (1.0, _dim(rad=1)),
    "count": (1.0, _dim(count=1)),
    "min": (60.0, _dim(s=1)),
    "h": (3600.0, _dim(s=1)),
    "day": (86400.0, _dim(s=1)),
    "deg": (math.pi / 180, _dim(rad=1)),
    "rev": (2 * math.pi, _dim(rad=1)),
    "rpm": (2 * math.pi / 60, _dim(rad=1, s=-1)),
    "Hz": (1.0, _dim(s=-1)),
    "N": (1.0, _dim(m=1, kg=1, s=-2)),
    "Nm": (1.0, _dim(m=2, kg=1, s=-2)),
    "Pa": (1.0, _dim(m=-1, kg=1, s=-2)),
    "bar": (1e5, _dim(m=-1, kg=1, s=-2)),
    "J": (1.0, _dim(m=2, kg=1, s=-2)),
    "W": (1.0, _dim(m=2, kg=1, s=-3)),
    "V": (1.0, _dim(m=2, kg=1, s=-3, A=-1)),
    "ohm": (1.0, _dim(m=2, kg=1, s=-3, A=-2)),
    "H": (1.0, _dim(m=2, kg=1, s=-2, A=-2)),
    "L": (1e-3, _dim(m=3)),
    "inch": (0.0254, _dim(m=1)),
    "ft": (0.3048, _dim(m=1)),
    "lbf": (_LBF, _dim(m=1, kg=1, s=-2)),
    "psi": (_LBF / 0.0254**2, _dim(m=-1, kg=1, s=-2)),  # logs of others
    "%": (1e-2, NONE),
    "permille": (1e-3, NONE),
    "1": (1.0, NONE),
    "cycles": (1.0, NONE),
}
# the micro sign and the Greek letter look the same on a screen
_PREFIXES = {
    "n": 1e-9,
    "u": 1e-6,
    "\N{MICRO SIGN}": 1e-6,
    "\N{GREEK SMALL LETTER MU}": 1e-6,
    "m": 1e-3,
    "c": 1e-2,
    "k": 1e3,
    "M": 1e6,
}
_PREFIXED = {
    "m",
    "g",
    "s",
    "A",
    "K",
    "rad",
    "Hz",
    "N",
    "Nm",
    "Pa",
    "bar",
    "J",
    "W",
    "V",
    "ohm",
    "H",
    "L",
}
_NUMBER = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*(.*)$")
_TOKEN = re.compile(
    "\\s*([A-Za-z%\N{MICRO SIGN}\N{GREEK SMALL LETTER MU}]+|\\^-?[1-9](?![0-9])|1(?![0-9])|[*/()])"
)
_USUAL = {
    "m": "mm",
    "m/s": "mm/s",
    "Pa": "kPa",
    "rad": "deg",
    "rad/s": "deg/s",
}  # what people write
_LARGEST = 1e30  # in SI; nothing of a rig is near it, and what is made of such numbers stays finite
_LONGEST = 80  # characters of a quantity; also bounds brackets in brackets


class UnitError(ValueError):
    """A quantity that cannot be read, or whose unit does not fit; str() is 'found ..., expected
    ...'.
    """


def _symbol(name: str) -> tuple[float, Dimension]:
    if name in _UNITS:
        return _UNITS[name]
    if name[:1] in _PREFIXES and name[1:] in _PREFIXED:
        factor, dimension = _UNITS[name[1:]]
        return _PREFIXES[name[0]] * factor, dimension
    raise UnitError(
        f"found unit '{name}', expected a known unit such as kPa, mm, N, A, deg, ms, rpm"
    )


def _form(text: str) -> UnitError:
    return UnitError(f"found unit '{text}', expected a form such as N*s/m or kg*m^2")


def _tokens(text: str) -> list[str]:
    tokens, position = [], 0
    while position < len(text):
        match = _TOKEN.match(text, position)
        if not match:
            raise _form(text)
        tokens.append(match.group(1))
        position = match.end()
    return tokens


@lru_cache(maxsize=512)
def unit(text: str) -> tuple[float, Dimension]:
    """Factor to SI and dimension of a unit expression. Raises UnitError."""
    text = text.strip() or "1"
    if len(text) > _LONGEST:
        raise _form(text[:_LONGEST] + "...")
    try:
        factor, dimension, rest = _product(_tokens(text), text)
    except ArithmeticError:
        raise _form(text) from None
    if rest or not 0.0 < factor < math.inf:
        raise _form(text)
    return factor, dimension


def _product(tokens: list[str], text: str) -> tuple[float, Dimension, list[str]]:
    """Factors joined by * and /, up to the end or a closing bracket; what follows that bracket is
    handed back.
    """
    factor, dimension, sign = 1.0, NONE, 1
    while True:
        part, part_dimension, tokens = _factor(tokens, text)
        factor *= part**sign
        dimension = tuple(a + sign * b for a, b in zip(dimension, part_dimension, strict=True))
        if not tokens or tokens[0] == ")":
            return factor, dimension, tokens
        if tokens[0] not in "*/":
            raise _form(text)
        sign, tokens = (1 if tokens[0] == "*" else -1), tokens[1:]


def _factor(tokens: list[str], text: str) -> tuple[float, Dimension, list[str]]:
    """One symbol or bracket, with its power."""
    if not tokens or tokens[0] in "*/)" or tokens[0].startswith("^"):
        raise _form(text)
    head, tokens = tokens[0], tokens[1:]
    if head == "(":
        factor, dimension, tokens = _product(tokens, text)
        if not tokens:
            raise UnitError(f"found unit '{text}', expected a closing bracket")
        tokens = tokens[1:]
    else:
        factor, dimension = _symbol(head)
    if tokens and tokens[0].startswith("^"):
        power, tokens = int(tokens[0][1:]), tokens[1:]
        factor, dimension = factor**power, tuple(e * power for e in dimension)
    return factor, dimension, tokens


def split_quantity(text: object) -> tuple[float, str]:
    """Number and unit text of a quantity. Raises UnitError where no finite number leads."""
    if isinstance(text, bool) or not isinstance(text, (int, float, str)):
        raise UnitError(f"found {text!r}, expected a number with a unit")
    if isinstance(text, int) and abs(text) > 10**40:
        raise UnitError("found a whole number of over 40 digits, expected a number with a unit")
    written = str(text).strip()
    if len(written) > _LONGEST:
        raise UnitError(f"found '{written[:_LONGEST]}...', expected a number with a unit")
    match = _NUMBER.match(written)
    if not match:
        raise UnitError(f"found '{text}', expected a number with a unit")
    number = float(match.group(1))
    if not math.isfinite(number):
        raise UnitError(f"found '{text}', expected a finite number")
    return number, match.group(2).strip()


def parse_quantity(text: object, si_unit: str) -> float:
    """The SI value of a quantity such as '20.78 cm' where ``si_unit`` ('m') fixes the dimension.
    Raises UnitError.
    """
    number, unit_text = split_quantity(text)
    wanted = unit(si_unit)[1]
    if not unit_text and wanted != NONE:
        raise UnitError(
            f"found '{text}' without a unit, expected a number with a unit like"
            f" {_USUAL.get(si_unit, si_unit)}"
        )
    factor, dimension = unit(unit_text)
    if dimension != wanted:
        raise UnitError(
            f"found '{text}', expected a quantity in {si_unit if wanted != NONE else 'no unit'}"
        )
    value = number * factor
    if not abs(value) <= _LARGEST:
        raise UnitError(f"found '{text}', expected {with_unit(f'at most {_LARGEST:g}', si_unit)}")
    return value


def parse_pressure(text: object, atmosphere_pa: float) -> float:
    """Absolute Pa of '460 kPa gauge' or '170 kPa abs'. Raises UnitError where the reference is not
    said.
    """
    stripped = text.strip() if isinstance(text, str) else ""
    for word, offset_pa in (("gauge", atmosphere_pa), ("abs", 0.0)):
        if stripped.endswith(word):
            return parse_quantity(stripped[: -len(word)].strip(), "Pa") + offset_pa
    parse_quantity(text, "Pa")
    raise UnitError(
        f"found '{text}', expected a pressure that says what it is against: '... kPa gauge' or '..."
        " kPa abs'"
    )
