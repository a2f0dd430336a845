"""The i2t limit against its closed form."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from safety_bench import Bench, edited

from epa_rt.safety.thermal import ThermalLimit


@given(
    st.floats(0.1, 50.0),
    st.floats(0.01, 100.0),
    st.floats(1e-4, 1.0),
    st.floats(0.0, 60.0),
    st.integers(1, 300),
)
def test_heat_of_a_held_current_is_the_closed_form(continuous, tau, period, current, cycles):
    limit = ThermalLimit(continuous, tau, period)
    for n in range(1, cycles + 1):
        over = limit.step(current)
        exact = current**2 * -math.expm1(-n * period / tau)
        assert limit.heat_a2 == pytest.approx(exact, rel=1e-9, abs=1e-9)
        assert limit.heat_ratio == pytest.approx(exact / continuous**2, rel=1e-9, abs=1e-9)
        if abs(exact / continuous**2 - 1) > 1e-6:
            assert over == (exact > continuous**2)


def test_the_continuous_current_may_flow_for_ever_and_no_more():
    limit = ThermalLimit(4.0, 1.0, 0.001)
    assert not any(limit.step(4.0) for _ in range(100_000))
    assert limit.heat_ratio == pytest.approx(1.0, rel=1e-9)
    assert any(limit.step(4.01) for _ in range(20_000))
    cooling = [limit.step(0.0) for _ in range(1000)]
    assert not cooling[-1] and limit.heat_ratio == pytest.approx(math.exp(-1), rel=0.02)


@given(st.floats(0.01, 10.0), st.floats(0.01, 1.0), st.lists(st.floats(-50.0, 50.0), max_size=50))
def test_heat_stays_between_the_least_and_the_most_that_flowed(tau, period, currents):
    limit = ThermalLimit(1.0, tau, period)
    for current in currents:
        limit.step(current)
        assert 0.0 <= limit.heat_a2 <= max(c * c for c in currents) * (1 + 1e-12)


def test_exactly_at_its_limit_is_not_over():
    limit = ThermalLimit(2.0, 1.0, 0.001)
    limit.heat_a2 = 4.0
    assert not limit.step(2.0) and limit.heat_a2 == 4.0 and limit.heat_ratio == 1.0


def test_a_current_that_is_no_number_is_over():
    limit = ThermalLimit(4.0, 1.0, 0.001)
    assert limit.step(math.nan) and limit.step(0.0)
    assert ThermalLimit(4.0, 1.0, 0.001).step(math.inf)


def test_the_envelope_trips_when_the_winding_is_hot():
    bench = Bench()  # 4.06 A, 3.96 s
    expected = math.ceil(-3.96 * math.log(1 - (4.06 / 8.0) ** 2) / 0.001)
    for n in range(1, expected + 1):
        assert bench.trip is None, n
        out = bench.check({"motor_current_a": -8.0})
    assert out == bench.safe and bench.trip.cycle == expected - 1
    assert (
        str(bench.trip)
        == "motor overload: i\u00b2t of motor_current_a passed its limit (heat 1.00)"
    )
    assert bench.trip.signal == "motor_current_a"


def test_a_rig_without_i2t_lets_the_current_flow():
    bench = Bench(
        edited(
            "bench",
            ("  i2t: {current: motor_current_a, continuous: 4.06 A, time_constant: 3.96 s}\n", ""),
        )
    )
    for _ in range(5000):
        bench.check({"motor_current_a": 8.9})
    assert bench.trip is None
