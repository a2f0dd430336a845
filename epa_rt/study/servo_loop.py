"""Muscles and load of a plant, moved by a position servo with a lag under the paper's PID; one
compiled loop.

The plant's own blocks (gas, muscle, braid, load) stand between spool and load. What is idealised is
the motor: the spool's travel follows the PID's output with one lag, and the drive's limits do not
bind. What it would cost is in study/motion.py.
"""

import math

from epa_rt.models.blocks import braid, gas, load, muscle
from epa_rt.models.blocks.power import power
from epa_rt.models.chain import lengths, muscle_rates, pull
from epa_rt.models.compiled import compiled
from epa_rt.models.local import local_zeros
from epa_rt.models.ports import (
    ANGLE,
    GAS_C,
    GAS_MASS,
    INTEGRAL,
    LOAD_PLACE,
    LOAD_SPEED,
    LOAD_STICTION,
    SMOOTH,
)

# columns of a trace
(
    TIME,
    REFERENCE,
    PLACE,
    PLACE_SPEED,
    TRAVEL,
    TRAVEL_SPEED,
    FORCE0,
    FORCE1,
    PRESSURE0,
    PRESSURE1,
    LENGTH0,
    COLUMNS,
) = range(12)
TRAVEL_SLOT = (
    ANGLE  # the spool's travel (m) takes the place of the motor's angle among the smooth states
)


@compiled
def reference(wave, t):
    """Wanted load coordinate (m) and its speed; ``wave``: mean, amplitude, angular frequency,
    fade-in (s).
    """
    mean, amplitude, omega, fade = wave
    grown, growth = 1.0, 0.0
    if t < fade:
        grown, growth = (
            0.5 - 0.5 * math.cos(math.pi * t / fade),
            0.5 * math.pi / fade * math.sin(math.pi * t / fade),
        )
    swing = math.sin(omega * t)
    return mean + amplitude * grown * swing, amplitude * (
        growth * swing + grown * omega * math.cos(omega * t)
    )


@compiled
def servo_rates(p, s, y, dy, t, wave, control):
    """Rates of all states at y; ``control``: kp, ki (1/s), kd (s), direction, start travel (m), lag
    (s).
    """
    kp, ki, kd, direction, start, lag = control
    q, q_speed, _ = load.coordinate(p.load, y[LOAD_PLACE], y[LOAD_SPEED])
    wanted, wanted_speed = reference(wave, t)
    error = wanted - q
    order = start + direction * (kp * error + ki * y[INTEGRAL] + kd * (wanted_speed - q_speed))
    travel_speed = (order - y[TRAVEL_SLOT]) / lag
    force0, _ = muscle_rates(p, s, y, dy, 0, y[TRAVEL_SLOT], travel_speed, q, q_speed)
    force1, _ = muscle_rates(p, s, y, dy, 1, y[TRAVEL_SLOT], travel_speed, q, q_speed)
    dy[TRAVEL_SLOT], dy[INTEGRAL], dy[LOAD_PLACE] = travel_speed, error, y[LOAD_SPEED]
    dy[LOAD_SPEED], dy[LOAD_STICTION] = load.rates(
        p.load,
        y[LOAD_PLACE],
        y[LOAD_SPEED],
        y[LOAD_STICTION],
        load.along_load(p.load, force0, force1),
    )
    return travel_speed, force0, force1


@compiled
def _settle(p, s, travel_speed):
    """Takes the finished step into strap and braid friction."""
    q, q_speed, _ = load.coordinate(p.load, s.smooth[LOAD_PLACE], s.smooth[LOAD_SPEED])
    for i in range(2):
        m = p.muscle[i]
        if m.present > 0.5:
            length, speed = lengths(p.load, i, s.smooth[TRAVEL_SLOT], travel_speed, q, q_speed)
            fitted = length - muscle.strap_stretch(m, s.strap_force_n[i])
            if m.strap_compliance_m_n != 0.0:
                _, _, _, _, s.strap_force_n[i] = pull(
                    p, s, s.smooth, i, s.smooth[TRAVEL_SLOT], travel_speed, q, q_speed
                )
            braid.settle(m, s.memory[i], fitted - s.length_m[i], speed)
            s.length_m[i] = fitted


