"""Drive: position, speed and current loops in continuous time, and their limits."""

import math

import numpy as np

from epa_rt.models.blocks import bus
from epa_rt.models.blocks.exponential import lag_weights
from epa_rt.models.blocks.motor import heat_rates, torque_constant, warmth
from epa_rt.models.compiled import compiled
from epa_rt.models.ports import RING, STATE

SPEED_MODE, TORQUE_MODE = 9.0, 10.0


@compiled
def clamp(value, low, high):
    """``value`` held inside [low, high]; NaN stays NaN."""
    return low if value < low else (high if value > high else value)


@compiled
def speed_command(p, target_angle, slope, angle):
    """Speed command of the position loop (rad/s), with the target's own slope fed forward."""
    return p.position_gain_per_s * (target_angle - angle) + p.feedforward_ratio * slope


@compiled
def current_command(p, wanted_speed, speed, integral):
    """Current command of the speed loop before the voltage limit (A), and the rate of its integral
    (A/s).

    The integral is pulled back by what the limit cut off (back-calculation with Ki/Kp), so it never
    winds up.
    """
    error = clamp(wanted_speed, -p.max_speed_rad_s, p.max_speed_rad_s) - speed
    free = p.speed_gain_a_s_rad * error + integral
    limited = clamp(free, -p.max_current_a, p.max_current_a)
    rate = p.speed_integral_a_rad * error
    if limited != free:
        rate += p.speed_integral_a_rad / p.speed_gain_a_s_rad * (limited - free)
    return limited, rate


@compiled
def current_rate(p, wanted, current, speed, warmth_k):
    """Rate of the winding current (A/s): first-order lag towards what the bus voltage can still
    drive.
    """
    supply = p.supply_v - p.bus_sag_ohm * abs(current)
    back = torque_constant(p, warmth_k) * speed
    voltage = p.winding_ohm * wanted + back
    if voltage > supply:
        wanted = (supply - back) / p.winding_ohm
    elif voltage < -supply:
        wanted = (-supply - back) / p.winding_ohm
    return (wanted - current) / p.current_lag_s


@compiled
def reported_torque(p, current):
    """Torque (N m) as the drive reports it: made from its current and the torque constant it was
    set up with, cold.

    Saturation, ripple, cogging and heat are unknown to it; what turns the shaft is
    ``motor.motor_torque``.
    """
    return p.torque_constant_nm_a * current


@compiled
def integral_at_edge(row, before, integral, current):
    """The speed loop's integral at the start of a cycle, from the commands now and before (enabled,
    mode first).

    Zero when no speed loop runs, the running current when one starts, else as it was.
    """
    if row[0] <= 0.5 or row[1] == TORQUE_MODE:
        return 0.0
    return current if before[0] <= 0.5 or before[1] == TORQUE_MODE else integral


@compiled
def rates(p, motor, part, angle, speed, integral, current, warmth_k):
    """Rates of current and integral, a ``part`` (0 to 1) into a sub-step in which ``motor`` is
    seen.

    ``motor`` as from bus.motor_seen, ``warmth_k`` as from motor.warmth.
    """
    enabled, mode, torque, target0, target1, slope0, slope1, speed0, speed1 = motor
    wanted, integral_rate = 0.0, 0.0
    if enabled > 0.5:
        if mode == TORQUE_MODE:
            wanted = clamp(torque / p.torque_constant_nm_a, -p.max_current_a, p.max_current_a)
        else:
            if mode == SPEED_MODE:
                wanted_speed = speed0 + (speed1 - speed0) * part
            else:
                wanted_speed = speed_command(
                    p,
                    target0 + (target1 - target0) * part,
                    slope0 + (slope1 - slope0) * part,
                    angle,
                )
            wanted, integral_rate = current_command(p, wanted_speed, speed, integral)
    return current_rate(p, wanted, current, speed, warmth_k), integral_rate


