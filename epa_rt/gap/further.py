"""One more effect, looked for in free run: what the blocks show too faintly one by one may be plain
in the whole plant.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from epa_rt.gap.bars import BARS
from epa_rt.gap.believe import negligible
from epa_rt.gap.forms import all_read_or_command
from epa_rt.gap.point import Point, linearised
from epa_rt.gap.problem import Problem
from epa_rt.gap.promising import Tried, afresh, promising
from epa_rt.gap.refit import Fit, refit, settled
from epa_rt.gap.role import Role, gains
from epa_rt.gap.rules import Rules, above, strain
from epa_rt.gap.screen import Screening, screen
from epa_rt.gap.select import Selection

GROWS = 3.0  # a shape without a unit that goes no further makes nothing of next to nothing
# of a gap: what one right law in other words mostly leaves of it where it is not many times its
# detection limit
ALONE = 0.005


def further(
    problem: Problem,
    whole: Problem,
    selection: Selection,
    none: Point,
    best: Point,
    noise: float,
    rules: Rules,
) -> tuple[Selection, Point, tuple[Fit, ...]] | None:
    """One more effect, looked for in free run, where much is missing there and it explains most of
    that; and what explains it as well.
    """
    missing = above(best, noise)
    if missing < _enough(problem, selection, none, best, noise, rules):
        return None
    faint = not selection.roles and missing < rules.first
    enough, last = (
        max(rules.helps if faint else rules.gained, rules.most * missing),
        len(selection.roles) + 1 >= rules.together,
    )
    named = (
        noise + max(rules.never * above(none, noise), rules.stays) if last else np.inf
    )  # what leaves more has no name in the end
    worth = min(
        named, best.normal.chi - enough + max(rules.better, rules.part * enough)
    )  # what leaves more than that is told from what has one
    tried = promising(whole, best, rules.screened, _nearly(selection), worth)
    if not tried or best.normal.chi - tried[0].chi < 0.5 * rules.most * missing:
        return None
    near = rules.half if faint else rules.near
    close = [
        one
        for one in tried
        if best.normal.chi - one.chi
        > (rules.rough if one.point is None else near) * (best.normal.chi - tried[0].chi)
    ]
    points = sorted(
        ((one.effect, one.point or afresh(whole, best, one, worth)) for one in close),
        key=lambda pair: pair[1].normal.chi,
    )
    name, point = points[0]
    gain = best.normal.chi - point.normal.chi
    alone = _alone(best, tried, name, gain, rules)
    only = (
        alone
        and gain > rules.better
        and _of_another_block(problem, selection, name)
        and above(point, noise) <= rules.noise
    )
    if point.normal.chi > named or (
        gain < enough and not only and not _relieves(best, point, gain, noise, rules)
    ):
        return None
    if not (faint and alone) and _unworthy(problem, selection, name, point, gain, missing, rules):
        return None
    before = selection.final if selection.roles else selection.base
    as_well = tuple(
        around(problem, before, *other)
        for other in points[1:]
        if not rules.told(best, point, other[1].normal.chi, noise, plainer(problem, name, other[0]))
    )
    return with_effect(problem, selection, name, point), point, as_well


def _of_another_block(problem: Problem, selection: Selection, name: str) -> bool:
    """Whether one effect is named and this one sits in another block: what mends another one's
    formula is mostly of the same (a weight on the shin made of a leaning frame, 47 of 4132 left,
    the knee's spring that the catalogue lacked).
    """
    return (
        len(selection.roles) == 1
        and problem.effects[name].block != problem.effects[selection.roles[0].best.effect].block
    )


def _alone(best: Point, tried: Sequence[Tried], name: str, gain: float, rules: Rules) -> bool:
    """Whether no other law that was tried does half as much as an effect."""
    return all(best.normal.chi - one.chi < rules.half * gain for one in tried if one.effect != name)


def _relieves(best: Point, point: Point, gain: float, noise: float, rules: Rules) -> bool:
    """Whether nominal parameters that nobody would believe are believable with an effect: what was
    missing is what they cost, and the rest the first law's own formula (strong slip left 92, of
    which 50 for a knee's mass and inertia; with a weight on the shin 48 and 8). Less will do where
    nothing else is left then (a knee's spring 46, of which 45 for them; with a weight on the shin 9
    and 8).
    """
    enough = rules.better if above(point, noise) <= rules.noise else rules.gained
    return gain > enough and strain(best) > BARS.strain and strain(point) < rules.half * BARS.strain


def _unworthy(
    problem: Problem,
    selection: Selection,
    name: str,
    point: Point,
    gain: float,
    missing: float,
    rules: Rules,
) -> bool:
    """Whether an effect is so weak that nobody would act on its name. Where nothing is named and a
    gap is what the whole plant shows, that is asked of no law that explains nearly all of it: a
    speed's zero of 0.03 of a typical one, where 0.06 counts, was all of 115.
    """
    if not selection.roles and missing > BARS.shows and gain > BARS.carried * missing:
        return False
    return (
        gain < rules.plain
        and _says_little(problem, name)
        and negligible(problem, name, point.values)
    )


def _says_little(problem: Problem, name: str) -> bool:
    """Whether a small number of an effect makes it small: not where a shape may grow it, as a
    lock's stiffness may harden from next to nothing.
    """
    effect = problem.effects[name]
    shapes = [problem.knobs[key] for key in effect.knobs if key not in problem.strength(name)]
    return effect.block == "sensors" or all(
        knob.unit == "1" and knob.high <= GROWS for knob in shapes
    )


def _enough(
    problem: Problem, selection: Selection, none: Point, best: Point, noise: float, rules: Rules
) -> float:
    """Chi-square from which something is missing."""
    if not selection.roles:
        return rules.faint
    if strain(best) > BARS.strain:  # by itself it is refused for that
        return rules.noise
    usual = max(rules.stays, rules.rest * above(none, noise))
    usual = min(usual, rules.anothers) if all_read_or_command(problem, selection) else usual
    return min(usual, most_of_one(above(none, noise))) if len(selection.roles) == 1 else usual


def most_of_one(gap: float, part: float = ALONE) -> float:
    """Chi-square in free run that one law leaves of a gap of so much where no second one is looked
    for (of a leak with a gauge's scale beside it the leak left 43 of 7217). ``part``: of the
    gap.
    """
    return in_other_words(gap, part) if gap < BARS.shapeless_alone else np.inf


def in_other_words(gap: float, part: float = ALONE) -> float:
    """Chi-square in free run that the right law in other words mostly leaves of a gap at most."""
    return max(BARS.little_left, part * gap)


def plainer(problem: Problem, name: str, other: str) -> bool:
    """Whether a law has no more numbers than another."""
    return len(problem.effects[name].knobs) <= len(problem.effects[other].knobs)


def _nearly(selection: Selection) -> tuple[str, ...]:
    """What the blocks came nearest to and did not believe: a joint's zero at three limits, 210
    where 240 counts.
    """
    return () if selection.roles or selection.refused is None else (selection.refused.best.effect,)


def with_effect(problem: Problem, selection: Selection, name: str, point: Point) -> Selection:
    """An effect with the numbers that free run gave it; block by block the nominal parameters are
    fitted around them, from where they stood and from free run's: without the effect they may have
    gone far to hide it.
    """
    before = selection.final if selection.roles else selection.base
    own = {key: point.values[key] for key in problem.effects[name].knobs}
    fit = around(problem, before, name, point)
    role = Role(
        before,
        (fit,),
        np.array([gains(problem, before, fit)]),
        _screening(problem, selection, before),
        dict(problem.scale),
    )
    settled_around = min(
        (
            settled(problem, before.effects, start)
            for start in ({**before.values, **own}, dict(point.values))
        ),
        key=lambda one: one.normal.chi,
    )
    return replace(
        selection,
        roles=(*selection.roles, role),
        final=linearised(problem, (*before.effects, name), settled_around.values),
    )


def bare(selection: Selection) -> Selection:
    """The same with nothing named, nor anything that was tried beside what had been."""
    return replace(selection, roles=(), final=selection.base, refused=None)


def around(problem: Problem, before: Point, name: str, point: Point) -> Fit:
    """Block by block, from the numbers that free run gave."""
    return refit(
        problem, before, name, {key: point.values[key] for key in problem.effects[name].knobs}
    )


def as_there(problem: Problem, role: Role, fit: Fit, point: Point) -> Role:
    """A role with a law first, in the numbers that free run gave it: block by block everything else
    is fitted around them.
    """
    found = around(problem, role.point, fit.effect, point)
    kept = [i for i, one in enumerate(role.fits) if one.effect != fit.effect]
    return replace(
        role,
        fits=(found, *(role.fits[i] for i in kept)),
        gains=np.concatenate([gains(problem, role.point, found)[None], role.gains[kept]]),
    )


def _screening(problem: Problem, selection: Selection, before: Point) -> Screening:
    seen = selection.roles[0] if selection.roles else selection.refused
    return seen.screening if seen else screen(problem, before)
