"""Friction of the braid: elements with memory that know only how far the braid has moved, and
low-speed terms.

``memory`` holds one muscle's elements: slip deflections, Dahl, LuGre, Bouc-Wen, Preisach
deflections, way travelled (ports.py). Each is a function of the displacement since its last
settling, exact or nearly so for one direction.
"""

import math

from epa_rt.models.compiled import compiled
from epa_rt.models.ports import BOUC_WEN, DAHL, LUGRE, PREISACH, SLIP, TRAVELLED


@compiled
def slipped(deflection, moved, limit):
    """Deflection of a slip element after a displacement: exact return mapping."""
    deflection += moved
    return limit if deflection > limit else (-limit if deflection < -limit else deflection)


@compiled
def slip_ratio(p, memory, moved):
    """Force of the four slip elements over their sum (-1 to 1) after a further displacement
    ``moved``.
    """
    return (
        p.slip1_ratio * slipped(memory[SLIP], moved, p.slip1_m) / p.slip1_m
        + p.slip2_ratio * slipped(memory[SLIP + 1], moved, p.slip2_m) / p.slip2_m
        + p.slip3_ratio * slipped(memory[SLIP + 2], moved, p.slip3_m) / p.slip3_m
        + p.slip4_ratio * slipped(memory[SLIP + 3], moved, p.slip4_m) / p.slip4_m
    )


@compiled
def slip_settle(p, memory, moved):
    """Takes a displacement into the slip elements."""
    memory[SLIP] = slipped(memory[SLIP], moved, p.slip1_m)
    memory[SLIP + 1] = slipped(memory[SLIP + 1], moved, p.slip2_m)
    memory[SLIP + 2] = slipped(memory[SLIP + 2], moved, p.slip3_m)
    memory[SLIP + 3] = slipped(memory[SLIP + 3], moved, p.slip4_m)


@compiled
def dahl(p, ratio, moved):
    """Dahl element (-1 to 1) after a displacement in one direction: exact solution of z' = v (1 - z
    sgn v) / l.
    """
    end = 1.0 if moved > 0.0 else -1.0
    return end + (ratio - end) * math.exp(-abs(moved) / p.dahl_m)


@compiled
def lugre(p, ratio, moved, speed):
    """LuGre bristle after a displacement in one direction: exact solution of z' = v (1 - z sgn v /
    g) / l at fixed g(v).

    No micro-damping: with g > 0 the element is passive, which it is not with that term.
    """
    over = speed / p.lugre_speed_m_s
    limit = 1.0 + p.lugre_extra_ratio * math.exp(-over * over)
    end = limit if moved > 0.0 else -limit
    return end + (ratio - end) * math.exp(-abs(moved) / (p.lugre_m * limit))


@compiled
def bouc_wen_slope(p, z, toward):
    """dz per relative way of the Bouc-Wen element; ``toward`` is the direction, 1 or -1."""
    size = abs(z) ** p.bouc_wen_exponent_ratio
    beta = p.bouc_wen_unload_ratio
    return 1.0 - size * (1.0 if z * toward > 0.0 else 1.0 - 2.0 * beta)


@compiled
def bouc_wen(p, ratio, moved):
    """Bouc-Wen element (-1 to 1) after a displacement in one direction: one Runge-Kutta step of
    fourth order.
    """
    if moved == 0.0:
        return ratio
    toward = 1.0 if moved > 0.0 else -1.0
    way = moved / p.bouc_wen_m
    k1 = bouc_wen_slope(p, ratio, toward)
    k2 = bouc_wen_slope(p, ratio + 0.5 * way * k1, toward)
    k3 = bouc_wen_slope(p, ratio + 0.5 * way * k2, toward)
    k4 = bouc_wen_slope(p, ratio + way * k3, toward)
    return min(max(ratio + way / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), -1.0), 1.0)


@compiled
def preisach(p, memory, moved, length):
    """Three stops of widths 1, 1/2, 1/4 whose strength follows the place at which they stick
    (Preisach operator).

    Sticking, the place (length minus deflection) stands still, so each is a spring; the strength's
    slope is bounded so that slipping never gives energy.
    """
    total, width = 0.0, p.preisach_m
    for j in range(3):
        deflection = slipped(memory[PREISACH + j], moved, width)
        strength = 1.0 + p.preisach_slope_per_m * (length - deflection - p.slip_reference_length_m)
        total += min(max(strength, 0.25), 4.0) * deflection / width
        width *= 0.5
    return total / 3.0


