"""One of two laws tried again in free run with the other on: what was chosen first had both to
explain.
"""

from dataclasses import replace

from epa_rt.gap.as_one import fitted
from epa_rt.gap.further import around, as_there, bare, in_other_words, plainer, with_effect
from epa_rt.gap.point import Point, linearised
from epa_rt.gap.problem import Problem
from epa_rt.gap.promising import most_promising
from epa_rt.gap.refit import Fit, refit
from epa_rt.gap.role import Role, starts
from epa_rt.gap.rules import Rules, above
from epa_rt.gap.screen import screen
from epa_rt.gap.select import Selection

FAMILIES, THOROUGH, ROUNDS = (
    8,
    3,
    4,
    # families that are fitted with kept derivatives in a law's place, fits of both places that are
    # gone on with, and rounds of the former
)
# of what both leave that another pair leaves at most: a right law in other words stays where a
# wrong one mends it a little
PART = 0.25


def swapped(
    problem: Problem,
    whole: Problem,
    selection: Selection,
    none: Point,
    best: Point,
    noise: float,
    rules: Rules,
) -> tuple[Selection, Point, dict[str, tuple[Fit, ...]]] | None:
    """The selection of two with another law in one's place that carries the plant far better; its
    fit in free run, and by the new name what explains it as well there. None where there is no such
    law, where no more is left than right ones leave, or so much that neither is right.

    A spring and a zero of a knee were a lock and the zero, 551 of 11 170 left: blocks had chosen
    the lock to explain both. With both on the nominal parameters are back where the plant file has
    them, and from there the spring's signature is the first: 12 left.
    """
    left, gap = above(best, noise), above(none, noise)
    if len(best.effects) != 2 or not in_other_words(gap) < left < rules.never * gap:
        return None
    places = [(stays, fit) for stays in best.effects for fit in _beside(whole, best, stays)]
    tried = sorted(places, key=lambda one: one[1].chi)[:THOROUGH]
    worth = noise + PART * left + rules.better
    pairs = whole.each(
        lambda one: fitted(whole, (one[0], one[1].effect), one[1].values, worth), tried
    )
    point = min(pairs, key=lambda pair: pair.normal.chi, default=best)
    if best.normal.chi - point.normal.chi < rules.gained or above(point, noise) > PART * left:
        return None
    stays, law = point.effects
    before = with_effect(problem, bare(selection), stays, point)
    kept = with_effect(problem, before, law, point)
    kept = replace(
        kept, roles=(_with_rivals(problem, kept.roles[0], selection, point), kept.roles[1])
    )
    close = [
        other
        for other in pairs
        if other is not point
        and other.effects[0] == stays
        and not rules.told(
            best, point, other.normal.chi, noise, plainer(problem, law, other.effects[1])
        )
    ]
    return (
        kept,
        point,
        {law: tuple(around(problem, before.final, other.effects[1], other) for other in close)},
    )


def _with_rivals(problem: Problem, role: Role, before: Selection, point: Point) -> Role:
    """The role of the law that stays keeps what the blocks came near to in its place, unless that
    was tried beside what is gone.
    """
    old = next(
        (
            one
            for one in before.roles
            if one.best.effect == role.best.effect and set(one.point.effects) <= set(point.effects)
        ),
        None,
    )
    return as_there(problem, old, role.best, point) if old else role


def _beside(whole: Problem, best: Point, stays: str) -> list[Fit]:
    """The laws whose signatures promise most beside one of two, in the other one's place, nominal
    parameters where they stand with both; each fitted once to see.
    """
    at = linearised(whole, (stays,), whole.kept(best.values, (stays,)))
    laws = most_promising(whole, screen(whole, at, shapes=1), best.effects)[
        :FAMILIES
    ]  # all shapes of all laws took a knee 50 s
    screening = screen(whole, at, laws)
    return whole.each(
        lambda law: refit(whole, at, law, starts(whole, screening, law)[0], ROUNDS), laws
    )
