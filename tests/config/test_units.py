"""Quantities: what is written comes back as the SI value, products multiply, junk is a UnitError
and nothing else.
"""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.config import units
from epa_rt.config.rig_rows import reading, reading_and_limits, reading_error
from epa_rt.config.units import (
    UnitError,
    parse_pressure,
    parse_quantity,
    plain,
    readable,
    readable_range,
    split_quantity,
    unit,
)

SYMBOLS = sorted(set(units._UNITS) - {"1"})
PREFIXED = sorted(units._PREFIXED - {"g"})
PREFIXES = {
    "n": 1e-9,
    "u": 1e-6,
    "\u00b5": 1e-6,
    "\u03bc": 1e-6,
    "m": 1e-3,
    "c": 1e-2,
    "k": 1e3,
    "M": 1e6,
}
numbers = st.floats(-1e12, 1e12, allow_nan=False)


@given(numbers, st.sampled_from(SYMBOLS))
def test_a_number_comes_back_in_si(number, symbol):
    factor, _ = unit(symbol)
    si = {"deg": "rad", "rev": "rad", "rpm": "rad/s"}.get(symbol, symbol)
    assert parse_quantity(f"{number!r} {symbol}", si) == number * factor


@given(st.sampled_from(PREFIXED), st.sampled_from(sorted(PREFIXES)))
def test_a_prefix_multiplies(symbol, prefix):
    if prefix + symbol in units._UNITS:
        return  # 'min' is a minute
    factor, dimension = unit(symbol)
    assert unit(prefix + symbol) == (pytest.approx(PREFIXES[prefix] * factor, rel=1e-12), dimension)


@given(
    st.lists(
        st.tuples(st.sampled_from("*/"), st.sampled_from(SYMBOLS), st.integers(-4, 4).filter(bool)),
        max_size=4,
    ),
    st.sampled_from(SYMBOLS),
)
def test_products_and_powers_multiply_factors_and_add_dimensions(parts, first):
    factor, dimension = unit(first)
    text = first
    for operator, symbol, power in parts:
        text += f"{operator}{symbol}^{power}"
        sign = power if operator == "*" else -power
        part, part_dimension = unit(symbol)
        factor *= part**sign
        dimension = tuple(a + sign * b for a, b in zip(dimension, part_dimension, strict=True))
    assert unit(text) == (pytest.approx(factor, rel=1e-9), dimension)


@given(st.sampled_from(SYMBOLS), st.sampled_from(SYMBOLS), st.sampled_from(SYMBOLS))
def test_brackets_divide_as_a_whole(a, b, c):
    assert unit(f"{a}/({b}*{c})") == (
        pytest.approx(unit(f"{a}/{b}/{c}")[0], rel=1e-12),
        unit(f"{a}/{b}/{c}")[1],
    )


@given(st.sampled_from(SYMBOLS), st.sampled_from(SYMBOLS), numbers)
def test_another_dimension_is_refused(symbol, other, number):
    if unit(symbol)[1] == unit(other)[1]:
        return
    with pytest.raises(UnitError, match="^found .*, expected "):
        parse_quantity(f"{number!r} {symbol}", other)


@pytest.mark.parametrize("text", ["1e31 m", "-1e300 mm", "1.1e30 m"])
def test_a_size_whose_products_would_overflow_is_refused(text):
    with pytest.raises(UnitError, match="expected at most 1e\\+30 m"):
        parse_quantity(text, "m")
    assert parse_quantity("1e30 m", "m") == 1e30


@settings(max_examples=400)
@given(
    st.one_of(
        st.text(max_size=40),
        st.text("0123456789.eE+-^*/()1 mskNPaA%", max_size=100),
        st.floats(),
        st.integers(),
        st.booleans(),
        st.none(),
        st.lists(st.integers()),
        st.binary(),
        st.just(16**9000),
    )
)
def test_junk_is_a_unit_error_and_nothing_else(junk):
    for read in (
        lambda: parse_quantity(junk, "m"),
        lambda: parse_quantity(junk, "1"),
        lambda: parse_pressure(junk, 1e5),
        lambda: split_quantity(junk)[0],
    ):
        try:
            assert math.isfinite(read())
        except UnitError as error:
            assert str(error).startswith("found ") and ", expected " in str(error)


