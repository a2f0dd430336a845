"""Intervals of numbers in which a fit is not straight: how far each may go until everything else,
refitted, no longer makes up for it (profile likelihood).

A number that shapes an effect, or one that stands near a bound, moves others with it along a bent
valley; a parabola at its bottom says little of its ends.
"""

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

from epa_rt.gap.likelihood.intervals import TWO_SIDED_95, intervals
from epa_rt.gap.likelihood.point import Normal, Point, linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import refit

# of what a number is off neutral, from which half of its straight interval is worth the search
WIDE = 0.4
CHI_95 = (
    TWO_SIDED_95**2
)  # chi-square that a number may cost at the ends of its interval, of noise that is white
OUT, BY = 5, 3.0  # steps outward, each so many times the last distance
INWARD = 6  # steps inward, each half the last distance
HALVINGS, APART = (
    6,
    2.0,
    # of what is left between, in the logarithm of the distance from the number, until one is no
    # more than so many times the other
)
CLOSER, NEAR = (
    8,
    0.02,
)  # steps of what is left then, until it is such a part of the distance from the number
STEEP = 10.0  # times the limit's root: what costs more says no more of where the limit is
ROUNDS = 8  # of each refit at most
ARRIVED = 0.05  # of what a number may cost: a round that gains less is the last


def profiled(
    problem: Problem,
    final: Point,
    effect: str,
    width: Mapping[str, float],
    astray: np.ndarray | None = None,
) -> dict[str, tuple[float, float]]:
    """Ends of the 95 % interval of those of an effect's numbers whose straight one is wide.
    ``width``: half of each straight one in spreads; ``astray``: as ``intervals`` takes it, at
    ``final``.

    Chi-square counts as much as the straight interval's own says where these blocks want the
    numbers: it may be wider than white noise would make it.
    """
    wide = [key for key in problem.effects[effect].knobs if _wide(problem, final, key, width[key])]
    if not wide:
        return {}
    own = problem.effects[effect].knobs
    others = tuple(name for name in final.effects if name != effect)
    kept = {key for name in others for key in problem.effects[name].knobs}
    before = linearised(
        problem,
        others,
        {key: value for key, value in final.values.items() if key not in own or key in kept},
    )
    found = {key: final.values.get(key, problem.knobs[key].value) for key in own}
    best = refit(problem, before, effect, found, ROUNDS)
    limit = CHI_95 * _too_narrow(
        best.normal, own, _in_order(astray, final.normal.keys, best.normal.keys)
    )
    refitted = _Held(problem, before, effect, best.chi, ARRIVED * limit / max(best.chi, limit))
    here = dict(
        zip(
            wide,
            problem.each(lambda key: refitted.at(key, found[key], best.values), wide),
            strict=True,
        )
    )

    def end(job: tuple[str, float]) -> float:
        key, sign = job
        bound = problem.knobs[key].high if sign > 0.0 else problem.knobs[key].low
        straight = found[key] + sign * min(
            width[key] * problem.spread(key), abs(bound - found[key])
        )
        if (
            here[key][0] >= limit
            # free run has put it where the blocks alone would not: they cannot say how far it may
            # go
        ):
            return straight
        return reached(refitted.along(key, here[key][1], limit), found[key], straight, bound, limit)

    jobs = [(key, sign) for key in wide for sign in (-1.0, 1.0)]
    ends = dict(zip(jobs, problem.each(end, jobs), strict=True))
    return {key: (ends[key, -1.0], ends[key, 1.0]) for key in wide}


