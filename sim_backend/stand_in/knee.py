"""Load of the stand-in: held, mass, or knee. Equations: docs/plant.md (Wiring and load); hidden
ones said here.
"""

import math

from sim_backend.stand_in.compiled import compiled


@compiled
def coordinate(w, h, place, rate):
    """Load coordinate, its speed and its slope over the place; hidden: a moment arm with slope and
    curvature.
    """
    if w.kind_code != 2.0:
        return place, rate, 1.0
    s, c = h.arm_slope_per_rad, h.arm_slope_per_rad * h.arm_curve_per_rad
    arm = w.lever_m * (1.0 + s * place + c * place * place)
    return w.lever_m * place * (1.0 + s * place / 2.0 + c * place * place / 3.0), arm * rate, arm


@compiled
def end_stop(w, place, rate, low, high):
    """What the end stops push (N or N m)."""
    if place < low:
        deep = low - place
        return max(
            w.stop_stiffness_nm_rad * deep
            - w.stop_viscous_nm_s_rad * rate * min(1000.0 * deep, 1.0),
            0.0,
        )
    if place > high:
        deep = place - high
        return -max(
            w.stop_stiffness_nm_rad * deep
            + w.stop_viscous_nm_s_rad * rate * min(1000.0 * deep, 1.0),
            0.0,
        )
    return 0.0


@compiled
def acceleration(w, h, place, rate, bristle, force):
    """Acceleration of the load under ``force`` along its coordinate, and the rate of the hidden
    bristles.

    Hidden: dry friction as tanh or as bristles, a payload off the shank's centre, a tilted frame, a
    passive spring, air drag.
    """
    if w.kind_code == 1.0:
        total = (
            w.bias_n + force - w.viscous_n_s_m * rate + end_stop(w, place, rate, w.low_m, w.high_m)
        )
        return total / w.mass_kg, 0.0
    if w.kind_code != 2.0:
        return 0.0, 0.0
    _, _, arm = coordinate(w, h, place, rate)
    weight = w.mass_kg * w.mass_lever_m + h.payload_kg * h.payload_lever_m
    moment = w.inertia_kg_m2 + h.payload_kg * h.payload_lever_m**2
    total = (
        arm * force
        - weight * w.gravity_m_s2 * math.sin(w.hang_rad + h.tilt_rad + place)
        - w.viscous_nm_s_rad * rate
        + end_stop(w, place, rate, w.low_rad, w.high_rad)
        - h.knee_spring_nm_rad * place
        - h.knee_air_nm_s2 * rate * abs(rate)
    )
    bending = 0.0
    if h.knee_dry_nm != 0.0:
        total -= h.knee_dry_nm * math.tanh(rate / h.knee_dry_rad_s)
    if h.knee_bristle_nm != 0.0:
        held = (
            bristle
            if h.knee_bristle_power == 1.0
            else math.copysign(abs(bristle) ** h.knee_bristle_power, bristle)
        )
        bending = (rate - abs(rate) * held) / h.knee_bristle_rad
        total -= h.knee_bristle_nm * bristle
    return total / moment, bending
