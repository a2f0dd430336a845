"""One of two laws tried again in free run with the other on: what was chosen first had both to explain."""

from dataclasses import replace
from typing import NamedTuple

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

FAMILIES, THOROUGH, ROUNDS = 8, 3, 4   # families that are fitted with kept derivatives in a law's place, fits of both places that are gone on with, and rounds of the former
PART = 0.25                            # of what both leave that another pair leaves at most: a right law in other words stays where a wrong one mends it a little


class _Pair(NamedTuple):
    """A fit with another law in the place of ``gone``."""

    gone: str
    point: Point

    @property
    def law(self) -> str:
        return self.point.effects[-1]


def swapped(problem: Problem, whole: Problem, selection: Selection, none: Point, best: Point, noise: float, rules: Rules) -> tuple[Selection, Point, dict[str, tuple[Fit, ...]]] | None:
    """The selection of two with another law in one's place that carries the plant far better; its fit in free run, and by the new name what explains it as well there.
    None where there is no such law, where no more is left than right ones leave, or so much that neither is right.

    A spring and a zero of a knee were a lock and the zero, 551 of 11 170 left: blocks had chosen the lock to explain both. With both on the nominal parameters are
    back where the plant file has them, and from there the spring's signature is the first: 12 left.
    """
    left, gap = above(best, noise), above(none, noise)
    if len(best.effects) != 2 or not in_other_words(gap) < left < rules.never * gap:
        return None
    tried = sorted(((name, fit) for name in best.effects for fit in _in_place_of(whole, best, name)), key=lambda one: one[1].chi)[:THOROUGH]
    worth = noise + PART * left + rules.better
    pairs = whole.each(lambda one: _Pair(one[0], fitted(whole, (*_but(best, one[0]), one[1].effect), one[1].values, worth)), tried)
    one = min(pairs, key=lambda pair: pair.point.normal.chi, default=None)
    if one is None or best.normal.chi - one.point.normal.chi < rules.gained or above(one.point, noise) > PART * left:
        return None
    kept = before = bare(selection)
    for effect in one.point.effects:
        before = kept
        kept = with_effect(problem, kept, effect, one.point)
    close = [other for other in pairs if other is not one and other.gone == one.gone
             and not rules.told(best, one.point, other.point.normal.chi, noise, plainer(problem, one.law, other.law))]
    kept = replace(kept, roles=tuple(_with_rivals(problem, role, selection, one) for role in kept.roles))
    return kept, one.point, {one.law: tuple(around(problem, before.final, other.law, other.point) for other in close)}


def _with_rivals(problem: Problem, role: Role, before: Selection, pair: _Pair) -> Role:
    """A role of a law that stays keeps those that the blocks came near to in its place, unless they were tried beside what is gone."""
    old = next((one for one in before.roles if one.best.effect == role.best.effect and pair.gone not in one.point.effects), None)
    return as_there(problem, old, role.best, pair.point) if old else role


def _but(best: Point, name: str) -> tuple[str, ...]:
    return tuple(one for one in best.effects if one != name)


def _in_place_of(whole: Problem, best: Point, name: str) -> list[Fit]:
    """The laws whose signatures promise most in a named one's place, nominal parameters where they stand with it, each fitted once to see."""
    others = _but(best, name)
    at = linearised(whole, others, whole.kept(best.values, others))
    laws = most_promising(whole, screen(whole, at, shapes=1), best.effects)[:FAMILIES]  # all shapes of all laws took a knee 50 s
    screening = screen(whole, at, laws)
    return whole.each(lambda law: refit(whole, at, law, starts(whole, screening, law)[0], ROUNDS), laws)
