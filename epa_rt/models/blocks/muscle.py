"""One muscle: shape, pulling force by one of three laws, braid friction, damping, and what holds
the braid.
"""

import math

import numpy as np

from epa_rt.models.beside import tension_n
from epa_rt.models.blocks import braid
from epa_rt.models.blocks.laws import polynomial, tang
from epa_rt.models.blocks.power import power
from epa_rt.models.compiled import compiled
from epa_rt.models.ports import BRANCHES, MEMORY

SLOWER = 10.0  # time constant of a creep branch over that of the one before
NO_LOAD = 1.0 / math.sqrt(
    3.0
)  # no-load length over thread length: volume is largest, eq. 1 gives no force


@compiled
def shape(p, dead_volume, length):
    """Volume (m^3, eq. 2 plus dead volume) and -dV/dL (m^2, eq. 1 per gauge pressure) at a length
    between fittings.

    Shorter than no-load length the strap hangs slack and the braid keeps that length; it never
    exceeds its thread.
    """
    b = p.braid_length_m
    inner = min(max(length + p.end_length_m, b * NO_LOAD), b)
    scale = 1.0 / (4.0 * math.pi * p.braid_turns_ratio * p.braid_turns_ratio)
    return (b * b - inner * inner) * inner * scale + dead_volume, (
        3.0 * inner * inner - b * b
    ) * scale


@compiled
def friction_scale(p, gauge_pa):
    """Static force at the reference length (N), which scales braid friction; zero without
    pressure.
    """
    b = p.braid_length_m
    scale = 1.0 / (4.0 * math.pi * p.braid_turns_ratio * p.braid_turns_ratio)
    return (
        max(gauge_pa, 0.0)
        * (3.0 * p.slip_reference_length_m * p.slip_reference_length_m - b * b)
        * scale
    )


@compiled
def braid_friction(p, gauge_pa, memory, moved, length, speed):
    """Friction of the braid (N), positive when it adds tension."""
    ratio = braid.friction_ratio(p, memory, moved, length, speed)
    return ratio * friction_scale(p, gauge_pa) if ratio != 0.0 else 0.0


@compiled
def hardened(stretch, per_m, exponent=1.0):
    """Stretch (m) by which a linear spring would pull as a hardening one does: exactly ``stretch``
    at 0 per metre.
    """
    return stretch if per_m == 0.0 else stretch * power(1.0 + (per_m * stretch) ** 2, exponent)


@compiled
def strap_stretch(p, force_n):
    """Stretch of the strap (m) under a pull (N); a stiffening one never exceeds compliance over
    stiffening.
    """
    if p.strap_compliance_m_n == 0.0:
        return 0.0
    return p.strap_compliance_m_n * force_n / (1.0 + p.strap_stiffening_per_n * abs(force_n))


@compiled
def holders(p, stretch, length, speed):
    """Bladder spring past no-load length and braid past its locking length (N)."""
    force = p.bladder_stiffness_n_m * hardened(stretch, p.bladder_hardening_per_m)
    past = length - p.lock_length_m
    if past > 0.0:
        force += p.lock_stiffness_n_m * hardened(
            past, p.lock_hardening_per_m, p.lock_steepening_ratio
        ) + p.lock_viscous_n_s_m * speed * min(past / p.take_up_m, 1.0)
    return force


@compiled
def tension(p, slope, gauge_pa, length, speed, memory, moved, creep_n):
    """Pulling force (N, never negative) at gauge pressure, length and speed of lengthening.

    ``slope`` is -dV/dL from ``shape``; ``memory`` the braid's elements, ``moved`` the displacement
    since they were settled.
    """
    stretch = length + p.end_length_m - p.braid_length_m * NO_LOAD
    if stretch <= 0.0:
        return 0.0
    effective_pa = gauge_pa - p.threshold_pa
    if p.threshold_pa != 0.0 and gauge_pa > 0.0:
        effective_pa = max(effective_pa, 0.0)
    if p.softening_per_pa != 0.0:
        effective_pa /= 1.0 + p.softening_per_pa * max(effective_pa, 0.0)
    if p.law_code == 0.0:
        force = effective_pa * slope
    elif p.law_code == 1.0:
        force = tang(p, effective_pa, stretch, speed)
    else:
        force = polynomial(p, effective_pa, stretch, speed)
    take_up = 1.0 if stretch >= p.take_up_m else stretch / p.take_up_m
    force += take_up * (
        p.viscous_n_s_m * speed
        + creep_n
        + braid_friction(p, effective_pa, memory, moved, length, speed)
    )
    force += tension_n(p, gauge_pa, stretch, speed)
    return max(force + holders(p, stretch, length, speed), 0.0)


@compiled
def creep_branch(p, branch):
    """Spring (N/m) and time constant (s) of a creep branch: springs fall (or rise) by the same
    ratio from decade to decade, a power law's relaxation.
    """
    return p.creep_stiffness_n_m * p.creep_slow_ratio**branch, p.creep_time_s * SLOWER**branch


@compiled
def creep_force(branches, first, apart):
    """Force of all creep branches (N): the sum over ``branches`` from index ``first`` on, ``apart``
    entries from one to the next.
    """
    force = branches[first]
    for j in range(1, BRANCHES):
        force += branches[first + apart * j]
    return force


@compiled
def creep_rate(stiffness_n_m, time_s, creep_n, speed):
    """Rate of a creep branch (N/s): spring and damper in series, beside the muscle."""
    return 0.0 if stiffness_n_m == 0.0 else stiffness_n_m * speed - creep_n / time_s


def muscle_over_log(params, gauge_pa, length_m, speed_m_s, muscle=0, period_s=1e-3):
    """Pulling force (N) of one muscle, (N,), from *measured* gauge pressure, length and speed of
    lengthening, (N,).
    """
    out = np.zeros(len(length_m))
    _over_log(
        params,
        muscle,
        np.asarray(gauge_pa, float),
        np.asarray(length_m, float),
        np.asarray(speed_m_s, float),
        period_s,
        np.zeros(MEMORY),
        out,
    )
    return out


@compiled
def _over_log(params, muscle, gauge, length, speed, period_s, memory, out):
    p = params[0].muscle[muscle]
    creep, strap = np.zeros(BRANCHES), 0.0
    fitted_before = length[0]
    for k in range(length.shape[0]):
        fitted = length[k] - strap_stretch(p, strap)
        moved = fitted - fitted_before
        braid.settle(p, memory, moved, speed[k])
        for j in range(BRANCHES):
            stiffness, time_s = creep_branch(p, j)
            creep[j] += period_s * creep_rate(stiffness, time_s, creep[j], speed[k])
        _, slope = shape(p, 0.0, fitted)
        out[k] = tension(
            p, slope, gauge[k], fitted, speed[k], memory, 0.0, creep_force(creep, 0, 1)
        )
        strap = out[k]
        fitted_before = fitted
