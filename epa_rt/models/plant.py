"""The whole plant: all blocks joined, moved by one cycle or over a whole log."""

import math

from epa_rt.models.blocks import braid, bus, drive, gas, muscle, sensors, transmission
from epa_rt.models.blocks.exponential import lag_weights
from epa_rt.models.chain import lengths, motion, pull, pulled_in, rates, write_seen, write_truth
from epa_rt.models.compiled import compiled
from epa_rt.models.groups import COMPILED, groups_of
from epa_rt.models.local import local_params, local_zeros
from epa_rt.models.ports import ANGLE, CURRENT, INTEGRAL, RING, SMOOTH, SUPPLY_FLOW, SUPPLY_RATE
from epa_rt.models.rest import new_state

__all__ = ["advance", "new_state", "over_log", "run", "run_roughly"]


@compiled
def _open_valves(p, s, valves, half_s):
    """Moves every valve's opening by half a sub-step."""
    for i in range(2):
        if p.muscle[i].present > 0.5 and (
            s.opening[i, 0] != valves[i] or s.opening[i, 1] != valves[2 + i]
        ):
            decay = math.exp(-half_s / p.gas[i].valve_lag_s)
            s.opening[i, 0] = gas.opening_after(s.opening[i, 0], valves[i], decay)
            s.opening[i, 1] = gas.opening_after(s.opening[i, 1], valves[2 + i], decay)