@compiled
def _note(p, s, t, wave, travel_speed, force0, force1, row):
    """Writes one row of the trace."""
    y = s.smooth
    q, q_speed, _ = load.coordinate(p.load, y[LOAD_PLACE], y[LOAD_SPEED])
    row[TIME], row[PLACE], row[PLACE_SPEED], row[TRAVEL], row[TRAVEL_SPEED] = (
        t,
        q,
        q_speed,
        y[TRAVEL_SLOT],
        travel_speed,
    )
    row[REFERENCE], _ = reference(wave, t)
    row[FORCE0], row[FORCE1], row[LENGTH0] = force0, force1, s.length_m[0]
    for i in range(2):
        row[PRESSURE0 + i] = p.gas[i].atmosphere_pa
        if p.muscle[i].present > 0.5:
            volume, _ = muscle.shape(p.muscle[i], p.gas[i].dead_volume_m3, s.length_m[i])
            row[PRESSURE0 + i] = gas.pressure(p.gas[i], y[GAS_C + i], volume)


@compiled
def fill(params, state, no_load_pa, place, travel):
    """Puts the load to ``place``, the spool to ``travel``, and into each muscle the air that gives
    ``no_load_pa`` (2,) (absolute) at no-load length; valves shut.
    """
    p, s = params[0], state[0]
    s.smooth[LOAD_PLACE], s.smooth[TRAVEL_SLOT] = place, travel
    q, _, _ = load.coordinate(p.load, place, 0.0)
    for i in range(2):
        m, g = p.muscle[i], p.gas[i]
        free, _ = muscle.shape(m, g.dead_volume_m3, 0.0)
        s.smooth[GAS_C + i] = no_load_pa[i] * power(free, gas.exponent(g))
        s.smooth[GAS_MASS + i] = no_load_pa[i] * free / (g.gas_constant_j_kg_k * g.temperature_k)
        s.length_m[i], _ = lengths(p.load, i, travel, 0.0, q, 0.0)


@compiled
def balance(params, state, no_load_pa, place, low, high):
    """Travel (m) between ``low`` and ``high`` at which the load rests at ``place``: bisection; an
    end where there is none.
    """
    p, s = params[0], state[0]
    wave, control = (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0, 1e9)
    rate = local_zeros(SMOOTH)
    fill(params, state, no_load_pa, place, low)
    servo_rates(p, s, s.smooth, rate, 0.0, wave, control)
    sign = 1.0 if rate[LOAD_SPEED] > 0.0 else -1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        fill(params, state, no_load_pa, place, middle)
        servo_rates(p, s, s.smooth, rate, 0.0, wave, control)
        if rate[LOAD_SPEED] * sign > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@compiled
def simulate(params, state, wave, control, h, steps, keep_from, every, bound, out):
    """Runs ``steps`` of ``h`` seconds (Runge-Kutta, fourth order); rows of ``out`` (N, COLUMNS)
    from step ``keep_from`` on, every ``every`` steps. Returns rows written and the time (s) at
    which the load left its mean by ``bound`` (m), else 0.
    """
    p, s = params[0], state[0]
    y, stage, rate, total = s.smooth, local_zeros(SMOOTH), local_zeros(SMOOTH), local_zeros(SMOOTH)
    written = 0
    for k in range(steps):
        t = k * h
        travel_speed, force0, force1 = 0.0, 0.0, 0.0
        for i in range(SMOOTH):
            stage[i], total[i] = y[i], 0.0
        for part in range(4):
            at = t if part == 0 else (t + h if part == 3 else t + 0.5 * h)
            v, f0, f1 = servo_rates(p, s, stage, rate, at, wave, control)
            if part == 0:
                travel_speed, force0, force1 = v, f0, f1
            weight, reach = (1.0 if part == 0 or part == 3 else 2.0), (h if part == 2 else 0.5 * h)
            for i in range(SMOOTH):
                total[i] += weight * rate[i]
                stage[i] = y[i] + reach * rate[i]
        if k >= keep_from and (k - keep_from) % every == 0 and written < out.shape[0]:
            _note(p, s, t, wave, travel_speed, force0, force1, out[written])
            written += 1
        for i in range(SMOOTH):
            y[i] += h / 6.0 * total[i]
        _settle(p, s, total[TRAVEL_SLOT] / 6.0)
        q, _, _ = load.coordinate(p.load, y[LOAD_PLACE], y[LOAD_SPEED])
        if not abs(q - wave[0]) < bound:
            return written, t
    return written, 0.0
