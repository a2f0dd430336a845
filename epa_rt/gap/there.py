"""Whether a named effect is there at all: a strength whose interval holds the plant file's (none, mostly) may as well be what the method itself makes of it.

A fall of chi-square proves that something is better with an effect; how far fits of twins go astray (astray.py) says whether so little of it
means anything. In two spent sets and the leave-one-out cases 12 of 33 wrong names stood on such a strength, and 2 of 161 right ones.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled_with
from epa_rt.gap.select import Selection
from epa_rt.gap.separate import intervals


def maybe_none(problem: Problem, selection: Selection, off: np.ndarray | None, sure: Iterable[str] = ()) -> tuple[str, ...]:
    """Named effects whose every strength has the plant file's value within its 95 % interval.

    ``off``: as ``intervals`` takes it. ``sure``: effects that something else than the blocks has found.
    """
    names = [role.best.effect for role in selection.roles if role.best.effect not in sure]
    return tuple(name for name in names if all(_may_be_none(problem, selection.final, key, off) for key in problem.strength(name)))


def without(problem: Problem, selection: Selection, names: Iterable[str]) -> Selection:
    """The selection without some of its effects, settled again."""
    gone = frozenset(names)
    kept = tuple(name for name in selection.final.effects if name not in gone)
    roles = tuple(role for role in selection.roles if role.best.effect not in gone)
    return replace(selection, roles=roles, final=settled_with(problem, kept, selection.final.values))


def _may_be_none(problem: Problem, point: Point, key: str, off: np.ndarray | None) -> bool:
    """A strength on a bound has no interval: it is none where it is the plant file's."""
    knob = problem.knobs[key]
    moved = abs(point.values.get(key, knob.value) - knob.value)
    width = intervals(point.normal, (key,), off)[key] * problem.spread(key)
    return moved == 0.0 if not np.isfinite(width) else moved <= width
