"""Which of several effects the whole plant needs: one that only mends another one's formula in a block is none of its own."""

from collections.abc import Collection
from dataclasses import replace

from epa_rt.gap.as_one import fitted
from epa_rt.gap.further import Rules
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled_with
from epa_rt.gap.select import Selection


def fewer(problem: Problem, whole: Problem, selection: Selection, best: Point, rules: Rules, found_there: Collection[str] = ()) -> tuple[Selection, Point]:
    """The selection, and its fit in free run, without the effects whose loss the others make up for there; what is missed most comes first. ``found_there``: effects
    that were found in free run, where less was enough of one that nothing else comes near (further.py)."""
    while len(selection.roles) > 1:
        without = [_without(whole, best, role.best.effect) for role in selection.roles]
        i = min(range(len(without)), key=lambda k: without[k].normal.chi)
        enough = rules.better if selection.roles[i].best.effect in found_there else rules.gained
        if without[i].normal.chi - best.normal.chi > enough:
            missed = sorted(range(len(without)), key=lambda k: -without[k].normal.chi)
            return replace(selection, roles=tuple(selection.roles[k] for k in missed)), best
        best = without[i]
        roles = tuple(role for k, role in enumerate(selection.roles) if k != i)
        selection = replace(selection, roles=roles, final=settled_with(problem, best.effects, selection.final.values))
    return selection, best


def _without(whole: Problem, best: Point, effect: str) -> Point:
    """Fitted without one of the effects, from where all stood with it."""
    others = tuple(name for name in best.effects if name != effect)
    return fitted(whole, others, whole.kept(best.values, others))
