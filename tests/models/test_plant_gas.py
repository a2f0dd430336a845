"""The gas: mass, p V^n, limits of pressure, and ISO 6358 flow."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.models.blocks import gas, muscle, orifice
from epa_rt.models.compiled import compiled
from epa_rt.models.parameters import neutral_params

lengths = st.lists(st.floats(0.11, 0.16), min_size=2, max_size=30)


def params_with(**values):
    params = neutral_params()
    for name, value in values.items():
        params["gas"][name] = value
    return params


@settings(max_examples=40, deadline=None)
@given(lengths, st.floats(1.0, 1.4), st.floats(2e4, 9e5))
def test_shut_valves_keep_mass_and_p_v_to_the_n_exactly(path, exponent, start_pa):
    params, n = params_with(polytropic_ratio=exponent), len(path)
    pressure, mass = gas.gas_over_log(
        params, path, np.zeros(n), np.zeros(n), 1e-3, start_pa=start_pa
    )
    assert np.all(mass == mass[0])
    volume = np.array([muscle.shape(params[0]["muscle"][0], 1e-6, x)[0] for x in path])
    assert pressure * volume**exponent == pytest.approx(
        np.full(n, pressure[0] * volume[0] ** exponent), rel=1e-12
    )


@settings(max_examples=40, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(0.115, 0.15), st.booleans(), st.booleans()), min_size=5, max_size=40
    ),
    st.floats(1.0, 1.4),
    st.floats(0, 1e-3),
)
def test_pressure_stays_between_vacuum_and_what_supply_and_compression_allow(steps, exponent, leak):
    params = params_with(
        polytropic_ratio=exponent,
        leak_per_s=leak,
        inlet_conductance_m3_s_pa=1e-9,
        exhaust_conductance_m3_s_pa=1e-9,
    )
    path = np.repeat([s[0] for s in steps], 20)
    path = np.convolve(path, np.ones(15) / 15, mode="same").clip(0.115, 0.15)
    inlet, exhaust = (np.repeat([float(s[k]) for s in steps], 20) for k in (1, 2))
    pressure, mass = gas.gas_over_log(params, path, inlet, exhaust, 1e-3)
    supply, squeeze = 101325 + 850e3, 1.113**exponent * 1.05  # volumes differ by at most 11.3 %
    assert (
        np.all(pressure > 101325 / squeeze**2)
        and np.all(pressure < supply * squeeze)
        and np.all(mass > 0)
    )


@settings(max_examples=30, deadline=None)
@given(st.floats(0.115, 0.15), st.floats(1e3, 2e6))
def test_filling_at_fixed_length_rises_to_the_supply_and_never_above(length, supply_gauge):
    params, n = params_with(supply_gauge_pa=supply_gauge, inlet_conductance_m3_s_pa=5e-9), 3000
    pressure, _ = gas.gas_over_log(params, np.full(n, length), np.ones(n), np.zeros(n), 1e-3)
    assert np.all(np.diff(pressure) >= -1e-6) and np.all(pressure <= 101325 + supply_gauge + 1e-6)
    assert pressure[-1] == pytest.approx(101325 + supply_gauge, rel=1e-3)


@given(st.floats(1e4, 2e6), st.floats(1e4, 2e6), st.floats(0.05, 0.6))
def test_flow_runs_down_the_pressure_and_is_odd(a, b, critical):
    flow = orifice.orifice(1e-9, critical, 293.15, a, b)
    assert (flow > 0) == (a > b) and (flow == 0) == (a == b)
    assert orifice.orifice(1e-9, critical, 293.15, b, a) == -flow


@given(st.floats(0.05, 0.6), st.floats(0, 1))
def test_flow_chokes_falls_and_has_a_bounded_slope(critical, ratio):
    value = orifice.flow_ratio(ratio, critical)
    assert 0 <= value <= 1
    assert value == 1 if ratio <= critical else value < 1
    assert abs(orifice.flow_ratio(min(ratio + 1e-7, 1.0), critical) - value) <= 100 * 1e-7
    assert orifice.flow_ratio(1.0, critical) == 0.0


def test_choked_flow_by_hand():
    # C = 1e-9 m^3/(s Pa), 1 MPa upstream, 20 deg C: C * rho0 * p1
    assert orifice.orifice(1e-9, 0.3, 293.15, 1e6, 2e5) == pytest.approx(
        1e-9 * 1.185 * 1e6, rel=1e-12
    )
    r = math.sqrt(1 - ((0.6 - 0.3) / 0.7) ** 2)
    assert orifice.orifice(1e-9, 0.3, 330.0, 1e6, 6e5) == pytest.approx(
        1.185e-3 * math.sqrt(293.15 / 330) * r, rel=1e-12
    )


def test_a_leak_loses_its_rate_of_the_gauge_pressure():
    params, n = params_with(leak_per_s=5e-4), 10000
    pressure, _ = gas.gas_over_log(
        params, np.full(n, 0.14), np.zeros(n), np.zeros(n), 1e-3, start_pa=701325.0
    )
    assert pressure[-1] - 101325 == pytest.approx(600e3 * math.exp(-5e-4 * 10.0), rel=1e-6)


@given(st.floats(1e-4, 2e-2), st.floats(2e5, 9e5))
@settings(max_examples=20, deadline=None)
def test_a_leak_through_a_narrow_gap_falls_with_the_squared_pressures(rate, start_pa):
    """dp/dt = -k (p^2 - a^2)/(2 a): (p - a)/(p + a) falls exponentially."""
    params, n = params_with(leak_per_s=rate, leak_laminar_ratio=1.0), 5000
    pressure, _ = gas.gas_over_log(
        params, np.full(n, 0.14), np.zeros(n), np.zeros(n), 1e-3, start_pa=start_pa
    )
    first, last = ((p - 101325.0) / (p + 101325.0) for p in (start_pa, pressure[-1]))
    assert last == pytest.approx(first * math.exp(-rate * n * 1e-3), rel=1e-6)


@given(st.floats(1e4, 2e6), st.floats(1e4, 2e6), st.floats(0.0, 1.0))
def test_what_a_shut_valve_leaks_runs_downhill_and_is_all_the_same_into_a_vacuum(a, b, laminar):
    p = params_with(critical_ratio=0.3, leak_laminar_ratio=laminar)[0]["gas"][0]
    part = _leaks(p, 0.0, 1e-3, a, b)
    assert _leaks(p, 0.0, 1e-3, b, a) == -part and part * (a - b) >= 0.0
    assert _leaks(p, 0.0, 1e-3, a, 1e-3) == pytest.approx(_leaks(p, 1e-3, 1e-3, a, 1e-3), rel=1e-9)
    assert abs(part) <= abs(_leaks(p, 0.0, 1e-3, max(a, b), 1e-3)) * (1.0 + 1e-9)


@compiled
def _leaks(p, opening, seat, from_pa, to_pa):
    """Flow of a valve at an opening whose seat leaks."""
    return orifice.seat_flow(
        p, orifice.laminar_part(p, opening, seat), max(opening, seat), 1e-9, from_pa, to_pa
    )


def test_heat_returns_the_gas_to_the_isothermal_pressure():
    params, n = params_with(fill_heating_ratio=1.4, heat_exchange_per_s=2.0), 8000
    inlet = (np.arange(n) < 500).astype(float)
    pressure, mass = gas.gas_over_log(params, np.full(n, 0.13), inlet, np.zeros(n), 1e-3)
    volume, _ = muscle.shape(params[0]["muscle"][0], 1e-6, 0.13)
    isothermal = mass * 287.05 * 293.15 / volume
    assert pressure[500] > 1.05 * isothermal[500]
    assert pressure[-1] == pytest.approx(isothermal[-1], rel=1e-4)


FAST = {
    "supply_gauge_pa": 850e3,
    "inlet_conductance_m3_s_pa": 2e-10,
    "exhaust_conductance_m3_s_pa": 2e-10,
}


@settings(max_examples=20, deadline=None)
@given(st.floats(0.12, 0.15), st.floats(1e5, 5e5), st.floats(0.0, 1.0))
def test_without_walls_filling_brings_the_enthalpy_of_what_comes_in(length, start_pa, part):
    """Energy of the gas in a rigid volume: V dp = (1 + 0.4 a) R T0 dm, whatever the flow."""
    params, n = params_with(adiabatic_ratio=part, wall_exchange_per_s=0.0, **FAST), 400
    pressure, mass = gas.gas_over_log(
        params, np.full(n, length), np.ones(n), np.zeros(n), 1e-3, start_pa=start_pa
    )
    volume = muscle.shape(params[0]["muscle"][0], 1e-6, length)[0]
    warm = (1.0 + 0.4 * part) * 287.05 * 293.15
    assert (pressure - start_pa) * volume == pytest.approx(
        warm * (mass - start_pa * volume / (287.05 * 293.15)), rel=1e-9, abs=1e-12
    )


@settings(max_examples=20, deadline=None)
@given(st.floats(0.12, 0.15), st.floats(2e5, 9e5))
def test_without_walls_venting_is_isentropic(length, start_pa):
    params, n = params_with(adiabatic_ratio=1.0, wall_exchange_per_s=0.0, **FAST), 300
    pressure, mass = gas.gas_over_log(
        params, np.full(n, length), np.zeros(n), np.ones(n), 1e-3, start_pa=start_pa
    )
    assert pressure[-1] < 0.999 * start_pa
    began_kg = start_pa * muscle.shape(params[0]["muscle"][0], 1e-6, length)[0] / (287.05 * 293.15)
    assert pressure / start_pa == pytest.approx((mass / began_kg) ** 1.4, rel=2e-4)


@settings(max_examples=20, deadline=None)
@given(lengths, st.floats(0.2, 5.0))
def test_walls_bring_the_gas_back_to_where_it_would_have_been_without_heat(path, exchange):
    """After any motion with shut valves and a long wait: the isothermal pressure."""
    path = np.concatenate([np.repeat(path, 20), np.full(round(25.0 / exchange / 1e-3), 0.13)])
    still = np.zeros(len(path))
    warm, _ = gas.gas_over_log(
        params_with(adiabatic_ratio=1.0, wall_exchange_per_s=exchange),
        path,
        still,
        still,
        1e-3,
        start_pa=3e5,
    )
    plain, _ = gas.gas_over_log(params_with(), path, still, still, 1e-3, start_pa=3e5)
    assert warm[-1] == pytest.approx(plain[-1], rel=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.floats(2e5, 8e5), st.floats(0.3, 5.0), st.floats(0.1, 0.5))
def test_air_that_only_its_warmth_stirs_cools_as_a_power_of_time(start_pa, exchange, rise):
    """Shut in and 1 % or so too warm: dw/dt = -k (w/w0)^r w, so that w^-r grows straight with time
    (natural convection, Nusselt over a root of Rayleigh).
    """
    params, n = (
        params_with(
            adiabatic_ratio=1.0, wall_exchange_per_s=exchange, wall_exchange_rise_ratio=rise
        ),
        4000,
    )
    path = np.concatenate([np.linspace(0.140, 0.137, 20), np.full(n, 0.137)])
    still = np.zeros(len(path))
    pressure, _ = gas.gas_over_log(params, path, still, still, 1e-3, start_pa=start_pa)
    rest, _ = gas.gas_over_log(params_with(), path, still, still, 1e-3, start_pa=start_pa)
    warmer = pressure[20:] / rest[-1] - 1.0
    grown = np.abs(warmer) ** -rise
    per_s = rise * exchange * gas.WARMER**-rise
    assert np.diff(grown)[1:] == pytest.approx(per_s * 1e-3, rel=1e-3)


@settings(max_examples=20, deadline=None)
@given(lengths, st.floats(2e5, 8e5), st.floats(0.3, 5.0), st.floats(0.1, 20.0))
def test_gas_that_flow_stirs_cools_as_ever_where_nothing_flows(path, start_pa, exchange, stir):
    still = np.zeros(len(path))
    heat = {"adiabatic_ratio": 1.0, "wall_exchange_per_s": exchange}
    stirred, _ = gas.gas_over_log(
        params_with(**heat, wall_exchange_stir_s=stir), path, still, still, 1e-3, start_pa=start_pa
    )
    plain, _ = gas.gas_over_log(params_with(**heat), path, still, still, 1e-3, start_pa=start_pa)
    assert np.array_equal(stirred, plain)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.3, 5.0), st.floats(0.5, 20.0))
def test_gas_that_flow_stirs_is_filled_between_unstirred_and_isothermal(exchange, stir):
    """It takes up heat of its filling, but gives more of it to the walls: its pressure lies between
    those of the two limits all along the fill.
    """
    path, still, filling = np.full(600, 0.14), np.zeros(600), np.r_[np.ones(500), np.zeros(100)]
    heat = {"adiabatic_ratio": 1.0, "wall_exchange_per_s": exchange}
    stirred, plain, cold = (
        gas.gas_over_log(params_with(**more), path, filling, still, 1e-3)[0]
        for more in ({**heat, "wall_exchange_stir_s": stir}, heat, {})
    )
    assert (cold[50:] < stirred[50:]).all() and (stirred[50:] < plain[50:]).all()


@pytest.mark.parametrize("stir_s", [0.0, 0.3, 20.0])
@pytest.mark.parametrize("exchange", [0.03, 100.0])
def test_stirred_gas_stays_a_number_at_the_ends_of_its_law(exchange, stir_s):
    """A knee's valves and its two sub-steps a cycle: there 50 s and no limit of the rate had been
    none.
    """
    params = params_with(
        adiabatic_ratio=1.0,
        wall_exchange_per_s=exchange,
        wall_exchange_stir_s=stir_s,
        inlet_conductance_m3_s_pa=3e-10,
        exhaust_conductance_m3_s_pa=3e-10,
    )
    path, inlet = np.full(900, 0.14), np.r_[np.ones(400), np.zeros(500)]
    pressure, mass = gas.gas_over_log(params, path, inlet, 1.0 - inlet, 1e-3, substeps=2)
    assert (
        np.isfinite(pressure).all()
        and (mass > 0.0).all()
        and (np.diff(pressure[5:400]) > -1.0).all()
    )


def regulated(ring: float, time_s: float):
    """(N,) lagged flow behind a constant one of 2e-4 kg/s that starts at once, by midpoint steps,
    until a swing has died down to e^-8.
    """
    flow_kg_s, step_s, seconds = 2e-4, 2.5e-4, 16.0 * time_s * max(ring, 1.0)
    p, y = (
        params_with(supply_droop_pa_s_kg=1e8, droop_time_s=time_s, droop_ring_ratio=ring)[0]["gas"][
            0
        ],
        np.zeros(2),
    )
    out = np.empty(int(seconds / step_s))
    for k in range(len(out)):
        middle = y + 0.5 * step_s * np.array(gas.droop_rates(p, flow_kg_s, *y))
        y = y + step_s * np.array(gas.droop_rates(p, flow_kg_s, *middle))
        out[k] = y[0]
    return out


@settings(max_examples=20, deadline=None)
@given(st.floats(0.0, 4.0), st.floats(0.002, 0.1))
def test_a_regulator_ends_at_the_flow_and_swings_beyond_it_only_from_a_quarter_on(ring, time_s):
    found = regulated(ring, time_s)
    assert found[-1] == pytest.approx(2e-4, rel=1e-3)
    damping = 0.5 / math.sqrt(ring) if ring > 0.0 else math.inf
    beyond = (
        math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
        if damping < 1.0 and ring * time_s >= gas.RINGS_FROM_S
        else 0.0
    )
    assert np.max(found) / 2e-4 - 1.0 == pytest.approx(beyond, abs=0.01)


def test_a_regulator_near_choking_loses_twice_as_much_per_flow_and_the_same_when_it_swings_back():
    straight, bent = (
        params_with(supply_droop_pa_s_kg=1e8, droop_bend_s_kg=bend)[0]["gas"][0]
        for bend in (0.0, 5e3)
    )
    full = gas.supply_pressure(straight, 0.0)
    for flow_kg_s, times in ((2e-4, 2.0), (1e-6, 1.0), (-2e-4, 2.0)):
        lost = full - gas.supply_pressure(straight, flow_kg_s)
        assert full - gas.supply_pressure(bent, flow_kg_s) == pytest.approx(times * lost, rel=1e-4)


def test_a_regulator_without_a_ring_follows_with_one_time_constant():
    assert regulated(0.0, 0.02)[79] == pytest.approx(2e-4 * (1.0 - math.exp(-1.0)), rel=1e-4)
    assert np.array_equal(regulated(0.04, 0.02), regulated(0.0, 0.02))  # 0.8 ms: none
