"""Operators with memory over a motion: Dahl and LuGre friction states, a load in a gap or on a
spring. numba, one pass each.
"""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def dahl(moved_m: np.ndarray, distance_m: float) -> np.ndarray:
    """Share of full friction, (N,), -1 to 1, after steps ``moved_m``: dz/dx = (1 - z sgn dx) /
    distance (Dahl 1968).

    Exact over each step; a distance of zero is plain Coulomb friction.
    """
    shares = np.empty(len(moved_m))
    share = 0.0
    for i in range(len(moved_m)):
        step = moved_m[i]
        if step != 0.0:
            sign = 1.0 if step > 0.0 else -1.0
            share = (
                sign
                if distance_m <= 0.0
                else sign + (share - sign) * np.exp(-abs(step) / distance_m)
            )
        shares[i] = share
    return shares


@njit(cache=True, nogil=True)
def lugre(
    speed_m_s: np.ndarray,
    period_s: float,
    distance_m: float,
    rise_ratio: float,
    speed_scale_m_s: float,
) -> np.ndarray:
    """Friction over its Coulomb level, (N,): bristles that bend ``distance_m``, break-away 1 +
    ``rise_ratio``.

    dz/dt = v - |v| z / g, g = 1 + rise exp(-(v/vs)^2), z in units of the distance (Canudas de Wit
    et al. 1995).
    """
    forces = np.empty(len(speed_m_s))
    z = 0.0
    for i in range(len(speed_m_s)):
        v = speed_m_s[i]
        level = 1.0 + rise_ratio * np.exp(-((v / speed_scale_m_s) ** 2))
        if v != 0.0:
            goal = level if v > 0.0 else -level
            z = (
                goal
                if distance_m <= 0.0
                else goal + (z - goal) * np.exp(-abs(v) * period_s / (distance_m * level))
            )
        forces[i] = z
    return forces


@njit(cache=True, nogil=True)
def carried(
    place_m: np.ndarray,
    period_s: float,
    gap_m: float,
    pull_m_s2: np.ndarray,
    dry_m_s2: np.ndarray,
    drag_per_s: float,
) -> np.ndarray:
    """Acceleration, (N,), m/s^2, that the walls of a gap about ``place_m`` give a load in it, which
    is all that keeps it moving. Over its mass: ``pull_m_s2`` (N,) of what pulls it back,
    ``dry_m_s2`` (N,) of dry friction, ``drag_per_s`` of drag.

    Between the walls the load flies or stands; it takes a wall's speed as it meets it. It begins in
    the middle, at rest.
    """
    found, half = np.zeros(len(place_m)), 0.5 * gap_m
    place, speed = place_m[0], 0.0
    for i in range(len(place_m) - 1):
        free = speed - period_s * (pull_m_s2[i] + drag_per_s * speed)
        slowed = max(abs(free) - period_s * dry_m_s2[i], 0.0)
        free = slowed if free > 0.0 else -slowed
        flown = place + period_s * free
        at = min(max(flown, place_m[i + 1] - half), place_m[i + 1] + half)
        speed = (at - place) / period_s if at != flown else free
        found[i] = (speed - free) / period_s
        place = at
    return found


@njit(cache=True, nogil=True)
def swung(
    speed_m_s: np.ndarray,
    acceleration_m_s2: np.ndarray,
    period_s: float,
    lag_s: float,
    damping_ratio: float,
    pull_m_s2: np.ndarray,
    dry_m_s2: np.ndarray,
    drag_per_s: float,
) -> np.ndarray:
    """Acceleration, (N,), m/s^2, that a spring and its damping give a load behind what moves like
    that. ``lag_s``: of one radian of its own swing while the other end is held; the rest as
    ``carried`` has it.

    Exact between rows but for friction, which takes speed off at each. It begins at rest, where the
    spring holds what pulls.
    """
    found, mean = np.empty(len(speed_m_s)), pull_m_s2[0]
    per_s = 1.0 / lag_s
    decay, swing = damping_ratio * per_s, per_s * np.sqrt(1.0 - damping_ratio**2)
    fade = np.exp(-decay * period_s)
    cosine, sine = np.cos(swing * period_s), np.sin(swing * period_s) / swing
    away, apart = -pull_m_s2[0] * lag_s**2, 0.0  # of the load from the other end, m and m/s
    for i in range(len(speed_m_s)):
        slows = pull_m_s2[i] + drag_per_s * (speed_m_s[i] + apart)
        rests = -(acceleration_m_s2[i] + slows) * lag_s**2
        off, before, held = away - rests, apart, mean
        away = rests + fade * (off * (cosine + decay * sine) + apart * sine)
        apart = fade * (apart * (cosine - decay * sine) - off * per_s**2 * sine)
        mean = (apart - before) / period_s + acceleration_m_s2[i] + slows  # over the row
        found[i] = 0.5 * (held + mean)
        loads = (speed_m_s[i + 1] if i + 1 < len(speed_m_s) else speed_m_s[i]) + apart
        slowed = max(abs(loads) - period_s * dry_m_s2[i], 0.0)
        apart += (slowed if loads > 0.0 else -slowed) - loads
    return found
