"""PID: limits, windup, bumpless changes, derivative, NaN, and an independent formula."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.control.pid import Pid, PidGains

DT_S = 1e-3
value = st.floats(-1e3, 1e3)
wild = st.one_of(value, st.floats(allow_nan=True, allow_infinity=True))
gains = st.builds(
    lambda kp, ki, kd, cutoff, low, width: PidGains(kp, ki, kd, cutoff, low, low + width),
    st.floats(-20, 20),
    st.floats(-200, 200),
    st.floats(-1, 1),
    st.floats(0.1, 2000.0) | st.just(math.inf),
    st.floats(-50, 50),
    st.floats(0.1, 100),
)


def textbook(g, samples, dt_s):
    """The formula written down directly: sums from the first sample, no state, no limits."""
    outputs = []
    rate = 0.0
    for k, (reference, measurement, feedforward) in enumerate(samples):
        if k:
            slope = (measurement - samples[k - 1][1]) / dt_s
            kept = math.exp(-2 * math.pi * g.derivative_cutoff_hz * dt_s)
            rate = kept * rate + (1 - kept) * slope
        integral = g.ki * dt_s * math.fsum(r - m for r, m, _ in samples[: k + 1])
        outputs.append(g.kp * (reference - measurement) + integral - g.kd * rate + feedforward)
    return outputs


@given(
    st.lists(st.tuples(value, value, value), min_size=1, max_size=30),
    st.floats(-20, 20),
    st.floats(-20, 20),
    st.floats(-1, 1),
    st.floats(1, 500),
)
def test_follows_the_independent_formula(samples, kp, ki, kd, cutoff_hz):
    g = PidGains(kp, ki, kd, cutoff_hz)
    pid = Pid(g)
    for sample, expected in zip(samples, textbook(g, samples, DT_S), strict=True):
        assert pid.step(*sample, DT_S) == pytest.approx(expected, rel=1e-9, abs=1e-6)
    assert pid.saturated == 0


@given(gains, st.lists(st.tuples(wild, wild, wild), max_size=40), st.floats(-200, 200))
def test_output_is_within_limits_or_nan(g, samples, start):
    pid = Pid(g)
    pid.reset(0.0, start)
    was_tame = True  # the slope to a sample beyond all bounds is beyond them too
    for sample in samples:
        output = pid.step(*sample, DT_S)
        assert g.low <= output <= g.high or math.isnan(output)
        is_tame = all(map(math.isfinite, sample)) and max(map(abs, sample)) < 1e100
        if is_tame and was_tame:
            assert not math.isnan(output)
        was_tame = is_tame


@given(gains, value, value, value, st.floats(0, 1))
def test_reset_is_bumpless(g, reference, measurement, feedforward, part):
    start = g.low + part * (g.high - g.low)
    pid = Pid(g)
    pid.step(1.0, 2.0, 3.0, DT_S)
    pid.reset(measurement, start)
    assert pid.step(reference, measurement, feedforward, DT_S) == pytest.approx(start, abs=1e-9)
    # The second step moves by one integration step at most: the seed is not clamped away
    # afterwards.
    second = pid.step(reference, measurement, feedforward, DT_S)
    assert abs(second - start) <= abs(g.ki * (reference - measurement)) * DT_S + 1e-9


@given(gains, gains, st.lists(st.tuples(value, value, value), min_size=2, max_size=20))
def test_gain_change_is_bumpless(g, h, samples):
    h = PidGains(h.kp, h.ki, h.kd, h.derivative_cutoff_hz, g.low, g.high)
    pid = Pid(g)
    pid.reset(samples[0][1], 0.5 * (g.low + g.high))
    for sample in samples:
        before = pid.step(*sample, DT_S)
    pid.step(*samples[-1], DT_S)
    before = pid.step(*samples[-1], DT_S)
    saturated = pid.saturated
    pid.set_gains(h)
    after = pid.step(*samples[-1], DT_S)
    error = samples[-1][0] - samples[-1][1]
    slope = max(abs(b[1] - a[1]) for a, b in pairwise(samples)) / DT_S
    allowed = (abs(h.ki * error) * DT_S + abs(h.kd) * slope) + 1e-6
    if saturated == 0:
        assert abs(after - before) <= allowed


@given(gains, st.floats(-100, 100).filter(lambda e: abs(e) > 1.0), st.integers(1, 5000))
def test_leaves_the_limit_at_once_after_saturation(g, error, cycles):
    """With the integral at its stop, a reversed error of the same size brings the output off the
    limit in one step.
    """
    g = PidGains(abs(g.kp) + 0.1, abs(g.ki), 0.0, math.inf, -10.0, 10.0)
    pid = Pid(g)
    for _ in range(min(cycles, 300)):
        stuck = pid.step(error, 0.0, 0.0, 10.0 * DT_S)
    reversed_ = pid.step(-error, 0.0, 0.0, 10.0 * DT_S)
    limit = 10.0 if error > 0 else -10.0
    if stuck == limit:
        assert abs(reversed_) < 10.0 or reversed_ == -limit


def test_long_saturation_costs_no_more_than_short():
    """A first-order plant that cannot reach the reference for 100 s returns as fast as after 20
    s.
    """

    def cycles_back(saturated_s):
        pid = Pid(PidGains(kp=2.0, ki=5.0, low=-1.0, high=1.0))
        x = 0.0
        for _ in range(int(saturated_s / DT_S)):
            x += DT_S * (pid.step(5.0, x, 0.0, DT_S) - x)
        for n in range(10_000):
            x += DT_S * (pid.step(0.2, x, 0.0, DT_S) - x)
            if abs(x - 0.2) < 0.02:
                return n
        raise AssertionError("never came back")

    assert abs(cycles_back(100.0) - cycles_back(20.0)) <= 2


def test_saturation_is_counted_and_only_then():
    pid = Pid(PidGains(kp=1.0, low=-1.0, high=1.0))
    pid.step(0.5, 0.0, 0.0, DT_S)
    assert pid.saturated == 0
    assert pid.step(3.0, 0.0, 0.0, DT_S) == 1.0
    assert pid.step(-3.0, 0.0, 0.0, DT_S) == -1.0
    assert pid.saturated == 2


def test_no_derivative_kick_on_a_reference_step():
    pid = Pid(PidGains(kp=0.0, kd=10.0, derivative_cutoff_hz=100.0))
    assert [pid.step(r, 1.0, 0.0, DT_S) for r in (0.0, 0.0, 100.0, -100.0)] == [0.0] * 4


def test_derivative_of_a_ramp_settles_at_its_slope_with_the_filters_time_constant():
    pid = Pid(PidGains(kp=0.0, kd=1.0, derivative_cutoff_hz=10.0))
    pid.reset(0.0, 0.0)
    pid.step(0.0, 0.0, 0.0, DT_S)
    for k in range(1, 101):
        output = pid.step(0.0, 3.0 * k * DT_S, 0.0, DT_S)
        assert output == pytest.approx(-3.0 * (1.0 - math.exp(-2 * math.pi * 10.0 * k * DT_S)))


@given(
    st.sampled_from([0, 1, 2]), st.sampled_from([math.nan, math.inf, -math.inf]), st.integers(1, 5)
)
def test_a_bad_input_gives_nan_and_leaves_no_trace(place, bad, times):
    pids = [Pid(PidGains(kp=2.0, ki=3.0, kd=0.1, derivative_cutoff_hz=50.0)) for _ in range(2)]
    for k in range(10):
        outputs = [pid.step(1.0, 0.1 * k, 0.0, DT_S) for pid in pids]
    broken = [1.0, 0.9, 0.0]
    broken[place] = bad
    for _ in range(times):
        assert math.isnan(pids[0].step(*broken, DT_S))
    for k in range(10):
        outputs = [pid.step(1.0, 0.9 + 0.1 * k, 0.0, DT_S) for pid in pids]
        assert outputs[0] == outputs[1]


@pytest.mark.parametrize("dt_s", [0.0, -1e-3, math.nan, math.inf])
def test_a_period_that_is_none_is_refused(dt_s):
    with pytest.raises(ValueError, match="dt_s"):
        Pid(PidGains(1.0)).step(0.0, 0.0, 0.0, dt_s)


@pytest.mark.parametrize(
    "bad",
    [{"kp": math.nan}, {"ki": math.inf}, {"derivative_cutoff_hz": 0.0}, {"low": 1.0, "high": 1.0}],
)
def test_gains_that_make_no_sense_are_refused(bad):
    with pytest.raises(ValueError, match="expected"):
        PidGains(**{"kp": 1.0, **bad})