@compiled
def _integrate(p, s, h, weights, motor, valves):
    """Runge-Kutta of fourth order over one sub-step; targets and valve openings move with the
    stages.

    The winding current, the fastest state, takes exponential weights (blocks/exponential.py).
    """
    y, at, rate, total = s.smooth, local_zeros(SMOOTH), local_zeros(SMOOTH), local_zeros(SMOOTH)
    half, whole, reach, first, middle, last = weights
    i0, per_lag = y[CURRENT], 1.0 / p.drive.current_lag_s
    push = push1 = push2 = push3 = i1 = 0.0
    for i in range(SMOOTH):
        at[i] = y[i]
    for stage in range(4):
        rates(p, s, at, rate, motor, 0.5 * ((stage + 1) // 2))
        push = rate[CURRENT] + at[CURRENT] * per_lag
        if stage == 0:
            push1, i1 = push, half * i0 + reach * push
            current = i1
        elif stage == 1:
            push2, current = push, half * i0 + reach * push
        elif stage == 2:
            push3, current = push, half * i1 + reach * (2.0 * push - push1)
        else:
            break
        if stage != 1:
            _open_valves(p, s, valves, 0.5 * h)
        far = h if stage == 2 else 0.5 * h
        if stage == 0:
            for i in range(SMOOTH):
                total[i] = rate[i]
        else:
            for i in range(SMOOTH):
                total[i] += 2.0 * rate[i]
        for i in range(SMOOTH):
            at[i] = y[i] + far * rate[i]
        at[CURRENT] = current
    for i in range(SMOOTH):
        y[i] += h / 6.0 * (total[i] + rate[i])
    y[CURRENT] = whole * i0 + first * push1 + middle * (push2 + push3) + last * push


@compiled
def _integrate_roughly(p, s, h, weights, motor, valves):
    """The same by the midpoint rule, with half as many rates: another run, but one that a knob
    changes alike (docs/decisions/0013).
    """
    y, at, rate = s.smooth, local_zeros(SMOOTH), local_zeros(SMOOTH)
    half, whole, reach, first, middle, last = weights
    i0, per_lag, push = y[CURRENT], 1.0 / p.drive.current_lag_s, 0.0
    for i in range(SMOOTH):
        at[i] = y[i]
    for stage in range(2):
        rates(p, s, at, rate, motor, 0.5 * stage)
        push = rate[CURRENT] + at[CURRENT] * per_lag
        _open_valves(p, s, valves, 0.5 * h)
        if stage == 0:
            for i in range(SMOOTH):
                at[i] = y[i] + 0.5 * h * rate[i]
            at[CURRENT] = half * i0 + reach * push
    for i in range(SMOOTH):
        y[i] += h * rate[i]
    y[CURRENT] = whole * i0 + (first + 2.0 * middle + last) * push


@compiled
def _settle(p, s, valves):
    """Takes the finished sub-step into the elements with memory: backlash, slip, strap, shut
    valves, a supply flow that has faded.
    """
    spool, spool_speed, q, q_speed = motion(p, s)
    travel, travel_speed = pulled_in(p.transmission, spool, spool_speed)
    for i in range(2):
        m = p.muscle[i]
        if m.present > 0.5:
            length, speed = lengths(p.load, i, travel, travel_speed, q, q_speed)
            fitted = length - muscle.strap_stretch(m, s.strap_force_n[i])
            if m.strap_compliance_m_n != 0.0:
                _, _, _, _, s.strap_force_n[i] = pull(
                    p, s, s.smooth, i, travel, travel_speed, q, q_speed
                )
            moved = fitted - s.length_m[i]
            braid.settle(m, s.memory[i], moved, speed)
            s.length_m[i] = fitted
            s.opening[i, 0] = gas.settled(s.opening[i, 0], valves[i])
            s.opening[i, 1] = gas.settled(s.opening[i, 1], valves[2 + i])
    s.smooth[SUPPLY_FLOW] = gas.faded(s.smooth[SUPPLY_FLOW])
    s.smooth[SUPPLY_RATE] = gas.faded(s.smooth[SUPPLY_RATE])
    s.travel_m = spool
    s.geared_m = transmission.geared_travel(p.transmission, s.smooth[ANGLE])


@compiled
def _advance(p, s, command, reading, period_s, substeps, roughly, whole):
    """``whole``: with all of the state's truth, not only what sensors see of it."""
    bus.latch(s, command, period_s)
    motor_delay = p.bus.command_delay_s / period_s
    opening_s, closing_s = bus.valve_delays(p.bus.valve_delay_s, p.bus.valve_skew_ratio)
    seen = s.cycle + math.floor(
        -motor_delay
    )  # the command that the drive sees as this cycle starts
    s.smooth[INTEGRAL] = drive.integral_at_edge(
        s.ring[seen % RING], s.ring[(seen - 1) % RING], s.smooth[INTEGRAL], s.smooth[CURRENT]
    )
    h = period_s / substeps
    weights = lag_weights(h, p.drive.current_lag_s)
    for j in range(substeps):
        start, end = j / substeps, (j + 1) / substeps
        motor = bus.motor_seen(s.ring, s.cycle, start - motor_delay, end - motor_delay)
        valves = bus.valves_seen(
            s.ring, s.cycle, start, end, opening_s / period_s, closing_s / period_s
        )
        if roughly:
            _integrate_roughly(p, s, h, weights, motor, valves)
        else:
            _integrate(p, s, h, weights, motor, valves)
        _settle(p, s, valves)
    if whole:
        write_truth(p, s)
    else:
        write_seen(p, s)
    sensors.read(p.sensors, s, s.truth, p.gas[0].atmosphere_pa, reading, period_s)
    s.cycle += 1


@compiled
def advance(params, state, command, sensors_out, period_s, substeps):
    """Moves the plant by one bus cycle and writes the readings at its end.

    ``params`` PARAMS, ``state`` STATE (moved in place), ``command`` COMMAND (held over the cycle),
    ``sensors_out`` SENSORS (written): all of shape (1,). ``substeps`` of the integrator per cycle;
    see docs/plant.md.
    """
    _advance(params[0], state[0], command[0], sensors_out[0], period_s, substeps, False, True)


def _compiled_for(groups, roughly):
    """A run over a log, compiled for plants that have effects of these groups alone."""

    @compiled
    def run_of_groups(params, state, commands, period_s, substeps, sensors_out):
        p = local_params(params[0], groups)
        last = commands.shape[0] - 1
        for k in range(last + 1):
            _advance(
                p, state[0], commands[k], sensors_out[k], period_s, substeps, roughly, k == last
            )

    return run_of_groups


_RUNS = {
    (groups, roughly): _compiled_for(groups, roughly)
    for groups in COMPILED
    for roughly in (False, True)
}


def over_log(groups, roughly):
    """What ``run`` or ``run_roughly`` calls for plants whose effects are all of these ``groups``,
    one of ``COMPILED``. Effects of other groups are off in it, whatever the parameters say.
    """
    return _RUNS[groups, roughly]


def run(params, state, commands, period_s, substeps, sensors_out):
    """As ``advance`` for every row of ``commands`` (N,), readings into ``sensors_out`` (N,), in one
    compiled call. Groups of effects that ``params`` has none of cost nothing.
    """
    over_log(groups_of(params), False)(params, state, commands, period_s, substeps, sensors_out)


def run_roughly(params, state, commands, period_s, substeps, sensors_out):
    """As ``run`` by the midpoint rule: too coarse for what sensors show, not for what a parameter
    changes of it.
    """
    over_log(groups_of(params), True)(params, state, commands, period_s, substeps, sensors_out)
