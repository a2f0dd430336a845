"""Valves and length to pressure: the plant's gas along a measured length, levelled anew wherever
the valves stay shut.
"""

import math

import numpy as np

from epa_rt.gap.rig.house.compiled import compiled
from epa_rt.models.blocks import gas
from epa_rt.models.blocks.instruments import lagged
from epa_rt.models.blocks.muscle import shape, strap_stretch
from epa_rt.models.blocks.power import power
from epa_rt.models.compiled import inlined
from epa_rt.models.groups import GAS, MUSCLE, OTHERS
from epa_rt.models.local import local_params, local_zeros

STEPS = 2  # half-steps of a cycle: midpoint rule over each
# part of its heat that gas may lose in a cycle for a shut muscle to be taken over the whole of it
# at once
SLOW = 0.02
NUMBERS = 9  # of a muscle's state, see march
ALL = OTHERS | GAS | MUSCLE


@compiled
def volumes(params, i, length, strap_n, out):
    """Volume (N,) of muscle i at its line's length, ``strap_n`` (N,) stretching the strap."""
    m, g = params[0].muscle[i], params[0].gas[i]
    for k in range(len(out)):
        out[k], _ = shape(m, g.dead_volume_m3, length[k] - strap_stretch(m, strap_n[k]))


@inlined
def seen_valve(values, k, start, end, delays):
    """Mean over [start, end] (in cycles from the start of cycle k, not longer than one) of what a
    valve does that opens and closes late.
    """
    opening, closing = delays
    found = _held(values, k, start - opening, end - opening)
    if opening == closing:
        return found
    other = _held(values, k, start - closing, end - closing)
    return min(found, other) if closing < opening else max(found, other)


@inlined
def _held(values, k, start, end):
    first, last = math.floor(start), math.ceil(end) - 1
    before = values[max(k + first, 0)]
    if last <= first:
        return before
    part = (end - last) / (end - start)
    return (1.0 - part) * before + part * values[max(k + last, 0)]


@inlined
def _rates(g, c, mass, droop, ringing, volume, inlet, exhaust, others):
    rate, mass_rate, drawn = gas.rates(
        g,
        c,
        mass,
        volume,
        gas.pressure(g, c, volume),
        gas.supply_pressure(g, droop),
        inlet,
        exhaust,
    )
    follows, swings = gas.droop_rates(g, drawn + others, droop, ringing)
    return rate, mass_rate, follows, swings, drawn


@inlined
def is_tight(g):
    """Whether shut valves keep p V^n as it is."""
    return (
        g.leak_per_s == 0.0
        and gas.cooling(g, gas.WALLS_PA, gas.WARMER, 0.0) == 0.0
        and g.inlet_seat_leak_ratio == 0.0
        and g.exhaust_seat_leak_ratio == 0.0
    )


@inlined
def _still_for(inlet, exhaust, k, most):
    """For how many cycles before k both valves have been told to be shut, ``most`` + 1 at most;
    before the log they were as in its first cycle.
    """
    for n in range(most + 1):
        at = max(k - 1 - n, 0)
        if inlet[at] != 0.0 or exhaust[at] != 0.0:
            return n
    return most + 1


@inlined
def _midpoint(g, s, h, before, after, raised_before, raised_after):
    """A step of a muscle whose valves are shut from volume ``before`` to ``after``, both known as
    V^n too; returns what it draws.
    """
    supply, middle, raised = (
        gas.supply_pressure(g, s[2]),
        0.5 * (before + after),
        0.5 * (raised_before + raised_after),
    )
    d0, m0, _ = gas.rates(g, s[0], s[1], before, s[0] / raised_before, supply, s[3], s[4])
    c, mass = s[0] + 0.5 * h * d0, s[1] + 0.5 * h * m0
    d1, m1, flow = gas.rates(g, c, mass, middle, c / raised, supply, s[3], s[4])
    follows, swings = gas.droop_rates(g, flow, s[2], s[8])
    s[0], s[1], s[2], s[8] = s[0] + h * d1, s[1] + h * m1, s[2] + h * follows, s[8] + h * swings
    return flow


@inlined
def _half_step(g, s, h, decay, v0, v1, wanted_in, wanted_out, others):
    """A step in which valves open or close; returns what the muscle draws."""
    d0, m0, f0, r0, _ = _rates(g, s[0], s[1], s[2], s[8], v0, s[3], s[4], others)
    s[3], s[4] = (
        gas.opening_after(s[3], wanted_in, decay),
        gas.opening_after(s[4], wanted_out, decay),
    )
    d1, m1, f1, r1, flow = _rates(
        g,
        s[0] + 0.5 * h * d0,
        s[1] + 0.5 * h * m0,
        s[2] + 0.5 * h * f0,
        s[8] + 0.5 * h * r0,
        v1,
        s[3],
        s[4],
        others,
    )
    s[3] = gas.settled(gas.opening_after(s[3], wanted_in, decay), wanted_in)
    s[4] = gas.settled(gas.opening_after(s[4], wanted_out, decay), wanted_out)
    s[0], s[1], s[2], s[8] = s[0] + h * d1, s[1] + h * m1, s[2] + h * f1, s[8] + h * r1
    return flow


