"""Whether nominal parameters are where a plant file may have them: what they need to be is
evidence, too.
"""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.bars import BARS, Bars
from epa_rt.gap.point import Normal, Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled


def beyond_belief(normal: Normal, spreads: float = BARS.belief) -> tuple[str, ...]:
    """Nominal parameters that were refitted to values which nobody believes, the worst first."""
    far = [
        (abs(z), key)
        for key, z, prior in zip(normal.keys, normal.z, normal.prior, strict=True)
        if prior and abs(z) > spreads
    ]
    return tuple(key for _, key in sorted(far, reverse=True))


def beyond_belief_together(normal: Normal, bars: Bars = BARS) -> tuple[str, ...]:
    """Several nominal parameters, each of which might be wrong by that much, that no plant file has
    wrong all at once; the worst first.
    """
    far = beyond_belief(normal, bars.own)
    together = sum(z**2 for key, z in zip(normal.keys, normal.z, strict=True) if key in far)
    return far if len(far) > 1 and together > bars.strain_unnamed else ()


def strained(before: Normal, after: Normal, bars: Bars = BARS) -> tuple[str, ...]:
    """Nominal parameters that effects only agree with where they are further off, together, than
    plant files are; the worst first, at most three.

    ``before``: without the effects.
    """
    own = dict(zip(before.keys, before.z, strict=True))
    far = []
    for key, z, prior in zip(after.keys, after.z, after.prior, strict=True):
        was = own.get(key, 0.0)
        if prior and not (abs(was) > bars.own and abs(z - was) < 1.0):
            far.append((abs(z), key))
    return (
        tuple(key for _, key in sorted(far, reverse=True)[:3])
        if sum(z**2 for z, _ in far) > bars.strain
        else ()
    )


def absorbed(normal: Normal, keys: Sequence[str]) -> float:
    """Chi-square by which a fit would be worse with these parameters back within belief, the others
    free; linearised.
    """
    if not keys:
        return 0.0
    free = np.flatnonzero(normal.uncertain)
    inverse = normal.covariance()
    at = [
        int(np.flatnonzero(free == normal.keys.index(key))[0])
        for key in keys
        if normal.keys.index(key) in free
    ]
    z = np.array([normal.z[free[i]] for i in at])
    return float(z @ np.linalg.solve(inverse[np.ix_(at, at)], z)) if at else 0.0


def within_belief(problem: Problem, point: Point, keys: Sequence[str], bars: Bars = BARS) -> Point:
    """The point refitted where these nominal parameters go no further from the plant file than one
    may be on its own account: what they hid shows again in the links, and in those where it is.
    """
    held = problem.bounded({key: _near(problem, key, bars.own) for key in keys})
    values = {
        key: (
            float(np.clip(value, held.knobs[key].low, held.knobs[key].high))
            if key in keys
            else value
        )
        for key, value in point.values.items()
    }
    return settled(held, point.effects, values)


def _near(problem: Problem, key: str, spreads: float) -> tuple[float, float]:
    """Bounds of a nominal parameter that goes no further than that from the plant file."""
    knob, by = problem.knobs[key], spreads * problem.spread(key)
    return max(knob.low, knob.value - by), min(knob.high, knob.value + by)