def drive_over_log(params, commands, angle_rad, speed_rad_s, period_s, substeps=4):
    """Current (A) and reported torque (N m) at the end of each cycle from logged commands and the
    *measured* motor motion.

    ``commands`` (N,) COMMAND, delayed as the bus block says; angle and speed (N,) at the cycle
    ends, in between the cubic through them. Returns two (N,) arrays; starts without current.
    """
    out = np.zeros((2, len(angle_rad)))
    _over_log(
        params,
        np.zeros(1, STATE),
        commands,
        np.asarray(angle_rad, float),
        np.asarray(speed_rad_s, float),
        period_s,
        substeps,
        out,
    )
    return out[0], out[1]


@compiled
def _over_log(params, state, commands, angle, speed, period_s, substeps, out):
    p, s = params[0].drive, state[0]
    delay = params[0].bus.command_delay_s / period_s
    current, integral, heat, slow_heat = 0.0, 0.0, 0.0, 0.0
    weights = lag_weights(period_s / substeps, p.current_lag_s)
    for k in range(angle.shape[0]):
        bus.latch(s, commands[k], period_s)
        seen = k + math.floor(-delay)
        integral = integral_at_edge(
            s.ring[seen % RING], s.ring[(seen - 1) % RING], integral, current
        )
        b = max(k - 1, 0)
        for j in range(substeps):
            motor = bus.motor_seen(s.ring, k, j / substeps - delay, (j + 1) / substeps - delay)
            current, integral, heat, slow_heat = _step(
                p,
                motor,
                period_s / substeps,
                weights,
                angle[b],
                angle[k],
                speed[b],
                speed[k],
                j / substeps,
                1.0 / substeps,
                current,
                integral,
                heat,
                slow_heat,
                period_s,
            )
        s.cycle += 1
        out[0, k] = current
        out[1, k] = reported_torque(p, current)


@compiled
def _step(
    p,
    motor,
    h,
    weights,
    angle0,
    angle1,
    speed0,
    speed1,
    start,
    width,
    current,
    integral,
    heat,
    slow_heat,
    period_s,
):
    """One step of current, integral and both heats along a measured motion, with the weights of the
    whole plant.
    """
    half, whole, reach, first, middle, last = weights
    lag = p.current_lag_s
    i1, z, q, r, i, z_sum, q_sum, r_sum, push1 = (
        0.0,
        integral,
        heat,
        slow_heat,
        current,
        0.0,
        0.0,
        0.0,
        0.0,
    )
    end = whole * current
    for stage in range(4):
        part = 0.5 * ((stage + 1) // 2)
        f = start + part * width
        a, w = cubic(angle0, angle1, speed0, speed1, period_s, f)
        di, dz = rates(p, motor, part, a, w, z, i, warmth(p, q, r))
        dq, dr = heat_rates(p, i, q, r)
        push = di + i / lag
        if stage == 0:
            push1 = push
            i = i1 = half * current + reach * push
        elif stage == 1:
            i = half * current + reach * push
        else:
            i = half * i1 + reach * (2.0 * push - push1)
        end += push * (first if stage == 0 else (last if stage == 3 else middle))
        weight, far = (1.0 if stage in (0, 3) else 2.0), (h if stage == 2 else 0.5 * h)
        z_sum, q_sum, r_sum = z_sum + weight * dz, q_sum + weight * dq, r_sum + weight * dr
        z, q, r = integral + far * dz, heat + far * dq, slow_heat + far * dr
    return end, integral + h / 6.0 * z_sum, heat + h / 6.0 * q_sum, slow_heat + h / 6.0 * r_sum


@compiled
def cubic(angle0, angle1, speed0, speed1, period_s, f):
    """Angle and speed, at f in [0, 1] of a cycle, of the cubic through the angles and speeds at its
    ends.

    Its speed integrates to the measured step of the angle, so that the speed loop's integral does
    not drift.
    """
    g, step = 1.0 - f, angle1 - angle0
    angle = (angle0 * (1.0 + 2.0 * f) + speed0 * period_s * f) * g * g + (
        angle1 * (1.0 + 2.0 * g) - speed1 * period_s * g
    ) * f * f
    speed = (
        6.0 * f * g * step / period_s + speed0 * g * (1.0 - 3.0 * f) + speed1 * f * (1.0 - 3.0 * g)
    )
    return angle, speed