@compiled
def march(
    g,
    delays,
    volume,
    raised,
    inlet,
    exhaust,
    others,
    lags_s,
    period_s,
    k0,
    k1,
    s,
    truth,
    seen,
    drawn,
):
    """Cycles k0 to k1 from state s (c, mass, droop, openings, sensor's reading, pressure before,
    tube's reading, the droop's rate), which it moves. ``raised``: V^n (N,).
    """
    g, there, s = local_params(g, ALL), s, local_zeros(NUMBERS)  # known to nobody else, so faster
    for i in range(NUMBERS):
        s[i] = there[i]
    lag_s, tube_s = lags_s
    h = period_s / STEPS
    decay = math.exp(-0.5 * h / g.valve_lag_s)
    fade = math.exp(-period_s / lag_s) if lag_s > 0.0 else 0.0
    tube_fade = math.exp(-period_s / tube_s) if tube_s > 0.0 else 0.0
    tight, slow = is_tight(g), gas.cooling(g, gas.WALLS_PA, gas.WARMER, 0.0) * period_s < SLOW
    reach = math.ceil(max(delays[0], delays[1])) + 1
    still = _still_for(inlet, exhaust, k0, reach)
    for k in range(k0, k1):
        still = still + 1 if inlet[k] == 0.0 and exhaust[k] == 0.0 else 0
        drawn[k] = 0.0
        last = max(k - 1, 0)
        before, step = volume[last], volume[k] - volume[last]
        undisturbed = g.supply_droop_pa_s_kg == 0.0 or (
            s[2] == 0.0 and s[8] == 0.0 and others[k] == 0.0
        )  # no lagged flow that matters
        if still > reach and s[3] == 0.0 and s[4] == 0.0 and undisturbed and (tight or slow):
            if not tight:
                drawn[k] = _midpoint(g, s, period_s, before, volume[k], raised[last], raised[k])
        else:
            for j in range(STEPS):
                a, b = j / STEPS, (j + 1) / STEPS
                wanted_in, wanted_out = (
                    seen_valve(inlet, k, a, b, delays),
                    seen_valve(exhaust, k, a, b, delays),
                )
                v0, v1 = before + step * (j / STEPS), before + step * ((j + 0.5) / STEPS)
                drawn[k] += (
                    _half_step(g, s, h, decay, v0, v1, wanted_in, wanted_out, others[k]) / STEPS
                )
        pressure, reading = s[0] / raised[k], s[5]
        if lag_s > 0.0:
            behind = (pressure - s[6]) / period_s * lag_s
            s[5] = pressure - behind + (s[5] - s[6] + behind) * fade
        else:
            s[5] = pressure
        s[6] = pressure
        s[7] = lagged(s[7], reading, s[5], tube_s, period_s, tube_fade) if tube_s > 0.0 else s[5]
        truth[k], seen[k] = pressure, s[7]
    for i in range(NUMBERS):
        there[i] = s[i]


@compiled
def _level(seen, measured, k0, k1):
    """Factor on the predicted pressure that fits it to the measured one over a span."""
    top, bottom = 0.0, 0.0
    for k in range(k0, k1):
        top += seen[k] * measured[k]
        bottom += seen[k] * seen[k]
    return top / bottom if bottom > 0.0 and top > 0.0 else 1.0


@compiled
def _raise(s, factor):
    s[0] *= factor
    s[1] *= factor
    s[5:8] *= factor


@compiled
def pressures(
    params,
    i,
    delays,
    volume,
    inlet,
    exhaust,
    others,
    measured,
    shut,
    lags_s,
    period_s,
    truth,
    seen,
    drawn,
):
    """Absolute pressure of muscle i (N,) in ``truth``, behind both of ``lags_s`` in ``seen``, flow
    drawn in ``drawn``.

    ``lags_s``: the sensor's own, and of a tube or filter behind it. ``measured``: absolute pressure
    read (N,), which starts the run and levels every span of ``shut`` (spans, 2): behind both lags
    like ``seen``, for after a fill a slow tube still rises far into a span.
    """
    g = params[0].gas[i]
    s, raised = np.zeros(NUMBERS), np.empty(len(volume))
    for k in range(len(volume)):
        raised[k] = power(volume[k], gas.exponent(g))
    start = max(measured[0], 1e3) if abs(measured[0] - g.atmosphere_pa) > 5e3 else g.atmosphere_pa
    s[0], s[1] = start * raised[0], start * volume[0] / (g.gas_constant_j_kg_k * g.temperature_k)
    s[5] = s[6] = s[7] = start
    at = 0
    tight = is_tight(g)
    for n in range(len(shut)):
        k0, k1 = shut[n, 0], shut[n, 1]
        march(
            g,
            delays,
            volume,
            raised,
            inlet,
            exhaust,
            others,
            lags_s,
            period_s,
            at,
            k0,
            s,
            truth,
            seen,
            drawn,
        )
        kept = s.copy()
        march(
            g,
            delays,
            volume,
            raised,
            inlet,
            exhaust,
            others,
            lags_s,
            period_s,
            k0,
            k1,
            s,
            truth,
            seen,
            drawn,
        )
        factor = _level(seen, measured, k0, k1)
        if not (
            tight and s[3] == 0.0 and s[4] == 0.0
        ):  # not a mere scale: once more from the raised level
            _raise(kept, factor)
            s[:] = kept
            march(
                g,
                delays,
                volume,
                raised,
                inlet,
                exhaust,
                others,
                lags_s,
                period_s,
                k0,
                k1,
                s,
                truth,
                seen,
                drawn,
            )
            factor = _level(seen, measured, k0, k1)
        _raise(s, factor)
        for k in range(k0, k1):
            truth[k] *= factor
            seen[k] *= factor
        at = k1
    march(
        g,
        delays,
        volume,
        raised,
        inlet,
        exhaust,
        others,
        lags_s,
        period_s,
        at,
        len(volume),
        s,
        truth,
        seen,
        drawn,
    )
