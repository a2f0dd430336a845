"""The stand-in moved by a cycle or over a log: Heun's method with many small steps, the current
with its exponential.
"""

import math

import numpy as np

from sim_backend.stand_in import knee, motor, muscle, sensors
from sim_backend.stand_in.compiled import compiled
from sim_backend.stand_in.records import (
    ANGLE,
    CURRENT,
    INTEGRAL,
    LAG,
    LAG2,
    MASS,
    OPEN,
    PADE,
    PLACE,
    PRESSURE,
    RATE,
    RING,
    SPEED,
    STATE,
    STATES,
)
from sim_backend.stand_in.whole import followed, half_play, rates, tension, travel_of

SUBSTEPS = 8


@compiled
def _mean_valve(s, v, start, width):
    """Mean command of a valve over ``width`` cycles from ``start`` on, at most one change of cycle
    in between.
    """
    first = int(math.floor(start))
    before, after = s.valves[first % RING, v], s.valves[(first + 1) % RING, v]
    past = min(max((start + width - first - 1.0) / width, 0.0), 1.0)
    return before + (after - before) * past if past > 1e-9 else before


@compiled
def _see_valves(s, h, start, width, period_s):
    """Valve commands as the valves see them; hidden: they take ``valve_open_s`` to open and a part
    of it to close.
    """
    late = h.valve_open_s / period_s
    early = late * h.valve_close_ratio
    for v in range(4):
        s.seen[v] = min(
            _mean_valve(s, v, start - late, width), _mean_valve(s, v, start - early, width)
        )


@compiled
def _step(p, s, h_s, before, after, decay, share):
    """One step of Heun over h_s; targets ``before`` and ``after`` it."""
    y, first, second, guess = s.y, s.work[0], s.work[1], s.work[2]
    for n in range(STATES):
        first[n] = second[n] = 0.0
    rates(p, s, y, first, before[0], before[1], before[2])
    for n in range(STATES):
        guess[n] = y[n] + h_s * first[n]
    guess[CURRENT] = decay * y[CURRENT] + (1.0 - decay) * first[CURRENT]
    rates(p, s, guess, second, after[0], after[1], after[2])
    current = guess[CURRENT] + share * (second[CURRENT] - first[CURRENT])
    for n in range(STATES):
        y[n] += 0.5 * h_s * (first[n] + second[n])
    y[CURRENT] = current


@compiled
def _keep(p, s):
    """Elements with memory and valves that are shut, after a step."""
    y = s.y
    travel, travel_speed, _ = travel_of(p, s, y)
    q, q_speed, _ = knee.coordinate(p.load, p.hidden, y[PLACE], y[RATE])
    if p.hidden.play_m != 0.0:
        wound, _ = motor.wound(p.transmission, p.hidden, y[ANGLE])
        middle, _ = half_play(p, y)
        for j in range(3):
            half = middle * (1.0 + (j - 1) * p.hidden.play_spread_ratio)
            s.play_m[j], _ = followed(
                wound, 0.0, s.play_m[j], half, 0.0, y[SPEED]
            )  # where it is, not how fast
    for i in range(2):
        if p.muscle[i].present > 0.5:
            force, _, _, braid, _ = tension(p, s, y, i, travel, travel_speed, q, q_speed)
            if p.hidden.slip_ratio != 0.0:
                muscle.keep_elements(p.hidden, s.slip_m[i], braid - s.length_m[i])
            if p.hidden.strap_m != 0.0:
                _give_way(p, s, i, braid, force)
            s.length_m[i], s.pull_n[i] = braid, force
    for v in range(4):
        if s.seen[v] == 0.0 and y[OPEN + v] < 1e-6:
            y[OPEN + v] = 0.0


@compiled
def _give_way(p, s, i, braid, force):
    """Hidden: as the pull changes the strap gives, and the gas follows the braid, no flow in or
    out.
    """
    h, g = p.hidden, p.gas[i]
    given = muscle.stretch_of_strap(h, force) - muscle.stretch_of_strap(h, s.pull_n[i])
    volume, _, _ = muscle.body(p.muscle[i], h, g.dead_volume_m3, braid)
    after, _, _ = muscle.body(p.muscle[i], h, g.dead_volume_m3, braid - given)
    s.y[PRESSURE + i] *= (volume / after) ** (g.polytropic_ratio if h.gas_time_s == 0.0 else 1.4)


@compiled
def _follow(x, before, after, lag):
    """A first-order lag after one step along a straight line, exactly; ``lag`` in steps."""
    behind = (after - before) * lag
    return after - behind + (x - before + behind) * math.exp(-1.0 / lag)


