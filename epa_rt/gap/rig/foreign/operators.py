"""Operators with memory over a motion: Dahl and LuGre friction states, play. numba, one pass
each.
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
def play(motion: np.ndarray, gap: float) -> np.ndarray:
    """What follows ``motion`` through a gap, (N,), starting in its middle."""
    out = np.empty(len(motion))
    place = motion[0]
    for i in range(len(motion)):
        place = min(max(place, motion[i] - 0.5 * gap), motion[i] + 0.5 * gap)
        out[i] = place
    return out
