"""Which of several effects the whole plant needs: one that only mends another one's formula in a
block is none of its own.
"""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from epa_rt.gap.as_one import fitted
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled_with
from epa_rt.gap.rules import Rules
from epa_rt.gap.select import Selection


def fewer(
    problem: Problem,
    whole: Problem,
    selection: Selection,
    best: Point,
    rules: Rules,
    little: Collection[str] = (),
) -> tuple[Selection, Point]:
    """The selection, and its fit in free run, without the effects whose loss the others make up for
    there; what is missed most comes first. ``little``: effects of which less was enough when they
    were found, since nothing else comes near them (further.py).
    """
    while len(selection.roles) > 1:
        without = [_without(whole, best, role.best.effect) for role in selection.roles]
        over = [
            one.normal.chi
            - best.normal.chi
            - (rules.better if role.best.effect in little else rules.gained)
            for one, role in zip(without, selection.roles, strict=True)
        ]
        i = int(np.argmin(over))
        if over[i] > 0.0:
            missed = sorted(range(len(without)), key=lambda k: -without[k].normal.chi)
            return replace(selection, roles=tuple(selection.roles[k] for k in missed)), best
        best = without[i]
        roles = tuple(role for k, role in enumerate(selection.roles) if k != i)
        selection = replace(
            selection,
            roles=roles,
            final=settled_with(problem, best.effects, selection.final.values),
        )
    return selection, best


def _without(whole: Problem, best: Point, effect: str) -> Point:
    """Fitted without one of the effects, from where all stood with it."""
    others = tuple(name for name in best.effects if name != effect)
    return fitted(whole, others, whole.kept(best.values, others))
