"""The fit recovers a known line, and its uncertainty means what it says."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.calibrate.calibration import Common, calibrate
from epa_rt.calibrate.line import fit_line, york
from epa_rt.calibrate.point import directions, reading_of
from tests.calibrate.made import SCALE, UP_DOWN, points


@settings(max_examples=50, deadline=None)
@given(
    gain=st.floats(30.0, 80.0), offset=st.floats(-20.0, 20.0), x=st.lists(
        st.floats(-9.0, 9.0), min_size=2, max_size=30, unique=True)
)  # fmt: skip
def test_points_on_a_line_give_the_line(gain, offset, x):
    x = np.array(x)
    if np.ptp(x) < 1e-3:
        return
    one = np.ones_like(x)
    found = york(x, gain * x + offset, 1e-3 * one, 0.1 * one)
    assert found[0] == pytest.approx(gain, rel=1e-6)
    assert found[1] == pytest.approx(offset, abs=1e-5)
    assert found[3] == pytest.approx(0.0, abs=1e-6)


def test_yorks_own_example():
    """Pearson's data with York's weights (York 1966): slope -0.4805, intercept 5.4799."""
    x = np.array([0.0, 0.9, 1.8, 2.6, 3.3, 4.4, 5.2, 6.1, 6.5, 7.4])
    y = np.array([5.9, 5.4, 4.4, 4.6, 3.5, 3.7, 2.8, 2.8, 2.4, 1.5])
    wx = np.array([1e3, 1e3, 5e2, 8e2, 2e2, 8e1, 6e1, 2e1, 1.8, 1.0])
    wy = np.array([1.0, 1.8, 4.0, 8.0, 20.0, 20.0, 70.0, 70.0, 1e2, 5e2])
    slope, intercept, covariance, chi2 = york(x, y, wx**-0.5, wy**-0.5)
    assert slope == pytest.approx(-0.480533, abs=1e-5)
    assert intercept == pytest.approx(5.479911, abs=1e-5)
    assert chi2 == pytest.approx(11.86635, abs=1e-3)
    assert covariance[0, 0] ** 0.5 == pytest.approx(0.0580, abs=2e-3)
    assert covariance[1, 1] ** 0.5 == pytest.approx(0.2950, abs=1e-2)


def test_the_stated_uncertainty_holds_as_often_as_it_says():
    """Of 400 tries 95 % within the binomial spread (four of its deviations)."""
    held = 0
    for seed in range(400):
        line = calibrate(points(51.0, 1.0, seed=seed), SCALE).line
        held += abs(line.gain - 51.0) < line.k * line.gain_u
    assert 0.95 - 4.0 * (0.95 * 0.05 / 400) ** 0.5 < held / 400 <= 0.99


def test_scatter_beyond_what_was_stated_is_used_and_said():
    sound = points(seed=3, u=2.0)
    stated = [p.__class__(**{**p.__dict__, "reference_u": 0.01}) for p in sound]
    found = calibrate(stated, SCALE)
    assert not found.line.believed and found.line.scale > 20.0
    assert found.line.gain_u > 0.3 * calibrate(sound, SCALE).line.gain_u
    assert any("times as much as their stated" in text for text in found.remarks)


def test_what_all_references_share_widens_the_gain():
    apart = calibrate(points(), SCALE).line
    common = calibrate(points(), SCALE, Common(scale=0.002, zero=0.5)).line
    assert common.gain_u**2 == pytest.approx(apart.gain_u**2 + (0.002 * apart.gain) ** 2)
    assert common.offset_u > 0.5


def test_two_points_make_a_line_by_what_was_stated():
    found = calibrate(points(references=[0.0, 300.0]), SCALE)
    assert found.line.k == pytest.approx(2.306, abs=1e-3)  # t of 8 degrees of freedom
    assert found.findings.bend is None and found.findings.hysteresis is None
    assert "two points" in found.remarks[0]


def test_a_record_cannot_be_better_than_its_converter():
    step = 0.005
    flat = reading_of(np.full(1000, 1.25), step)
    assert flat[1] == pytest.approx(step / 12**0.5)
    noise = np.random.default_rng(1).normal(1.25, 0.01, 1000)
    assert reading_of(noise, step)[1] < step / 12**0.5
    assert reading_of(np.linspace(0.0, 1.0, 1000), step)[3] == pytest.approx(0.5, abs=1e-2)


def test_ways_of_points():
    assert directions([0, 1, 2, 1, 1, 0]) == ("up", "up", "up", "down", "down", "down")
    assert directions([3.0]) == ("up",)


def test_bend_and_hysteresis_are_found_where_they_are():
    bent = calibrate(points(bend=3.0), SCALE).findings
    assert bent.is_bent and abs(bent.bend) == pytest.approx(3.0, abs=0.3)
    loop = calibrate(points(hysteresis=2.0), SCALE).findings
    assert loop.has_hysteresis and loop.hysteresis == pytest.approx(2.0, abs=0.6)
    sound = calibrate(points(), SCALE).findings
    assert not sound.is_bent and not sound.has_hysteresis
    assert sound.repeatability is None and sound.zero_drift is not None


def test_repeated_references_give_repeatability():
    found = calibrate(points(references=np.tile(UP_DOWN, 4), u=0.2, seed=5), SCALE)
    assert found.findings.repeatability == pytest.approx(0.2, rel=0.35)


def test_line_is_a_line():
    line = fit_line(*(np.array(v, float) for v in ([0, 1, 2], [0, 2, 4], [0, 0, 0], [1, 1, 1])))
    assert line.value(np.array([3.0]))[0] == pytest.approx(6.0)
    assert line.std(np.array([9.0]))[0] > line.std(np.array([1.0]))[0]
