"""Points that make no calibration are refused, with the reason."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.calibrate.calibration import calibrate
from epa_rt.calibrate.point import CalibrationError
from epa_rt.calibrate.refusals import unit_suspects
from tests.calibrate.made import SCALE, SCATTER, points


def refused(spoilt, scale=SCALE, **more):
    with pytest.raises(CalibrationError) as caught:
        calibrate(spoilt, scale, **more)
    return str(caught.value)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 1000), pair=st.tuples(st.integers(0, 12), st.integers(0, 12)))
def test_any_two_exchanged_points_are_refused_and_named(seed, pair):
    sound = points(seed=seed)
    i, j = sorted(pair)
    if sound[i].reference == sound[j].reference:
        return
    spoilt = list(sound)
    spoilt[i] = replace(sound[i], reference=sound[j].reference)
    spoilt[j] = replace(sound[j], reference=sound[i].reference)
    said = refused(spoilt)
    assert "swapped" in said


def test_two_points_exchanged_show_by_the_sign():
    a, b = points(references=[0.0, 300.0])
    said = refused([replace(a, reference=b.reference), replace(b, reference=a.reference)])
    assert "of the other sign" in said and "swapped" in said


def test_a_noisy_point_is_refused():
    spoilt = points()
    spoilt[4] = replace(spoilt[4], scatter=10.0 * SCATTER)
    said = refused(spoilt)
    assert said.startswith("point 5 is noisy") and "take it again" in said


def test_a_point_off_the_line_is_refused_by_the_others():
    spoilt = points()
    spoilt[4] = replace(spoilt[4], reading=spoilt[4].reading + 0.05)  # 2.5 N of 300
    assert refused(spoilt).startswith("point 5 lies 2.")


def test_a_point_that_moved_is_refused():
    spoilt = points()
    spoilt[2] = replace(spoilt[2], moved=0.1)
    assert "point 3 was not at rest" in refused(spoilt)


@pytest.mark.parametrize(
    ("factor", "word"),
    [
        (9.80665, "kg"),
        (1.0 / 9.80665, "too small by 9.807"),
        (10.0, "decimal"),
        (1000.0, "kN"),
        (4.44822, "lbf"),
        (0.001, "too small by 1000"),
    ],
)
def test_a_wrong_unit_is_refused_and_named(factor, word):
    spoilt = [
        replace(p, reference=p.reference * factor, reference_u=p.reference_u * factor)
        for p in points(52.0, 1.0)
    ]
    said = refused(spoilt)
    assert word in said


@pytest.mark.parametrize(
    ("si_unit", "ratio", "word"),
    [
        ("Pa", 6.894757, "psi for kPa"),
        ("Pa", 100.0, "bar for kPa"),
        ("Pa", 14.5, "psi for bar"),
        ("rad", 57.3, "rad for deg"),
        ("rad", 1 / 57.3, "too small"),
        ("N", 9.81, "kg"),
    ],
)
def test_units_are_named_by_their_factor(si_unit, ratio, word):
    assert word in unit_suspects(ratio, si_unit)


@pytest.mark.parametrize("ratio", [1.0, 0.9, 1.3, 2.0, -9.81, 0.0, math.nan])
def test_a_gain_that_is_merely_off_has_no_unit_to_blame(ratio):
    assert unit_suspects(ratio, "N") == ""


def test_one_point_in_a_wrong_unit_is_named():
    spoilt = points()
    spoilt[6] = replace(spoilt[6], reference=spoilt[6].reference / 9.80665)
    said = refused(spoilt)
    assert "point 7 looks too small by" in said and "9.807" in said


def test_absolute_pressures_for_gauge_ones_are_named():
    scale = replace(SCALE, si_unit="Pa", gain=25e3, valid=(-0.8, 9.8), atmosphere_pa=101_325.0)
    shifted = [
        replace(p, reference=500.0 * p.reference + 101_325.0, reference_u=100.0) for p in points()
    ]
    assert "absolute pressures taken for gauge" in refused(shifted, scale)


@pytest.mark.parametrize(
    ("spoil", "word"),
    [
        (lambda s: s[:1], "at least two different references"),
        (lambda s: [], "0 points"),
        (lambda s: [s[0], s[0], s[12]], "at least two different references"),
        (lambda s: [replace(s[0], reading=math.nan), *s[1:]], "beyond the converter"),
        (lambda s: [replace(s[0], scatter=math.nan), *s[1:]], "no number"),
        (lambda s: [replace(s[0], reference=math.inf), *s[1:]], "no number"),
        (lambda s: [*s[:6], replace(s[6], reading=10.0), *s[7:]], "end of what the converter"),
        (lambda s: [*s[:6], replace(s[6], reading=9.9), *s[7:]], "outside of what the rig file"),
        (lambda s: [replace(p, reference_u=20.0) for p in s], "too close together"),
        (lambda s: [replace(p, reading=1.0, scatter=0.0) for p in s], "stay at 1 V"),
    ],
)
def test_what_makes_no_line_is_refused(spoil, word):
    assert word in refused(spoil(points()))


def test_another_sensor_need_not_be_like_the_last_one():
    doubled = points(120.0)
    assert "factor of 2" in refused(doubled)
    assert calibrate(doubled, SCALE, is_new=True).line.gain == pytest.approx(120.0, rel=2e-3)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), gain=st.floats(35.0, 75.0), u=st.floats(0.02, 1.0))
def test_sound_points_are_taken(seed, gain, u):
    if gain < 36.0:
        return  # 300 N would be beyond the converter's valid range
    assert calibrate(points(gain, seed=seed, u=u), SCALE).line.gain == pytest.approx(gain, rel=0.02)
