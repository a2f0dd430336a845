"""One law where what is named, or nothing, does not carry the plant: found in free run, from the
plant file on.
"""

from dataclasses import replace

from epa_rt.gap.forms import exact, of_one_form
from epa_rt.gap.further import around, bare, plainer, with_effect
from epa_rt.gap.ground import Ground
from epa_rt.gap.heard import USUAL, Heard
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.rules import Rules, above, strain
from epa_rt.gap.select import Selection


def one_alone(
    problem: Problem, ground: Ground, selection: Selection, rules: Rules
) -> tuple[Selection, Point, Heard] | None:
    """Instead of names that do not carry the plant, one law of the catalogue that takes it down to
    the noise by itself, its fit in free run and what that says; None where none does.

    Blocks that share nominal parameters with what feeds them may need two laws for one: a joint's
    zero was a lock and a spring of the knee. Or no block shows it, and nominal parameters hide two
    thirds of it in free run, where another law is nearer (a joint's scale that left 51 of 109, the
    zero from the plant file on 21).
    """
    none, noise, points = ground.none, ground.noise, ground.one_by_one
    if not points:
        return None
    best = min(points, key=lambda point: point.normal.chi)
    said = Heard(above(none, noise), above(best, noise), strain(best), {}, {}, alone=True)
    if not (said.shows and said.left <= USUAL):
        return None
    without, name = bare(selection), best.effects[0]
    close = [
        one
        for one in points
        if one is not best
        and not rules.told(
            none, best, one.normal.chi, noise, plainer(problem, name, one.effects[0])
        )
    ]
    as_well = {name: tuple(around(problem, without.base, one.effects[0], one) for one in close)}
    found = with_effect(problem, without, name, best)
    if [role.best.effect for role in selection.roles] == [
        name
    ]:  # better numbers for the same name: what blocks hold alike stays so
        found = replace(found, roles=selection.roles)
    return (
        found,
        best,
        replace(
            said, as_well=as_well, one_form=of_one_form(problem, found), exact=exact(problem, found)
        ),
    )
