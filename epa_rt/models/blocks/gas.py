"""Gas of one muscle: ISO 6358 valves, polytropic compression, leak, heat, and a supply that
droops.
"""

import math

import numpy as np

from epa_rt.models.blocks.muscle import shape
from epa_rt.models.blocks.orifice import laminar_part, seat_flow
from epa_rt.models.blocks.power import power
from epa_rt.models.compiled import compiled

WALLS_PA = 4e5  # absolute pressure at which walls bring gas back at the rate they are given
WARMER = (
    0.1  # share of its temperature above that around it at which they do, if the rate rises with it
)
# exponent of the flow that stirs the gas: of Reynolds' number in vessels while they are filled
STIRS = 0.67
# rate of stirred gas at which it is as warm as its walls for any sensor, and no step of the
# integrator is too long yet
AT_ONCE_PER_S = 1000.0
HEAT_CAPACITY = 0.4  # ratio of heat capacities of air, less 1
# a regulator's second lag below that is none: two sub-steps of a cycle of a millisecond, so that no
# step is too long for it
RINGS_FROM_S = 1e-3
SHUT = 1e-6  # a valve closing below this opening is shut exactly
# a lagged supply flow below this (kg/s, its rate in kg/s^2) is none: it moves no bit of a pressure,
# and numbers that go on fading become too small for a processor to be fast with
NO_FLOW = 1e-100


@compiled
def opening_after(opening, wanted, decay):
    """Opening of a valve after a time with lag factor ``decay`` = exp(-t/lag)."""
    return wanted + (opening - wanted) * decay


@compiled
def settled(opening, wanted):
    """Opening at the end of a sub-step: exactly shut once it is as good as shut."""
    return 0.0 if wanted == 0.0 and opening < SHUT else opening


@compiled
def faded(supply_flow):
    """Lagged supply flow, or its rate, at the end of a sub-step: exactly none once it is next to
    none.
    """
    return 0.0 if abs(supply_flow) < NO_FLOW else supply_flow


@compiled
def supply_pressure(p, supply_flow):
    """Absolute supply pressure (Pa) behind a regulator that droops with the (lagged) mass flow, and
    more steeply the nearer its seat is to choking.
    """
    bent = p.droop_bend_s_kg * supply_flow
    return (
        p.atmosphere_pa
        + p.supply_gauge_pa
        - p.supply_droop_pa_s_kg * supply_flow * (1.0 + bent * bent)
    )


@compiled
def droop_rates(p, drawn, supply_flow, flow_rate):
    """Rates of the lagged supply flow (kg/s^2) and of its rate (kg/s^3): zero while nothing has
    been drawn, so that a still plant costs nothing.

    Without a ring the flow follows with one time constant, and ``flow_rate`` stays zero."""
    asked = 0.0 if drawn == supply_flow else (drawn - supply_flow) / p.droop_time_s
    shorter_s = p.droop_ring_ratio * p.droop_time_s
    if shorter_s < RINGS_FROM_S:
        return asked, 0.0
    return flow_rate, (asked - flow_rate) / shorter_s


@compiled
def exponent(p):
    """Exponent n of the state c = p V^n: the polytropic one and what compression heats beyond
    it.
    """
    return p.polytropic_ratio + p.compression_heating_ratio + HEAT_CAPACITY * p.adiabatic_ratio


@compiled
def warms(p):
    """Does the gas leave the temperature around it?"""
    return (
        (p.fill_heating_ratio != 1.0)
        | (p.compression_heating_ratio != 0.0)
        | (p.adiabatic_ratio != 0.0)
    )


@compiled
def cooling(p, at_rest_pa, warmer, changed_per_s):
    """Rate (1/s) at which the gas returns to the temperature around it, at the pressure (Pa) that
    it would then have; ``warmer`` (1): share of its temperature above that, or below;
    ``changed_per_s`` (1/s): what flows in and out in a second over the gas that is there.
    """
    found = 0.0
    if p.fill_heating_ratio != 1.0:
        found += p.heat_exchange_per_s
    if p.compression_heating_ratio != 0.0:
        found += p.compression_cooling_per_s
    if p.adiabatic_ratio != 0.0:
        walls = p.wall_exchange_per_s * power(WALLS_PA / at_rest_pa, p.wall_exchange_fall_ratio)
        if p.wall_exchange_rise_ratio != 0.0:
            walls *= (abs(warmer) / WARMER) ** p.wall_exchange_rise_ratio
        found += (
            walls
            if p.wall_exchange_stir_s == 0.0
            else min(walls * (1.0 + p.wall_exchange_stir_s * changed_per_s) ** STIRS, AT_ONCE_PER_S)
        )
    return found


@compiled
def pressure(p, c, volume):
    """Absolute pressure (Pa) of the state c = p V^n."""
    return c / power(volume, exponent(p))


@compiled
def leaked(p, pressure_pa):
    """Gauge pressure (Pa) that drives a leak, more than it is where the leak is laminar: a mean of
    both pressures over the outer one carries it.
    """
    over = pressure_pa - p.atmosphere_pa
    return (
        over
        if p.leak_laminar_ratio == 0.0
        else over * (1.0 + p.leak_laminar_ratio * over / (2.0 * p.atmosphere_pa))
    )


