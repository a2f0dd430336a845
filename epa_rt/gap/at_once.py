"""Two effects at once, where all that logs show is one reading: chosen one after the other, the
first stands for something of both.
"""

from collections.abc import Sequence
from itertools import combinations

from epa_rt.gap.believe import Rules, noise
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled
from epa_rt.gap.role import Role
from epa_rt.gap.screen import starts
from epa_rt.models.effect import one_of_each_family

FAMILIES = 6  # whose best law by itself is tried with another's
# of what the named ones leave above the noise is what a pair that takes their place takes off at
# least
LESS = 0.5
MUCH = Rules.gain  # chi-square that it takes off at least, as an effect does that is believed


def best_pair(problem: Problem, first: Role, roles: Sequence[Role], final: Point) -> Point | None:
    """Two laws, fitted together from typical strengths, that leave far less than those chosen one
    after the other; None where none do, or several links have their say. ``first``: the role with
    no effect on.

    A servo with dry friction and a delay of 25 ms was a dead band and a gear that winds up, 3019
    left for 175: no single one of the two could be swapped.
    """
    if len(problem.links) > 1 or len(roles) < 2:
        return None
    left = final.normal.chi - float(noise(problem).sum())
    if left < MUCH:
        return None
    tried = [
        pair
        for pair in combinations(_laws(problem, first, roles), 2)
        if set(pair) != set(final.effects)
    ]
    points = problem.each(
        lambda pair: settled(
            problem, pair, starts(problem, pair[0])[0] | starts(problem, pair[1])[0]
        ),
        tried,
    )
    best = min(points, key=lambda point: point.normal.chi, default=None)
    return (
        best
        if best is not None and final.normal.chi - best.normal.chi > max(LESS * left, MUCH)
        else None
    )


def _laws(problem: Problem, first: Role, roles: Sequence[Role]) -> list[str]:
    """The best law of each of the families that explain most by themselves, and what is named."""
    names = one_of_each_family((fit.effect for fit in first.fits), problem.effects)[:FAMILIES]
    return names + one_of_each_family(
        (role.best.effect for role in roles), problem.effects, but=names
    )
