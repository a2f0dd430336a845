"""Drive and motor: position, speed and current loops in continuous time, their limits, torque, heat and cogging."""

import math

import numpy as np

from epa_rt.models.blocks.friction import slider
from epa_rt.models.compiled import compiled

SPEED_MODE, TORQUE_MODE = 9.0, 10.0


@compiled
def clamp(value, low, high):
    """``value`` held inside [low, high]; NaN stays NaN."""
    return low if value < low else (high if value > high else value)


@compiled
def torque_constant(p, heat_k):
    """Torque per current at a winding ``heat_k`` above its housing."""
    return p.torque_constant_nm_a * (1.0 - p.torque_loss_per_k * heat_k)


@compiled
def current_command(p, mode, target_angle, target_slope, target_speed, target_torque, angle, speed, integral):
    """Current command before the voltage limit (A), and the rate of the speed loop's integral (A/s).

    The integral is pulled back by what the limit cut off (back-calculation with Ki/Kp), so it never winds up.
    """
    if mode == TORQUE_MODE:
        return clamp(target_torque / p.torque_constant_nm_a, -p.max_current_a, p.max_current_a), 0.0
    if mode == SPEED_MODE:
        wanted = target_speed
    else:
        wanted = p.position_gain_per_s * (target_angle - angle) + p.feedforward_ratio * target_slope
    error = clamp(wanted, -p.max_speed_rad_s, p.max_speed_rad_s) - speed
    free = p.speed_gain_a_s_rad * error + integral
    limited = clamp(free, -p.max_current_a, p.max_current_a)
    rate = p.speed_integral_a_rad * error
    if limited != free:
        rate += p.speed_integral_a_rad / p.speed_gain_a_s_rad * (limited - free)
    return limited, rate


@compiled
def current_rate(p, wanted, current, speed, heat_k):
    """Rate of the winding current (A/s): first-order lag towards what the bus voltage can still drive."""
    supply = p.supply_v - p.bus_sag_ohm * abs(current)
    back = torque_constant(p, heat_k) * speed
    reachable = clamp(wanted, (-supply - back) / p.winding_ohm, (supply - back) / p.winding_ohm)
    return (reachable - current) / p.current_lag_s


@compiled
def heat_rate(p, current, heat_k):
    """Rate of the winding's temperature above the housing (K/s)."""
    return (p.winding_thermal_k_w * p.winding_ohm * current * current - heat_k) / p.winding_time_s


@compiled
def motor_torque(p, current, angle, heat_k):
    """Electromagnetic torque with ripple and cogging (N m)."""
    torque = torque_constant(p, heat_k) * current
    if p.torque_ripple_ratio != 0.0:
        torque *= 1.0 + p.torque_ripple_ratio * math.sin(p.ripple_per_turn_ratio * angle)
    if p.cogging_nm != 0.0:
        torque += p.cogging_nm * math.sin(p.cogging_per_turn_ratio * angle)
    return torque


@compiled
def dry_limit(p, speed):
    """Dry friction limit at the shaft (N m), larger near standstill by the Stribeck effect."""
    if p.stribeck_ratio == 0.0:
        return p.coulomb_nm
    return p.coulomb_nm * (1.0 + p.stribeck_ratio * math.exp(-((speed / p.stribeck_speed_rad_s) ** 2)))


@compiled
def acceleration(p, torque, load_torque, low, high, stiction, speed):
    """Motor acceleration (rad/s^2) and rate of the stuck shaft's deflection.

    ``load_torque`` opposes positive motion; ``low`` and ``high`` are the gear's share of the friction limits.
    """
    dry = dry_limit(p, speed)
    friction, rate = slider(p.presliding_stiffness_nm_rad, p.presliding_time_s, stiction, speed, low - dry, high + dry)
    return (torque - load_torque - friction - p.viscous_nm_s_rad * speed) / p.inertia_kg_m2, rate


def drive_over_log(params, enabled, mode, target_angle_rad, target_speed_rad_s, target_torque_nm, angle_rad,
                   speed_rad_s, period_s, substeps=4):
    """Current (A) and torque (N m) at the end of each cycle from logged commands and the *measured* motor motion.

    All inputs (N,), targets as the drive sees them; angle and speed at the cycle ends, taken as straight in between.
    Returns two (N,) arrays.
    """
    out = np.zeros((2, len(angle_rad)))
    _over_log(params, np.asarray(enabled, float), np.asarray(mode, float), np.asarray(target_angle_rad, float),
              np.asarray(target_speed_rad_s, float), np.asarray(target_torque_nm, float),
              np.asarray(angle_rad, float), np.asarray(speed_rad_s, float), period_s, substeps, out)
    return out[0], out[1]


@compiled
def _over_log(params, enabled, mode, target_angle, target_speed, target_torque, angle, speed, period_s, substeps, out):
    p = params[0].drive
    h = period_s / substeps
    current, integral, heat = 0.0, 0.0, 0.0
    for k in range(angle.shape[0]):
        b = max(k - 1, 0)
        follows = k > 0 and enabled[b] > 0.5 and mode[b] == 8.0 and mode[k] == 8.0
        t0 = target_angle[b] if follows else target_angle[k]
        integral = integral_at_edge(enabled[k], mode[k], enabled[b] if k > 0 else 0.0, mode[b], integral, current)
        for j in range(substeps):
            f = (j + 0.5) / substeps
            a = angle[b] + (angle[k] - angle[b]) * f
            w = speed[b] + (speed[k] - speed[b]) * f
            slope = (target_angle[k] - t0) / period_s
            target = t0 + (target_angle[k] - t0) * f
            i1, d1, q1 = rates(p, enabled[k], mode[k], target, slope, target_speed[k], target_torque[k], a, w,
                               integral, current, heat)
            i2, d2, q2 = rates(p, enabled[k], mode[k], target, slope, target_speed[k], target_torque[k], a, w,
                               integral + h / 2 * d1, current + h / 2 * i1, heat + h / 2 * q1)
            current += h * i2
            integral += h * d2
            heat += h * q2
        out[0, k] = current
        out[1, k] = motor_torque(p, current, angle[k], heat)


@compiled
def integral_at_edge(enabled, mode, enabled_before, mode_before, integral, current):
    """The speed loop's integral at the start of a cycle: zero when off, the running current on a change of loop."""
    looped = enabled > 0.5 and mode != TORQUE_MODE
    looped_before = enabled_before > 0.5 and mode_before != TORQUE_MODE
    if not looped:
        return 0.0
    return integral if looped_before else current


@compiled
def rates(p, enabled, mode, target_angle, slope, target_speed, target_torque, angle, speed, integral, current, heat):
    """Rates of current, integral and winding heat."""
    wanted, integral_rate = 0.0, 0.0
    if enabled > 0.5:
        wanted, integral_rate = current_command(p, mode, target_angle, slope, target_speed, target_torque, angle,
                                                speed, integral)
    return current_rate(p, wanted, current, speed, heat), integral_rate, heat_rate(p, current, heat)
