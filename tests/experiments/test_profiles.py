"""Profiles: limits kept, scalar and vector alike, speed the derivative of position, rest at both
ends.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.experiments.oscillations import Chirp, Multisine, Sine
from epa_rt.experiments.profiles import Blended, Braking, Hold, Move, Staircase, Step
from epa_rt.experiments.random_speed import RandomSpeed

POSITIONS = st.floats(-0.5, 0.5)
SPEEDS = st.floats(1e-3, 2.0)
ACCELERATIONS = st.floats(1e-2, 200.0)


@st.composite
def random_speeds(draw):
    low = draw(POSITIONS)
    high = low + draw(st.floats(1e-3, 0.5))
    start = draw(st.floats(low - 0.01, high + 0.01))
    speed, acceleration = draw(st.floats(5e-3, 1.0)), draw(st.floats(0.05, 50.0))
    shortest = draw(st.floats(0.01, 0.3))
    return (
        RandomSpeed(
            start,
            low,
            high,
            speed,
            acceleration,
            (shortest, shortest + draw(st.floats(0.0, 1.0))),
            draw(st.floats(10.0, 30.0)),
            draw(st.integers(0, 2**40)),
        ),
        start,
    )


@st.composite
def oscillations(draw):
    mean, amplitude = draw(POSITIONS), draw(st.floats(1e-4, 0.2))
    duration_s = draw(st.floats(4.0, 30.0))
    fade_s = draw(st.floats(0.1, 2.0))
    hz = st.floats(0.1, 10.0)
    kind = draw(st.sampled_from(["chirp", "sine", "multisine"]))
    if kind == "chirp":
        return Chirp(mean, amplitude, draw(hz), draw(hz), duration_s, fade_s)
    if kind == "sine":
        return Sine(mean, amplitude, draw(hz), duration_s, fade_s)
    harmonics = tuple(sorted(draw(st.sets(st.integers(1, 40), min_size=2, max_size=8))))
    return Multisine(
        mean, amplitude, harmonics, 4.0, duration_s, fade_s, draw(st.integers(0, 1000))
    )


@st.composite
def pieces(draw):
    kind = draw(st.sampled_from(["move", "step", "staircase", "braking", "hold", "random"]))
    levels = draw(st.lists(POSITIONS, min_size=1, max_size=5))
    if kind == "move":
        return Move(draw(POSITIONS), draw(POSITIONS), draw(SPEEDS), draw(ACCELERATIONS))
    if kind == "step":
        return Step(draw(POSITIONS), levels, 0.2, draw(st.floats(0.01, 1.0)))
    if kind == "staircase":
        return Staircase(draw(POSITIONS), levels, 0.2, draw(SPEEDS), draw(ACCELERATIONS))
    if kind == "braking":
        return Braking(draw(POSITIONS), draw(st.floats(-1.0, 1.0)), draw(ACCELERATIONS))
    if kind == "hold":
        return Hold(draw(POSITIONS), draw(st.floats(0.0, 3.0)))
    return draw(random_speeds())[0]


@st.composite
def blended(draw):
    return Blended(draw(oscillations()), draw(st.floats(-0.05, 0.05)), draw(st.floats(0.05, 1.0)))


PROFILES = st.one_of(pieces(), oscillations(), blended())


def times(profile, count=1500):
    return np.linspace(-0.1, min(profile.duration_s, 60.0) + 0.2, count)


@settings(deadline=None, max_examples=100)
@given(PROFILES)
def test_at_equals_sample_to_rounding(profile):
    t_s = times(profile)
    positions, speeds = profile.sample(t_s)
    each = np.array([profile.at(float(t)) for t in t_s])
    scale = 1.0 + profile.peaks.speed
    np.testing.assert_allclose(each[:, 0], positions, rtol=0, atol=1e-12)
    np.testing.assert_allclose(each[:, 1], speeds, rtol=0, atol=1e-11 * scale)


@settings(deadline=None, max_examples=100)
@given(PROFILES)
def test_positions_and_speeds_stay_within_the_peaks(profile):
    positions, speeds = profile.sample(times(profile, 4001))
    peaks = profile.peaks
    assert positions.min() >= peaks.low - 1e-12 and positions.max() <= peaks.high + 1e-12
    assert np.abs(speeds).max() <= peaks.speed * 1.005 + 1e-12


@settings(deadline=None, max_examples=100)
@given(PROFILES, st.floats(0.0, 1.0))
def test_speed_is_the_derivative_of_position_and_acceleration_is_finite(profile, where):
    t_s, h = where * profile.duration_s, 1e-5
    before, after = profile.at(t_s - h), profile.at(t_s + h)
    bound = profile.peaks.acceleration * 1.1 + 1e-9
    if before[0] == profile.at(0.0)[0] and t_s < h:  # a profile may begin with a speed (Braking)
        return
    assert abs(after[1] - before[1]) <= 2.0 * h * bound + 1e-9
    assert abs((after[0] - before[0]) / (2.0 * h) - profile.at(t_s)[1]) <= 2.0 * h * bound + 1e-7


@settings(deadline=None, max_examples=100)
@given(PROFILES)
def test_profiles_end_at_rest_where_they_say(profile):
    position, speed = profile.at(profile.duration_s)
    assert (position, speed) == (profile.end, 0.0) == profile.at(profile.duration_s + 3.0)
    just_before = profile.at(max(profile.duration_s - 1e-7, 0.0))
    assert abs(just_before[0] - profile.end) <= 1e-6 * (1.0 + profile.peaks.speed)
    assert abs(just_before[1]) <= 1e-6 * (1.0 + profile.peaks.acceleration) + (
        abs(profile.at(0.0)[1]) if profile.duration_s < 1e-7 else 0.0
    )


@settings(deadline=None, max_examples=100)
@given(random_speeds())
def test_random_speed_keeps_range_limits_and_duration(made):
    profile, start = made
    t_s = np.arange(0.0, profile.duration_s, 0.002)
    positions, speeds = profile.sample(t_s)
    assert profile.at(0.0) == pytest.approx((start, 0.0), abs=1e-12)
    peaks = profile.peaks
    assert positions.min() >= peaks.low and positions.max() <= peaks.high
    assert np.abs(np.diff(speeds)).max() <= peaks.acceleration * 0.002 * (1 + 1e-9) + 1e-12
    assert profile.at(profile.duration_s)[1] == 0.0


def test_random_speed_fills_its_range_with_both_signs():
    profile = RandomSpeed(0.0, 0.001, 0.027, 0.05, 1.0, (0.1, 0.8), 200.0, (1, 2))
    positions, speeds = profile.sample(np.arange(0.0, 200.0, 0.001))
    in_range = np.histogram(positions, bins=10, range=(0.001, 0.027))[0] / positions.size
    assert in_range.min() > 0.04
    assert np.abs(speeds).max() > 0.045 and abs(speeds.mean()) < 1e-3
    assert 0.4 < (speeds > 0).mean() < 0.6


def test_random_speed_is_the_same_for_the_same_seed_on_every_machine():
    def profile(seed):
        return RandomSpeed(0.0, 0.001, 0.027, 0.05, 1.0, (0.1, 0.8), 20.0, seed)

    first, again, other = profile((1, 1, 3, 0)), profile((1, 1, 3, 0)), profile((1, 1, 3, 1))
    t_s = np.linspace(0.0, 20.0, 500)
    assert np.array_equal(first.sample(t_s), again.sample(t_s))
    assert not np.array_equal(first.sample(t_s), other.sample(t_s))
    # recorded once: a change here means that every identification run changes
    assert first.at(7.5) == pytest.approx(RECORDED, rel=1e-9)


RECORDED = (0.01189527911577411, -0.04116766420898837)


@settings(deadline=None)
@given(st.floats(-1.0, 1.0), st.floats(-2.0, 2.0), ACCELERATIONS)
def test_braking_takes_half_as_long_again_as_a_constant_deceleration(position, speed, deceleration):
    profile = Braking(position, speed, deceleration)
    if 1.5 * abs(speed) / deceleration < 1e-9:
        assert profile.duration_s == 0.0 and profile.end == position
        return
    assert profile.duration_s == pytest.approx(1.5 * abs(speed) / deceleration)
    assert profile.end == pytest.approx(
        position + math.copysign(0.75 * speed**2 / deceleration, speed), abs=1e-12
    )
    assert profile.at(0.0) == (position, speed)
    assert profile.peaks.acceleration == pytest.approx(deceleration)


@settings(deadline=None)
@given(st.floats(-0.1, 0.1), st.floats(-2.0, 2.0), st.floats(0.5, 20.0), st.floats(-1.0, 1.0))
def test_braking_starts_with_the_acceleration_it_finds_and_ends_without_any(
    position, speed, deceleration, share
):
    acceleration = 2.0 * deceleration * share
    profile = Braking(position, speed, deceleration, acceleration)
    end_s = profile.duration_s
    if end_s == 0.0:
        return
    step_s = 1e-6 * end_s
    rest = profile.at(end_s - step_s)[1]
    assert (profile.at(step_s)[1] - speed) / step_s == pytest.approx(
        acceleration, rel=1e-3, abs=1e-4 * deceleration
    )
    assert abs(rest) / step_s < 1e-4 * deceleration
    assert profile.at(end_s)[0] == pytest.approx(profile.end)
    positions, speeds = profile.sample(np.linspace(0.0, end_s, 500))
    peaks = profile.peaks
    assert positions.min() >= peaks.low - 1e-12 and positions.max() <= peaks.high + 1e-12
    assert np.abs(speeds).max() <= peaks.speed * (1 + 1e-12)
    assert np.abs(np.diff(speeds)).max() / (end_s / 499) <= peaks.acceleration * (1 + 1e-9)


@settings(deadline=None)
@given(POSITIONS, POSITIONS, SPEEDS, ACCELERATIONS)
def test_a_move_reaches_one_of_its_limits(start, end, speed, acceleration):
    peaks = Move(start, end, speed, acceleration).peaks
    assert peaks.speed <= speed * (1 + 1e-9) and peaks.acceleration <= acceleration * (1 + 1e-9)
    if abs(end - start) > 1e-9:
        assert peaks.speed == pytest.approx(speed) or peaks.acceleration == pytest.approx(
            acceleration
        )


def test_chirp_goes_through_its_frequencies():
    chirp = Chirp(0.1, 0.05, 0.5, 2.0, 300.0, 2.0)
    t_s = np.arange(0.0, 300.0, 0.001)
    positions = chirp.sample(t_s)[0] - 0.1
    rising = t_s[1:][(positions[:-1] < 0) & (positions[1:] >= 0)]
    hz, at = 1.0 / np.diff(rising), 0.5 * (rising[1:] + rising[:-1])
    assert np.abs(hz - (0.5 + 1.5 * at / 300.0))[2:-2].max() < 0.01
    assert np.abs(positions).max() == pytest.approx(0.05, rel=1e-3)


def test_multisine_lines_are_equal_and_nowhere_else_and_crest_is_low():
    harmonics = (1, 2, 4, 7, 11, 17, 26, 40)
    wave = Multisine(0.0, 1.0, harmonics, 10.0, 60.0, 2.0, 5)
    positions = wave.sample(np.arange(10.0, 20.0, 0.01))[0]
    spectrum = np.abs(np.fft.rfft(positions)) / 500
    lines = spectrum[list(harmonics)]
    assert lines.std() < 1e-6 * lines.mean()
    assert np.delete(spectrum, harmonics).max() < 1e-6
    assert 0.97 < np.abs(positions).max() <= 1.0
    assert np.abs(positions).max() / positions.std() < 2.5


def test_a_step_waits_then_jumps_within_its_rise():
    step = Step(0.0, [0.01, 0.0], dwell_s=1.0, rise_s=0.1)
    assert step.duration_s == pytest.approx(3.2)
    assert [step.at(t)[0] for t in (0.5, 1.0, 1.05, 1.1, 2.0, 2.2)] == pytest.approx(
        [0.0, 0.0, 0.005, 0.01, 0.01, 0.0]
    )
    assert step.peaks.speed == pytest.approx(15 / 8 * 0.01 / 0.1)


def test_a_fade_longer_than_half_the_duration_is_refused():
    with pytest.raises(ValueError, match="found a fade that does not fit"):
        Sine(0.0, 1.0, 1.0, 10.0, 5.1)
