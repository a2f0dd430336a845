"""What free run alone adds to what is named, what that makes superfluous, and what takes another
one's place.
"""

from epa_rt.gap.fewer import fewer
from epa_rt.gap.further import bare, further, with_effect
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import Fit
from epa_rt.gap.rules import Rules
from epa_rt.gap.select import Selection
from epa_rt.gap.swapped import swapped


def completed(
    problem: Problem,
    whole: Problem,
    selection: Selection,
    none: Point,
    best: Point,
    noise: float,
    rules: Rules,
) -> tuple[Selection, Point, dict[str, tuple[Fit, ...]], bool]:
    """With what free run alone finds beside what is named, without what that makes superfluous, and
    another law in one's place where both leave much; by name found there what explains it as well,
    and whether what is named is another one than laws had been tried in the place of.
    """
    as_well: dict[str, tuple[Fit, ...]] = {}
    little: set[str] = set()
    while len(selection.roles) < rules.together:
        found = further(problem, whole, selection, none, best, noise, rules)
        if found is None:
            break
        if best.normal.chi - found[1].normal.chi <= rules.gained:
            little.add(found[0].roles[-1].best.effect)
        selection, best, others = found
        as_well[selection.roles[-1].best.effect] = others
    gone = False
    if as_well:  # what was found there may do without what a block had named for it
        together = len(selection.roles)
        selection, best = fewer(problem, whole, selection, best, rules, little)
        if len(selection.roles) < together and selection.roles[0].best.effect in as_well:
            selection, gone = (
                with_effect(problem, bare(selection), selection.roles[0].best.effect, best),
                True,
            )
    if other := swapped(problem, whole, selection, none, best, noise, rules):
        selection, best, others = other
        as_well, gone = as_well | others, True
    return selection, best, as_well, gone
