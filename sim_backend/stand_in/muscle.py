"""Muscle of the stand-in. Equations: docs/plant.md (Muscle, law 0); hidden ones said here."""

import math

from sim_backend.stand_in.compiled import compiled
from sim_backend.stand_in.records import ELEMENTS


@compiled
def stretch_of_strap(h, pull):
    """Hidden: a strap that stiffens as it is pulled; its stretch never exceeds ``strap_m``."""
    return h.strap_m * (1.0 - math.exp(-pull / h.strap_n)) if h.strap_m != 0.0 else 0.0


@compiled
def body(m, h, dead, length):
    """Volume, its slope over length, and -dV/dl that carries the force, at a length between the
    fittings.
    """
    b = m.braid_length_m
    braid = length + h.end_m
    free = braid > b / math.sqrt(3.0) and braid < b
    braid = min(max(braid, b / math.sqrt(3.0)), b)
    k = 1.0 / (4.0 * math.pi * m.braid_turns_ratio**2)
    area = (3.0 * braid * braid - b * b) * k
    return (b * b - braid * braid) * braid * k + dead, (-area if free else 0.0), area


@compiled
def elements(h, slip, moved):
    """Hidden: eight slip elements, break-aways spaced by two, weights falling by 0.7: share of
    their sum, -1 to 1.
    """
    total, weights, limit, weight = 0.0, 0.0, h.slip_m, 1.0
    for k in range(ELEMENTS):
        d = min(max(slip[k] + moved, -limit), limit)
        total, weights = total + weight * d / limit, weights + weight
        limit, weight = 2.0 * limit, 0.7 * weight
    return total / weights


@compiled
def keep_elements(h, slip, moved):
    """Takes a displacement into the slip elements."""
    limit = h.slip_m
    for k in range(ELEMENTS):
        slip[k] = min(max(slip[k] + moved, -limit), limit)
        limit *= 2.0


@compiled
def bouc_rate(h, z, speed):
    """Hidden: Bouc-Wen with exponent 2, z from -1 to 1."""
    return (speed - (0.5 * abs(speed) * z * abs(z) + 0.5 * speed * z * z)) / h.bouc_m


@compiled
def lugre_rate(h, z, speed):
    """Hidden: LuGre, bristles that bend in ``lugre_m``, with a rise at low speed."""
    reach = 1.0 + h.lugre_rise_ratio * math.exp(-((speed / h.lugre_speed_m_s) ** 2))
    return (speed - abs(speed) * z / reach) / h.lugre_m


@compiled
def friction(m, h, gauge, slip, moved, bouc, bristle, speed):
    """Hidden friction of the braid (N): it scales with the static force at the reference length,
    and so with pressure.
    """
    ratio = 0.0
    if h.slip_ratio != 0.0:
        ratio += h.slip_ratio * elements(h, slip, moved)
    if h.bouc_ratio != 0.0:
        ratio += h.bouc_ratio * bouc
    if h.lugre_ratio != 0.0:
        ratio += h.lugre_ratio * bristle
    if h.coulomb_ratio != 0.0:
        ratio += h.coulomb_ratio * math.tanh(speed / h.coulomb_m_s)
    if h.lowspeed_ratio != 0.0:
        s = speed / h.lowspeed_m_s
        ratio += h.lowspeed_ratio * 4.0 * s / (1.0 + abs(s)) ** 2
    if h.bell_ratio != 0.0 and speed != 0.0:
        bell = h.bell_ratio * math.exp(
            -0.5 * (math.log(abs(speed) / h.bell_m_s) / h.bell_width) ** 2
        )
        ratio += bell if speed > 0.0 else -bell
    if ratio == 0.0:
        return 0.0
    b, ref = m.braid_length_m, m.slip_reference_length_m
    return (
        ratio
        * max(gauge, 0.0)
        * (3.0 * ref * ref - b * b)
        / (4.0 * math.pi * m.braid_turns_ratio**2)
    )


@compiled
def pull(m, h, area, gauge, length, speed, relaxed, slip, moved, bouc, bristle):
    """Tension (N, never negative). ``relaxed`` is the sum of the creep branches.

    Hidden: a threshold that fades in with pressure, walls that soften the pull at high pressure,
    damping that grows with pressure, a hardening bladder, a braid that locks exponentially.
    """
    u = length + h.end_m - m.braid_length_m / math.sqrt(3.0)
    if u <= 0.0:
        return 0.0
    acting = gauge
    if h.threshold_pa != 0.0 and gauge > 0.0:
        acting = gauge - h.threshold_pa * (1.0 - math.exp(-gauge / h.threshold_pa))
    if h.soften_per_pa != 0.0:
        acting -= h.soften_per_pa * acting * acting
    grip = min(u / m.take_up_m, 1.0)
    damping = m.viscous_n_s_m + h.wet_s_m_pa * max(gauge, 0.0)
    out = acting * area + grip * (
        damping * speed + relaxed + friction(m, h, acting, slip, moved, bouc, bristle, speed)
    )
    if h.wall_n_m != 0.0:
        out += h.wall_n_m * u * (1.0 + h.wall_rise_per_m * u)
    if h.lock_n != 0.0 and length > h.lock_m:
        out += h.lock_n * (math.exp((length - h.lock_m) / h.lock_scale_m) - 1.0)
    return max(out, 0.0)