@compiled
def _cycle(p, s, command, out, period_s, substeps):
    begins = motor.new_line(s.line, command, period_s)
    if begins != 0:
        s.y[INTEGRAL] = s.y[CURRENT] if begins > 0 else 0.0
    s.torque_nm = command.target_torque_nm
    for i in range(2):
        s.valves[s.cycle % RING, i], s.valves[s.cycle % RING, 2 + i] = (
            command.inlet[i],
            command.exhaust[i],
        )
    step_s = period_s / substeps
    z = step_s / p.drive.current_lag_s
    decay = math.exp(-z)
    share = 1.0 - (1.0 - decay) / z
    pade, line = p.hidden.pade_s, s.line
    lag = 0.5 * pade / step_s  # in steps
    if begins != 0:
        for c in range(3):
            s.y[PADE + c] = line[2 + 2 * c]
    for j in range(substeps):
        _see_valves(s, p.hidden, s.cycle + j / substeps, 1.0 / substeps, period_s)
        a, b = j / substeps, (j + 1) / substeps
        before = (
            line[2] + (line[3] - line[2]) * a,
            line[4] + (line[5] - line[4]) * a,
            line[6] + (line[7] - line[6]) * a,
        )
        after = (
            line[2] + (line[3] - line[2]) * b,
            line[4] + (line[5] - line[4]) * b,
            line[6] + (line[7] - line[6]) * b,
        )
        if pade == 0.0:
            _step(p, s, step_s, before, after, decay, share)
        else:  # hidden delay: Pade's all-pass of first order on every target
            x0, x1, x2 = s.y[PADE], s.y[PADE + 1], s.y[PADE + 2]
            n0, n1, n2 = (
                _follow(x0, before[0], after[0], lag),
                _follow(x1, before[1], after[1], lag),
                _follow(x2, before[2], after[2], lag),
            )
            _step(
                p,
                s,
                step_s,
                (2.0 * x0 - before[0], 2.0 * x1 - before[1], 2.0 * x2 - before[2]),
                (2.0 * n0 - after[0], 2.0 * n1 - after[1], 2.0 * n2 - after[2]),
                decay,
                share,
            )
            s.y[PADE], s.y[PADE + 1], s.y[PADE + 2] = n0, n1, n2
        _keep(p, s)
    sensors.read(p, s, out, period_s)
    s.cycle += 1


@compiled
def advance(params, state, command, sensors_out, period_s, substeps):
    """As ``epa_rt.models.plant.advance``, on (1,) STAND_IN and (1,) STATE."""
    _cycle(params[0], state[0], command[0], sensors_out[0], period_s, substeps)


@compiled
def run(params, state, commands, period_s, substeps, sensors_out):
    """As ``advance`` for every row of ``commands`` (N,), readings into ``sensors_out`` (N,)."""
    for k in range(commands.shape[0]):
        _cycle(params[0], state[0], commands[k], sensors_out[k], period_s, substeps)


def new_state(params: np.ndarray) -> np.ndarray:
    """The state at rest, (1,) STATE: muscles vented, spool at its start, load where it hangs.
    ``params``: (1,) STAND_IN.
    """
    p, state = params[0], np.zeros(1, STATE)
    s, y = state[0], state[0]["y"]
    h, w = p["hidden"], p["load"]
    angle = float(
        w["start_travel_m"] * p["transmission"]["gear_ratio"] / p["transmission"]["spool_radius_m"]
    )
    for _ in range(30):
        travel, slope = motor.wound(p["transmission"], h, angle)
        angle -= (travel - float(w["start_travel_m"])) / slope
    y[ANGLE] = angle
    s["play_m"][:] = float(w["start_travel_m"])
    y[PLACE] = _hanging(p)
    q, _, _ = knee.coordinate(w, h, y[PLACE], 0.0)
    for i in range(2):
        g = p["gas"][i]
        length = (
            w[f"rest{i}_m"] + w[f"travel{i}_ratio"] * w["start_travel_m"] + w[f"load{i}_ratio"] * q
        )
        volume, _, _ = muscle.body(p["muscle"][i], h, g["dead_volume_m3"], length)
        s["length_m"][i] = length
        y[PRESSURE + i] = g["atmosphere_pa"]
        y[MASS + i] = g["atmosphere_pa"] * volume / (g["gas_constant_j_kg_k"] * g["temperature_k"])
    y[LAG + 2] = y[LAG2 + 2] = p["gas"][0]["supply_gauge_pa"]
    return state


def _hanging(p) -> float:
    """Where the load rests under its own weight, the end stops, and muscles without pressure."""
    w, h = p["load"], p["hidden"]
    if w["kind_code"] == 0.0:
        return 0.0
    unit = "m" if w["kind_code"] == 1.0 else "rad"
    low, high = float(w[f"low_{unit}"]) - 1.0, float(w[f"high_{unit}"]) + 1.0
    for _ in range(80):
        place, force = 0.5 * (low + high), 0.0
        q, _, _ = knee.coordinate(w, h, place, 0.0)
        for i in range(2):
            if p["muscle"][i]["present"] > 0.5:
                length = (
                    w[f"rest{i}_m"]
                    + w[f"travel{i}_ratio"] * w["start_travel_m"]
                    + w[f"load{i}_ratio"] * q
                )
                force -= w[f"load{i}_ratio"] * muscle.pull(
                    p["muscle"][i], h, 0.0, 0.0, length, 0.0, 0.0, np.zeros(8), 0.0, 0.0, 0.0
                )
        if knee.acceleration(w, h, place, 0.0, 0.0, force)[0] > 0.0:
            low = place
        else:
            high = place
    return 0.5 * (low + high)
