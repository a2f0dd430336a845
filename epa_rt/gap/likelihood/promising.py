"""Which laws promise most in free run beside those that are on, each fitted once to see."""

from typing import NamedTuple

import numpy as np

from epa_rt.gap.likelihood.as_one import SLOW, fitted
from epa_rt.gap.likelihood.point import Point, linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import refit
from epa_rt.gap.likelihood.role import ABSORBED, starts
from epa_rt.gap.likelihood.screen import Screening, scaled, screen
from epa_rt.gap.likelihood.screen import starts as every_start
from epa_rt.models.effect import one_of_each_family

FAINT = 1e-3  # of a typical strength: where it is the derivative that counts
WEAK = 0.05  # the same, to start a fit from
BY_SLOPE = 3  # families that are tried for their derivatives besides
THOROUGH = 2  # laws that are fitted with fresh derivatives then
# squares of spreads that nominal parameters cost, from which several have gone far together
TOGETHER = 24.0
SHAPES = 2  # in which they are tried, at typical strength (the last start is the first one weaker)


class Tried(NamedTuple):
    """A law that was fitted beside those that are on. ``starts``: of typical strength, in its
    shapes; ``point`` where its fit had fresh derivatives, None where those of before were kept.
    """

    effect: str
    starts: tuple[dict[str, float], ...]
    values: dict[str, float]
    chi: float
    point: Point | None


def afresh(whole: Problem, best: Point, one: Tried, worth: float = np.inf) -> Point:
    """Fitted with fresh derivatives. Where nominal parameters had gone far to hide the gap, also
    from the plant file's with the law at typical strength in each of its shapes, and the best one:
    back along the valley between an effect and what imitates it, many a fit gets stuck. A law that
    has a shape also from its first one: kept derivatives may have carried it far off. ``worth``:
    chi-square above which none is of use. A further start is given up where it promises to leave
    hardly less than those before have.
    """
    effects = (*best.effects, one.effect)
    own = {key: best.values[key] for name in best.effects for key in whole.effects[name].knobs}
    shaped = len(whole.effects[one.effect].knobs) > len(whole.strength(one.effect))
    typical = one.starts[: None if _gone_far(best) else int(shaped)]
    found = fitted(whole, effects, one.values, worth)
    for start in typical:
        worth = min(worth, (1.0 - SLOW) * found.normal.chi)
        again = fitted(whole, effects, {**own, **start}, worth)
        found = min(found, again, key=lambda point: point.normal.chi)
    return found


def _thorough(whole: Problem, best: Point, one: Tried, worth: float) -> Tried:
    point = afresh(whole, best, one, worth)
    return one._replace(values=point.values, chi=point.normal.chi, point=point)


def _gone_far(point: Point) -> bool:
    """Whether nominal parameters have gone far, one of them or several together, to hide something:
    what that is starts from next to nothing, for they hide it in its full strength.
    """
    return (
        bool(np.max(np.abs(point.normal.z * point.normal.prior)) > ABSORBED)
        or float(point.normal.prior @ point.normal.z**2) > TOGETHER
    )


def promising(whole: Problem, point: Point, families: int, worth: float = np.inf) -> list[Tried]:
    """One law of each of the families whose signatures promise most, the best first. All
    recordings: in a single one nominal parameters imitate anything. ``worth``: chi-square above
    which a law is of no use.

    What imitates an effect is told from it by its derivatives alone, and those of a fit are kept
    from a few steps before: made fresh, they put a soft regulator of a quiet knee third that had
    been twentieth.
    """
    fresh = linearised(whole, point.effects, point.values)
    faint = screen(whole, fresh, part=FAINT, shapes=SHAPES)
    by_slope, hidden = most_promising(whole, faint, point.effects), _gone_far(point)
    if hidden:
        screenings, point = dict.fromkeys(by_slope[:families], faint), fresh
    else:
        typical = screen(whole, point, shapes=SHAPES)
        screenings = dict.fromkeys(by_slope[:BY_SLOPE], faint) | dict.fromkeys(
            most_promising(whole, typical, point.effects)[:families], typical
        )

    def begin(name: str) -> Tried:
        screening = screenings[name]
        best = screening.best()[name]
        weak = scaled(whole, name, best.start, np.sign(best.amplitude) * WEAK)
        fit = refit(
            whole, point, name, weak if hidden else starts(whole, screening, name)[0], rounds=4
        )
        shapes = tuple(
            scaled(whole, name, shape, np.sign(best.amplitude))
            for shape in every_start(whole, name)[:-1][:SHAPES]
        )
        return Tried(name, shapes, fit.values, fit.chi, None)

    tried = whole.each(begin, list(screenings))
    if hidden:
        tried = (
            whole.each(lambda one: _thorough(whole, point, one, worth), tried[:THOROUGH])
            + tried[THOROUGH:]
        )
    return sorted(tried, key=lambda one: one.chi)


def most_promising(whole: Problem, screening: Screening, on: tuple[str, ...] = ()) -> list[str]:
    """One law of each family, that whose signature promises most, the best first; none of the
    families that are ``on``.
    """
    best = screening.best()
    return one_of_each_family(
        sorted(best, key=lambda name: -best[name].gain), whole.effects, but=on
    )
