"""What heat can still do to gas shut in: bounds hold for any walls, and a leak is beyond them."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_valve_set_and_hold import SETTINGS, Bench, closed_loop, make_gas

from epa_rt.control.valve import ValveCause, ValveState
from epa_rt.control.valve_heat import HeatAccount
from epa_rt.control.valve_settings import ValveSettings

ATMOSPHERE_PA = 101325.0
RELAXED = 1.0 - 1.0 / 1.4


@given(st.floats(1e5, 8e5), st.floats(1e3, 8e5), st.floats(0.05, 100.0), st.floats(0.1, 60.0))
def test_no_walls_cool_a_fill_faster_than_the_bound(start_pa, rise_pa, walls_s, elapsed_s):
    heat = HeatAccount(SETTINGS)
    heat.flowed(start_pa, start_pa + rise_pa)
    left_pa = RELAXED * rise_pa
    rate_pa_s = left_pa * math.exp(-elapsed_s / walls_s) / walls_s
    assert left_pa <= heat.warm_pa <= SETTINGS.relax_ratio * (start_pa + rise_pa)
    assert rate_pa_s <= heat.fall_pa_s(elapsed_s) and heat.rise_pa_s(elapsed_s) == 0.0


def test_what_the_pressure_did_and_time_are_taken_off():
    heat = HeatAccount(SETTINGS)
    heat.flowed(6e5, 4e5)
    assert heat.cool_pa == pytest.approx(0.35 * 2e5) and heat.warm_pa == 0.0
    heat.moved(5e4)
    assert heat.cool_pa == pytest.approx(2e4)
    heat.flowed(4e5, 6e5)
    heat.moved(-1e4)
    assert heat.warm_pa == pytest.approx(6e4) and heat.cool_pa == pytest.approx(2e4)
    heat.flowed(6e5, 3e5)
    assert heat.warm_pa == pytest.approx(3e4)
    heat.stood(SETTINGS.heat_s)
    assert heat.warm_pa == pytest.approx(3e4 / math.e)
    heat.forget()
    assert heat.warm_pa == heat.cool_pa == 0.0


@closed_loop(12)
@given(
    st.sampled_from([3.0, 6.0, 10.0, 20.0]),
    st.floats(200, 800),
    st.lists(st.floats(60, 750), min_size=1, max_size=3),
)
def test_walls_that_take_their_time_are_no_open_valve(heat_s, fill_kpa_s, targets_kpa):
    bench = Bench(make_gas(heat_s=heat_s, fill_kpa_s=fill_kpa_s))
    for target_kpa in targets_kpa:
        valve = bench.set(ATMOSPHERE_PA + target_kpa * 1e3, seconds=120.0).valve
        assert valve.state is ValveState.HOLDING, valve.cause_text
        assert abs(bench.error_kpa) < 0.15 * target_kpa + 2.0


@pytest.mark.parametrize("leak_1_s", [0.02, 0.05])
@pytest.mark.parametrize("heat_s", [1.0, 20.0])
def test_a_leak_beside_slow_walls_is_found(leak_1_s, heat_s):
    bench = Bench(make_gas(leak_1_s=leak_1_s, heat_s=heat_s))
    bench.valve.set(700e3)
    bench.run(120.0, until=(ValveState.FAILED,))
    assert bench.valve.cause is ValveCause.EXHAUST_STUCK_OPEN


def test_a_new_target_under_way_keeps_what_flowed():
    bench = Bench(make_gas(heat_s=20.0))
    bench.valve.set(600e3)
    bench.run(0.5)
    assert bench.valve.state is ValveState.FILLING
    assert bench.set(300e3, seconds=120.0).valve.state is ValveState.HOLDING


def test_the_time_of_walls_is_a_setting():
    with pytest.raises(ValueError, match="heat_s"):
        ValveSettings(heat_s=0.0)