@pytest.mark.parametrize(
    "text",
    [
        "m s",
        "m//s",
        "m*",
        "/s",
        "()",
        "m1",
        "11",
        "m^0",
        "m^^2",
        "m^12",
        "m)",
        "(m",
        "(m s)",
        "*",
        "kkm",
        "ckg",
        "((km^9)^9)^9",
        "((nm^9)^9)^9",
        "1/((nm^9)^9)^9",
        "(" * 500,
        "m" * 500,
        "2",
        "m^-",
        "psf",
        "\u00b2",
    ],
)
def test_what_is_no_unit(text):
    with pytest.raises(UnitError, match="^found .*, expected "):
        unit(text)


@pytest.mark.parametrize(
    ("text", "si", "value"),
    [
        ("20.78 cm", "m", 0.2078),
        ("110 g*cm^2", "kg*m^2", 1.1e-5),
        ("1 min", "s", 60.0),
        ("30 rpm", "rad/s", math.pi),
        ("5 %", "1", 0.05),
        ("1e-3m", "m", 1e-3),
        ("+.5 kN", "N", 500.0),
        (7, "1", 7.0),
        ("3 1/s", "Hz", 3.0),
        ("250 rpm/V", "rad/s/V", 250 * 2 * math.pi / 60),
        ("1.6e-10 m^3/(s*Pa)", "m^3/(s*Pa)", 1.6e-10),
        ("2 L", "m^3", 2e-3),
        ("0.2 mH", "H", 2e-4),
        ("30 psi", "Pa", 30 * 6894.757293168361),
        ("10 lbf", "N", 44.482216152605),
        ("2 inch/s", "m/s", 0.0508),
        ("1 ft*lbf", "Nm", 1.3558179483314),
    ],
)
def test_known_quantities(text, si, value):
    assert parse_quantity(text, si) == pytest.approx(value, rel=1e-14)


def test_pressures_say_what_they_are_against():
    assert parse_pressure("460 kPa gauge", 101_325.0) == 561_325.0
    assert parse_pressure(" 1.7 bar abs ", 101_325.0) == pytest.approx(170_000.0)
    for text in ("460 kPa", "460 kPa rel", "gauge", "kPa abs", "4 N abs", 460, None, True):
        with pytest.raises(UnitError):
            parse_pressure(text, 101_325.0)


@pytest.mark.parametrize(
    ("value", "si_unit", "said"),
    [
        (0.031, "m", "31 mm"),
        (10.0, "m", "10 m"),
        (4e4, "N", "40 kN"),
        (-350.0, "N", "-350 N"),
        (2e6, "Pa abs", "2000 kPa abs"),
        (780e6, "Pa", "780 MPa"),
        (0.007, "m/s", "7 mm/s"),
        (0.0, "m", "0 m"),
        (math.pi, "rad/s^2", "180 deg/s^2"),
        (2.5, "1", "2.5"),
        (1e7, "count", "10000000 count"),
    ],
)
def test_a_sentence_has_numbers_that_a_person_reads(value, si_unit, said):
    assert readable(value, si_unit) == said


@pytest.mark.parametrize(
    ("name", "value", "said", "as_error"),
    [
        ("motor_travel_m", 0.0123456, "12.35 mm", "+12.3 mm"),
        ("knee_angle_rad", -0.5, "-28.65 deg", "-28.6 deg"),
        ("muscle_pressure_pa", 9.1e5, "910 kPa abs", "+910 kPa"),
        ("spare_ratio", 2.0, "2", "+2"),
        ("named by nobody", math.inf, "inf", "+inf"),
    ],
)
def test_a_signal_is_read_in_the_unit_of_its_name(name, value, said, as_error):
    """Whatever the name and the number are: the sentences of the safety are made of it."""
    assert (reading(name, value), reading_error(name, value)) == (said, as_error)
    assert reading(name, math.nan).startswith("nan")


def test_a_value_just_beyond_its_limits_is_told_apart_from_them():
    found = reading_and_limits("muscle_force_n", 350.01, -40.0, 350.0)
    assert found == ("350.01 N", "-40 to 350 N")


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_no_number_in_a_sentence_has_an_exponent_or_hundreds_of_zeros(value):
    text = plain(value)
    assert float(text) == pytest.approx(value, rel=1e-5) and len(text) < 25
    assert "e" not in text or not 1e-12 <= abs(value) < 9e12


def test_two_ends_share_one_unit():
    assert readable_range((-0.01, 0.031), "m") == "-10 to 31 mm"
    assert readable_range((0.0, 2e6), "Pa abs") == "0 to 2000 kPa abs"
    assert "inf" in readable_range((-math.inf, math.inf), "m")