@compiled
def fallen(s, tail):
    """What multiplies a speed over its peak's so that the product is 1 at 1 and falls beyond: as a
    Gaussian, or with a power's tail.
    """
    if tail == 0.0:
        return math.exp(0.5 * (1.0 - s * s))
    return math.exp(-math.log1p(0.5 * tail * (s * s - 1.0)) / tail)


@compiled
def peak(s, tail, breadth):
    """Friction at a speed over its peak's, over the peak: odd, 1 at 1. ``breadth`` stretches it
    over the logarithm of speed.
    """
    if breadth == 1.0:
        return s * fallen(s, tail)
    broad = abs(s) ** (1.0 / breadth)
    return math.copysign(broad * fallen(broad, tail), s)


@compiled
def slides_freely(p):
    """Has the braid none of these frictions? One question instead of nine."""
    return (
        (p.slip_ratio == 0.0)
        & (p.dahl_ratio == 0.0)
        & (p.stribeck_ratio == 0.0)
        & (p.run_in_ratio == 0.0)
        & (p.lugre_ratio == 0.0)
        & (p.bouc_wen_ratio == 0.0)
        & (p.preisach_ratio == 0.0)
        & (p.coulomb_ratio == 0.0)
        & (p.pressure_viscous_s_m == 0.0)
    )


@compiled
def friction_ratio(p, memory, moved, length, speed):
    """Friction of the braid over the static force that scales it, positive when it adds tension."""
    ratio = 0.0
    if slides_freely(p):
        return ratio
    if p.slip_ratio != 0.0:
        ratio += p.slip_ratio * slip_ratio(p, memory, moved)
    if p.dahl_ratio != 0.0:
        ratio += p.dahl_ratio * dahl(p, memory[DAHL], moved)
    if p.stribeck_ratio != 0.0:
        ratio += p.stribeck_ratio * peak(
            speed / p.stribeck_speed_m_s, p.stribeck_tail_ratio, p.stribeck_breadth_ratio
        )
    if p.run_in_ratio != 0.0:
        ratio += (
            p.run_in_ratio
            * math.exp(-memory[TRAVELLED] / p.run_in_m)
            * slip_ratio(p, memory, moved)
        )
    if p.lugre_ratio != 0.0:
        ratio += p.lugre_ratio * lugre(p, memory[LUGRE], moved, speed)
    if p.bouc_wen_ratio != 0.0:
        ratio += p.bouc_wen_ratio * bouc_wen(p, memory[BOUC_WEN], moved)
    if p.preisach_ratio != 0.0:
        ratio += p.preisach_ratio * preisach(p, memory, moved, length)
    if p.coulomb_ratio != 0.0:
        ratio += p.coulomb_ratio * speed / math.hypot(speed, p.coulomb_speed_m_s)
    if p.pressure_viscous_s_m != 0.0:
        ratio += p.pressure_viscous_s_m * speed
    return ratio


@compiled
def settle(p, memory, moved, speed):
    """Takes the displacement of a sub-step, at whose end the line moves with ``speed``, into all
    elements.
    """
    if slides_freely(p):
        return
    if p.slip_ratio != 0.0 or p.run_in_ratio != 0.0:
        slip_settle(p, memory, moved)
    if p.dahl_ratio != 0.0:
        memory[DAHL] = dahl(p, memory[DAHL], moved)
    if p.run_in_ratio != 0.0:
        memory[TRAVELLED] += abs(moved)
    if p.lugre_ratio != 0.0:
        memory[LUGRE] = lugre(p, memory[LUGRE], moved, speed)
    if p.bouc_wen_ratio != 0.0:
        memory[BOUC_WEN] = bouc_wen(p, memory[BOUC_WEN], moved)
    if p.preisach_ratio != 0.0:
        width = p.preisach_m
        for j in range(3):
            memory[PREISACH + j] = slipped(memory[PREISACH + j], moved, width)
            width *= 0.5
