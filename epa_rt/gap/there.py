"""Whether a named effect is there at all: a strength whose interval holds the plant file's (none,
mostly) may as well be what the method itself makes of it.

A fall of chi-square proves that something is better with an effect; how far fits of twins go astray
(astray.py) says whether so little of it means anything. In two spent sets and the leave-one-out
cases 12 of 33 wrong names stood on such a strength, and 2 of 161 right ones.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from epa_rt.gap.point import Normal, Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled_with
from epa_rt.gap.select import Selection
from epa_rt.gap.separate import intervals

THERE = 5.0  # half widths of a strength's interval, its shape held


def maybe_none(
    problem: Problem, selection: Selection, off: np.ndarray | None, sure: Iterable[str] = ()
) -> tuple[str, ...]:
    """Named effects whose every strength has the plant file's value within its 95 % interval.

    ``off``: as ``intervals`` takes it. ``sure``: effects that something else than the blocks has
    found.
    """
    names = [role.best.effect for role in selection.roles if role.best.effect not in sure]
    return tuple(
        name
        for name in names
        if all(
            _may_be_none(problem, selection.final, name, key, off) for key in problem.strength(name)
        )
    )


def without(problem: Problem, selection: Selection, names: Iterable[str]) -> Selection:
    """The selection without some of its effects, settled again."""
    gone = frozenset(names)
    kept = tuple(name for name in selection.final.effects if name not in gone)
    roles = tuple(role for role in selection.roles if role.best.effect not in gone)
    return replace(
        selection, roles=roles, final=settled_with(problem, kept, selection.final.values)
    )


def _may_be_none(
    problem: Problem, point: Point, effect: str, key: str, off: np.ndarray | None
) -> bool:
    """A strength on a bound has no interval: it is none where it is the plant file's. Beside a
    shape the interval says how far strength and shape may go together, not whether there is any of
    it: a lock's stiffness of 38 +- 87 N/m left 14 of a gap of 1719, and its hardening took over
    where it was less. Such a one is there where it is ``THERE`` times as far from none as it could
    be with the shape held.
    """
    knob = problem.knobs[key]
    moved = abs(point.values.get(key, knob.value) - knob.value)
    width = intervals(point.normal, (key,), off)[key] * problem.spread(key)
    if not np.isfinite(width):
        return moved == 0.0
    shape = [k for k in problem.effects[effect].knobs if k not in problem.strength(effect)]
    held, off = _held(point.normal, shape, off)
    return moved <= min(width, THERE * intervals(held, (key,), off)[key] * problem.spread(key))


def _held(
    normal: Normal, keys: Iterable[str], off: np.ndarray | None
) -> tuple[Normal, np.ndarray | None]:
    """Normal equations with some keys held where they are, and how far the twins' fits would have
    gone with them held.
    """
    held = replace(normal, frozen=normal.frozen | np.isin(normal.keys, list(keys)))
    if off is None:
        return held, None
    before, after = normal.uncertain, held.uncertain
    matrix = normal.matrix.sum(axis=(0, 1)) + np.diag(normal.prior)
    found = np.zeros_like(off)
    found[:, after] = off[:, before] @ matrix[np.ix_(before, after)] @ held.covariance()
    return held, found