class _Held:
    """What it costs to hold a number where it is put, everything else refitted."""

    def __init__(
        self, problem: Problem, before: Point, effect: str, best: float, enough: float
    ) -> None:
        self._problem, self._before, self._effect, self._best, self._enough = (
            problem,
            before,
            effect,
            best,
            enough,
        )

    def at(
        self, key: str, value: float, start: Mapping[str, float]
    ) -> tuple[float, dict[str, float]]:
        """Chi-square above the best, and the values that everything else takes."""
        fit = refit(
            self._problem.bounded({key: (value, value)}),
            self._before,
            self._effect,
            {**start, key: value},
            ROUNDS,
            self._enough,
        )
        return fit.chi - self._best, fit.values

    def along(self, key: str, start: Mapping[str, float], limit: float) -> Callable[[float], float]:
        """The cost by where the number is held, each refit begun where the last one below ``limit``
        ended: a bent valley is followed step by step. From beyond it none is begun: a step too far,
        across zero, had left a drift's time where no refit came back from.
        """
        last = dict(start)

        @cache
        def costs(value: float) -> float:
            cost, values = self.at(key, value, last)
            if cost < limit:
                last.update(values)
            return cost

        return costs


def reached(
    costs: Callable[[float], float], value: float, straight: float, bound: float, limit: float
) -> float:
    """Where ``costs`` reaches ``limit``, from ``value`` towards ``bound``, begun at the straight
    interval's end; ``bound`` where it never does.
    """
    if straight == value:
        return value
    if costs(straight) < limit:
        return _outward(costs, value, straight, bound, limit)
    outer = straight
    for _ in range(INWARD):
        inner = value + 0.5 * (outer - value)
        if costs(inner) < limit:
            return _between(costs, value, inner, outer, limit)
        outer = inner
    return outer


def _outward(
    costs: Callable[[float], float], value: float, inner: float, bound: float, limit: float
) -> float:
    for _ in range(OUT):
        if inner == bound:
            return bound
        outer = value + BY * (inner - value)
        outer = min(outer, bound) if bound > value else max(outer, bound)
        if costs(outer) >= limit:
            return _between(costs, value, inner, outer, limit)
        inner = outer
    return (
        bound
        if inner == bound or costs(bound) < limit
        else _between(costs, value, inner, bound, limit)
    )


def _between(
    costs: Callable[[float], float], value: float, inner: float, outer: float, limit: float
) -> float:
    """Where ``costs`` is ``limit``, between a value below and one at or above it (Brent's method on
    the roots). Far apart they are brought nearer first, in the logarithm of their distance: along a
    flat valley with a steep end nothing is straight, and two steps as if it were had ended a
    warm-up's time at 374 s where 335 cost the limit.
    """
    from scipy.optimize import brentq

    for _ in range(HALVINGS):
        if abs(outer - value) < APART * abs(inner - value):
            break
        middle = value + float(np.sign(outer - value) * np.sqrt((inner - value) * (outer - value)))
        inner, outer = (middle, outer) if costs(middle) < limit else (inner, middle)
    root = float(np.sqrt(limit))
    return float(
        brentq(
            lambda at: min(np.sqrt(max(costs(at), 0.0)), STEEP * root) - root,
            inner,
            outer,
            xtol=NEAR * abs(inner - value),
            maxiter=CLOSER,
            disp=False,
        )
    )


def _wide(problem: Problem, final: Point, key: str, width: float) -> bool:
    knob = problem.knobs[key]
    return width * problem.spread(key) > WIDE * abs(final.values.get(key, knob.value) - knob.value)


def _in_order(
    astray: np.ndarray | None, keys: tuple[str, ...], wanted: tuple[str, ...]
) -> np.ndarray | None:
    return None if astray is None else astray[:, [keys.index(key) for key in wanted]]


def _too_narrow(normal: Normal, keys: tuple[str, ...], astray: np.ndarray | None) -> float:
    """How many times more the variance of the straight intervals is than white noise would make it,
    at least once; the largest of the numbers that can move.
    """
    white = dict(
        zip(np.array(normal.keys)[normal.uncertain], np.diag(normal.covariance()), strict=True)
    )
    width = intervals(normal, keys, astray)
    return max(
        [
            1.0,
            *(
                (half / TWO_SIDED_95) ** 2 / white[key]
                for key, half in width.items()
                if key in white and np.isfinite(half)
            ),
        ]
    )