@compiled
def rates(p, c, mass, volume, pressure_pa, supply_pa, inlet, exhaust):
    """Rates of c and of the gas mass (kg/s), and the flow drawn from the supply (kg/s).

    With valves shut and no leak or heat the first two are exactly zero: p V^n and the mass are
    constant.
    """
    if inlet != 0.0 and p.inlet_stuck_ratio != 0.0:
        inlet *= 1.0 - p.inlet_stuck_ratio
    if exhaust != 0.0 and p.exhaust_stuck_ratio != 0.0:
        exhaust *= 1.0 - p.exhaust_stuck_ratio
    narrow_in, narrow_out = (
        laminar_part(p, inlet, p.inlet_seat_leak_ratio),
        laminar_part(p, exhaust, p.exhaust_seat_leak_ratio),
    )
    inlet = max(inlet, p.inlet_seat_leak_ratio)
    exhaust = max(exhaust, p.exhaust_seat_leak_ratio)
    drawn, lost, heat = 0.0, 0.0, 0.0
    if inlet > 0.0:
        drawn = seat_flow(p, narrow_in, inlet, p.inlet_conductance_m3_s_pa, supply_pa, pressure_pa)
    if exhaust > 0.0:
        lost = seat_flow(
            p, narrow_out, exhaust, p.exhaust_conductance_m3_s_pa, pressure_pa, p.atmosphere_pa
        )
    thermal = p.gas_constant_j_kg_k * p.temperature_k
    if p.leak_per_s != 0.0:
        lost += p.leak_per_s * leaked(p, pressure_pa) * volume / thermal
    if warms(p):
        at_rest_pa = mass * thermal / volume
        back = cooling(
            p, at_rest_pa, pressure_pa / at_rest_pa - 1.0, (abs(drawn) + abs(lost)) / mass
        )
        if back != 0.0:
            heat = back * (at_rest_pa - pressure_pa)
    if drawn == 0.0 and lost == 0.0 and heat == 0.0:
        return 0.0, 0.0, 0.0
    gained, spent = drawn * p.fill_heating_ratio if drawn > 0.0 else drawn, lost
    if p.adiabatic_ratio != 0.0:  # enthalpy over energy; what leaves is as warm as the gas is
        warmth, capacity = (
            pressure_pa * volume / (mass * thermal),
            1.0 + HEAT_CAPACITY * p.adiabatic_ratio,
        )
        gained *= capacity * (1.0 if gained > 0.0 else warmth)
        spent *= capacity * (warmth if spent > 0.0 else 1.0)
    pressure_rate = thermal * (gained - spent) / volume + heat
    return c / pressure_pa * pressure_rate, drawn - lost, drawn


def gas_over_log(params, length_m, inlet, exhaust, period_s, muscle=0, start_pa=None, substeps=4):
    """Absolute pressure (Pa) and gas mass (kg) at the end of each cycle from *measured* length and
    valve commands.

    All inputs (N,); length at the cycle ends, straight in between; valves 0/1 held over the cycle.
    The run starts at ``start_pa`` (atmosphere if None) and the first length. Returns two (N,)
    arrays.
    """
    atmosphere_pa = float(params["gas"][0, muscle]["atmosphere_pa"])
    out = np.zeros((2, len(length_m)))
    _over_log(
        params,
        muscle,
        np.asarray(length_m, float),
        np.asarray(inlet, float),
        np.asarray(exhaust, float),
        period_s,
        atmosphere_pa if start_pa is None else start_pa,
        substeps,
        out,
    )
    return out[0], out[1]


@compiled
def _over_log(params, muscle, length, inlet, exhaust, period_s, start_pa, substeps, out):
    g, m = params[0].gas[muscle], params[0].muscle[muscle]
    h = period_s / substeps
    decay = math.exp(-0.5 * h / g.valve_lag_s)
    volume, _ = shape(m, g.dead_volume_m3, length[0])
    c = start_pa * power(volume, exponent(g))
    mass = start_pa * volume / (g.gas_constant_j_kg_k * g.temperature_k)
    opened_in, opened_out, droop, ringing = 0.0, 0.0, 0.0, 0.0
    for k in range(length.shape[0]):
        before = length[max(k - 1, 0)]
        for j in range(substeps):
            d1, m1, f1, r1 = _rates_at(
                g,
                m,
                before + (length[k] - before) * (j / substeps),
                c,
                mass,
                droop,
                ringing,
                opened_in,
                opened_out,
            )
            opened_in = opening_after(opened_in, inlet[k], decay)
            opened_out = opening_after(opened_out, exhaust[k], decay)
            middle = before + (length[k] - before) * ((j + 0.5) / substeps)
            d2, m2, f2, r2 = _rates_at(
                g,
                m,
                middle,
                c + h / 2 * d1,
                mass + h / 2 * m1,
                droop + h / 2 * f1,
                ringing + h / 2 * r1,
                opened_in,
                opened_out,
            )
            opened_in = settled(opening_after(opened_in, inlet[k], decay), inlet[k])
            opened_out = settled(opening_after(opened_out, exhaust[k], decay), exhaust[k])
            c, mass, droop, ringing = c + h * d2, mass + h * m2, droop + h * f2, ringing + h * r2
        volume, _ = shape(m, g.dead_volume_m3, length[k])
        out[0, k] = pressure(g, c, volume)
        out[1, k] = mass


@compiled
def _rates_at(g, m, length, c, mass, droop, ringing, inlet, exhaust):
    volume, _ = shape(m, g.dead_volume_m3, length)
    rate, mass_rate, drawn = rates(
        g, c, mass, volume, pressure(g, c, volume), supply_pressure(g, droop), inlet, exhaust
    )
    follows, swings = droop_rates(g, drawn, droop, ringing)
    return rate, mass_rate, follows, swings
