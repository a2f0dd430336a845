"""The load and the wiring: how lengths follow from spool and load, and how the load moves under the
muscles' pull.
"""

import math

import numpy as np

from epa_rt.models.blocks.friction import slider
from epa_rt.models.compiled import compiled

FIXED, MASS, KNEE = 0.0, 1.0, 2.0
SLIDER_STEPS = 4  # per cycle, in load_force_over_log
LEAST_INERTIA = 0.1  # of a knee's own, whatever is taken off it


@compiled
def coordinate(p, place, speed):
    """Load coordinate q (m), its speed (m/s) and dq/dplace: the place itself for a mass, r times
    angle for a knee, whose pulley may sit off the axis.
    """
    if p.kind_code != KNEE:
        return place, speed, 1.0
    if p.lever_slope_per_rad == 0.0 and p.lever_curve_per_rad2 == 0.0:
        return p.lever_m * place, p.lever_m * speed, p.lever_m
    sine, fall = math.sin(place), 1.0 - math.cos(place)
    arm = p.lever_m * (1.0 + p.lever_slope_per_rad * sine + p.lever_curve_per_rad2 * fall)
    return (
        p.lever_m
        * (place + p.lever_slope_per_rad * fall + p.lever_curve_per_rad2 * (place - sine)),
        arm * speed,
        arm,
    )


@compiled
def stop(p, place, speed, low, high):
    """End stop: pushes back only, stiffness and damping set in together so that it gives no
    energy.
    """
    if place < low:
        return max(
            p.stop_stiffness_nm_rad * (low - place)
            - p.stop_viscous_nm_s_rad * speed * _grip(low - place),
            0.0,
        )
    if place > high:
        return min(
            p.stop_stiffness_nm_rad * (high - place)
            - p.stop_viscous_nm_s_rad * speed * _grip(place - high),
            0.0,
        )
    return 0.0


@compiled
def _grip(depth):
    """Share of the end stop's damping at a depth: full from a thousandth (m or rad) on."""
    return min(depth * 1e3, 1.0)


@compiled
def _dry(p, stiffness, limit, stiction, sticking):
    """Dry friction of the load and the rate of its deflection, which is ``sticking`` unless it
    slides; both zero where there is none.
    """
    if limit == 0.0:
        return 0.0, 0.0
    return slider(stiffness, p.presliding_time_s, stiction, sticking, -limit, limit)


@compiled
def sticking_rate(p, stiction, speed):
    """Rate at which the deflection of a load that sticks grows: its speed, and of a knee whose
    bristles bend less the nearer they are to sliding what is left of it.
    """
    if p.kind_code != KNEE or p.knee_bend_ratio == 0.0 or p.knee_coulomb_nm == 0.0 or speed == 0.0:
        return speed
    bent = p.knee_stiffness_nm_rad * stiction / p.knee_coulomb_nm
    return speed * max(1.0 - p.knee_bend_ratio * (bent if speed > 0.0 else -bent), 0.0)


@compiled
def rates(p, place, speed, stiction, muscle_n):
    """Acceleration of the load and rate of its stuck deflection; ``muscle_n`` acts along q
    (dq/dplace is applied here).
    """
    if p.kind_code == MASS:
        dry, rate = _dry(p, p.guide_stiffness_n_m, p.coulomb_n, stiction, speed)
        force = (
            p.bias_n
            + muscle_n
            - p.viscous_n_s_m * speed
            - dry
            + stop(p, place, speed, p.low_m, p.high_m)
        )
        return force / max(p.mass_kg + p.payload_kg, LEAST_INERTIA * p.mass_kg), rate
    if p.kind_code == KNEE:
        _, _, arm = coordinate(p, place, speed)
        limit = p.knee_coulomb_nm
        if p.knee_friction_speed_rad_s != 0.0:
            limit *= abs(speed) / (abs(speed) + p.knee_friction_speed_rad_s)
        dry, rate = _dry(
            p, p.knee_stiffness_nm_rad, limit, stiction, sticking_rate(p, stiction, speed)
        )
        hung = p.payload_kg * p.payload_lever_ratio  # mass that pulls as much at the shank's centre
        weight = (p.mass_kg + hung) * p.gravity_m_s2 * p.mass_lever_m
        torque = (
            arm * muscle_n
            - weight * math.sin(p.hang_rad + p.misalignment_rad + place)
            - p.viscous_nm_s_rad * speed
            - dry
            + stop(p, place, speed, p.low_rad, p.high_rad)
        )
        if p.knee_spring_nm_rad != 0.0:
            torque -= p.knee_spring_nm_rad * place
        inertia = p.inertia_kg_m2 + hung * p.payload_lever_ratio * p.mass_lever_m * p.mass_lever_m
        return torque / max(inertia, LEAST_INERTIA * p.inertia_kg_m2), rate
    return 0.0, 0.0


