"""Motor: torque of a current, heat, cogging and ripple, friction, and how the shaft moves."""

import math

import numpy as np

from epa_rt.models.blocks.friction import slider
from epa_rt.models.blocks.transmission import friction_limits, sliding_torque, travel_per_angle
from epa_rt.models.blocks.wave import wave
from epa_rt.models.compiled import compiled

SLIDER_STEPS = 4  # per cycle, in motor_over_log
# of the cold torque constant: at the bounds the straight line would fall through zero and turn the
# motor round
LEAST_CONSTANT = 0.1


@compiled
def warmth(p, heat_k, slow_heat_k):
    """Kelvins that weaken the torque: the winding's above the housing, and of the slow node as many
    as count.
    """
    return heat_k + p.housing_heat_ratio * slow_heat_k


@compiled
def torque_constant(p, warmth_k):
    """Torque per current (N m/A), and voltage per speed, at a warmth (K) as ``warmth`` gives it."""
    return p.torque_constant_nm_a * max(1.0 - p.torque_loss_per_k * warmth_k, LEAST_CONSTANT)


@compiled
def heat_rates(p, current, heat_k, slow_heat_k):
    """Rates (K/s) of the winding's temperature above the housing and of the slow node's, housing
    and magnets, in kelvins of the winding: both end where the copper's loss (W) times the winding's
    thermal resistance has them.
    """
    end = p.winding_thermal_k_w * p.winding_ohm * current * current
    return (end - heat_k) / p.winding_time_s, (end - slow_heat_k) / p.housing_time_s


@compiled
def ripple(p, angle):
    """Torque constant at an angle over its mean."""
    if p.torque_ripple_ratio == 0.0:
        return 1.0
    turn = p.ripple_per_turn_ratio * angle + p.ripple_phase_rad
    return 1.0 + p.torque_ripple_ratio * wave(
        turn, p.ripple_twice_sine_ratio, p.ripple_twice_cosine_ratio
    )


@compiled
def cogging(p, angle):
    """Cogging torque (N m)."""
    if p.cogging_nm == 0.0:
        return 0.0
    turn = p.cogging_per_turn_ratio * angle + p.cogging_phase_rad
    return p.cogging_nm * wave(turn, p.cogging_twice_sine_ratio, p.cogging_twice_cosine_ratio)


@compiled
def motor_torque(p, current, angle, warmth_k):
    """Torque on the shaft (N m) with saturation, ripple and cogging; the drive reports another:
    ``drive.reported_torque``.
    """
    torque = torque_constant(p, warmth_k) * current
    if p.torque_saturation_per_a != 0.0:
        torque /= 1.0 + p.torque_saturation_per_a * abs(current)
    if p.torque_ripple_ratio != 0.0:
        torque *= ripple(p, angle)
    if p.cogging_nm != 0.0:
        torque += cogging(p, angle)
    return torque


@compiled
def current_for(p, torque, angle, warmth_k):
    """Current (A) that gives a torque: the inverse of ``motor_torque``."""
    current = (torque - cogging(p, angle)) / (torque_constant(p, warmth_k) * ripple(p, angle))
    if p.torque_saturation_per_a != 0.0:
        current /= max(1.0 - p.torque_saturation_per_a * abs(current), 0.1)
    return current


@compiled
def dry_limit(p, speed, angle):
    """Dry friction limit at the shaft (N m): larger near standstill by the Stribeck effect, and
    over the angle.
    """
    limit = p.coulomb_nm
    if p.stribeck_ratio != 0.0:
        limit = p.coulomb_nm * (
            1.0
            + p.stribeck_ratio
            * math.exp(-(abs(speed / p.stribeck_speed_rad_s) ** p.stribeck_exponent_ratio))
        )
    if p.friction_wave_ratio != 0.0:
        limit *= 1.0 + p.friction_wave_ratio * math.sin(
            p.friction_wave_per_turn_ratio * angle + p.friction_wave_phase_rad
        )
    return limit


@compiled
def drag(p, speed):
    """Viscous drag at the shaft (N m), not the same in both directions."""
    if p.viscous_asymmetry_ratio == 0.0:
        return p.viscous_nm_s_rad * speed
    return (
        p.viscous_nm_s_rad
        * speed
        * (1.0 + (p.viscous_asymmetry_ratio if speed > 0.0 else -p.viscous_asymmetry_ratio))
    )


@compiled
def acceleration(p, torque, load_torque, low, high, stiction, speed, angle):
    """Motor acceleration (rad/s^2) and rate of the stuck shaft's deflection.

    ``load_torque`` opposes positive motion; ``low`` and ``high`` are the gear's share of the
    friction limits.
    """
    dry = dry_limit(p, speed, angle)
    friction, rate = slider(
        p.presliding_stiffness_nm_rad, p.presliding_time_s, stiction, speed, low - dry, high + dry
    )
    return (torque - load_torque - friction - drag(p, speed)) / p.inertia_kg_m2, rate


def motor_over_log(params, angle_rad, speed_rad_s, acceleration_rad_s2, spool_force_n, period_s):
    """Current (A) that the *measured* motion takes against the *measured* force at the spool, (N,).

    All inputs (N,), at the cycle ends, straight in between. The torque balance of the shaft with
    its friction, gear, ripple, cogging and heat; starts cold and unstuck.
    """
    out = np.zeros(len(angle_rad))
    _over_log(
        params,
        np.asarray(angle_rad, float),
        np.asarray(speed_rad_s, float),
        np.asarray(acceleration_rad_s2, float),
        np.asarray(spool_force_n, float),
        period_s,
        out,
    )
    return out


@compiled
def _over_log(params, angle, speed, accelerated, force, period_s, out):
    p, t = params[0].drive, params[0].transmission
    h = period_s / SLIDER_STEPS
    fade = math.exp(-h / p.presliding_time_s)
    stiction, heat, slow_heat, current = 0.0, 0.0, 0.0, 0.0
    for k in range(angle.shape[0]):
        load_torque = force[k] * travel_per_angle(t, angle[k])
        low, high = friction_limits(t, load_torque, speed[k])
        dry = dry_limit(p, speed[k], angle[k])
        before = speed[max(k - 1, 0)]
        for j in range(SLIDER_STEPS):
            moving = before + (speed[k] - before) * ((j + 0.5) / SLIDER_STEPS)
            friction, rate = slider(
                p.presliding_stiffness_nm_rad,
                p.presliding_time_s,
                stiction,
                moving,
                low - dry,
                high + dry,
            )
            if rate == moving:
                stiction += h * moving
            else:
                end = friction / p.presliding_stiffness_nm_rad
                stiction = end + (stiction - end) * fade
        friction, _ = slider(
            p.presliding_stiffness_nm_rad,
            p.presliding_time_s,
            stiction,
            speed[k],
            low - dry,
            high + dry,
        )
        torque = (
            p.inertia_kg_m2 * accelerated[k]
            + load_torque
            + friction
            + drag(p, speed[k])
            + sliding_torque(t, p.inertia_kg_m2, load_torque, speed[k])
        )
        heat_rate, slow_rate = heat_rates(p, current, heat, slow_heat)
        heat += period_s * heat_rate
        slow_heat += period_s * slow_rate
        current = current_for(p, torque, angle[k], warmth(p, heat, slow_heat))
        out[k] = current