@compiled
def along_load(p, force0, force1):
    """Force of both muscles along the load coordinate (N)."""
    return -(force0 * p.load0_ratio + force1 * p.load1_ratio)


@compiled
def along_spool(p, force0, force1):
    """Force of both muscles against positive spool travel (N)."""
    return force0 * p.travel0_ratio + force1 * p.travel1_ratio


def load_force_over_log(params, place, speed, acceleration, period_s):
    """Force along q (N) that the *measured* motion takes, (N,), from place (m or rad), speed and
    acceleration, (N,).

    The load's balance with weight, dry friction, drag and stops; starts unstuck. Zeros for a fixed
    load.
    """
    out = np.zeros(len(place))
    _force_over_log(
        params,
        np.asarray(place, float),
        np.asarray(speed, float),
        np.asarray(acceleration, float),
        period_s,
        out,
    )
    return out


@compiled
def _force_over_log(params, place, speed, acceleration, period_s, out):
    p = params[0].load
    if p.kind_code == FIXED:
        return
    h, fade = period_s / SLIDER_STEPS, math.exp(-period_s / SLIDER_STEPS / p.presliding_time_s)
    stiction = 0.0
    for k in range(place.shape[0]):
        before = speed[max(k - 1, 0)]
        for j in range(SLIDER_STEPS):
            moving = before + (speed[k] - before) * ((j + 0.5) / SLIDER_STEPS)
            _, rate = rates(p, place[k], moving, stiction, 0.0)
            if rate == sticking_rate(p, stiction, moving):
                stiction += h * rate
            else:
                end = stiction + p.presliding_time_s * rate
                stiction = end + (stiction - end) * fade
        alone, _ = rates(p, place[k], speed[k], stiction, 0.0)
        pulled, _ = rates(p, place[k], speed[k], stiction, 1.0)
        out[k] = (acceleration[k] - alone) / (pulled - alone)


def load_over_log(params, force_n, period_s, start_place=0.0, start_speed=0.0, substeps=4):
    """Place (m or rad) and speed of the load at the end of each cycle from *measured* muscle forces
    (N, 2).

    Forces at the cycle ends, straight in between. Returns two (N,) arrays; zeros for a fixed load.
    """
    force_n = np.asarray(force_n, float)
    out = np.zeros((2, len(force_n)))
    _over_log(params, force_n, period_s, start_place, start_speed, substeps, out)
    return out[0], out[1]


@compiled
def _over_log(params, force, period_s, place, speed, substeps, out):
    p = params[0].load
    h = period_s / substeps
    stiction = 0.0
    for k in range(force.shape[0]):
        b = max(k - 1, 0)
        before = along_load(p, force[b, 0], force[b, 1])
        after = along_load(p, force[k, 0], force[k, 1])
        for j in range(substeps):
            f0 = before + (after - before) * (j / substeps)
            f1 = before + (after - before) * ((j + 0.5) / substeps)
            a1, s1 = rates(p, place, speed, stiction, f0)
            v2 = speed + h / 2 * a1
            a2, s2 = rates(p, place + h / 2 * speed, v2, stiction + h / 2 * s1, f1)
            v3 = speed + h / 2 * a2
            a3, s3 = rates(p, place + h / 2 * v2, v3, stiction + h / 2 * s2, f1)
            v4 = speed + h * a3
            f2 = before + (after - before) * ((j + 1) / substeps)
            a4, s4 = rates(p, place + h * v3, v4, stiction + h * s3, f2)
            place += h / 6 * (speed + 2 * v2 + 2 * v3 + v4)
            speed += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            stiction += h / 6 * (s1 + 2 * s2 + 2 * s3 + s4)
        out[0, k] = place
        out[1, k] = speed
