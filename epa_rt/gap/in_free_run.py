"""Free run has its say: fed with measured inputs, a wrong law may explain all that its block shows, and still not carry the whole plant.

Every law that comes near is fitted once more from commands to readings. The one that carries the plant is named, those that do not are no
longer alike, and what block by block shows too faintly is looked for there. Chi-square here counts INDEPENDENT_HZ readings a second (as_one.py).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from epa_rt.gap.as_one import LINK, AsOne, deviations, floor, quiet, twins_of
from epa_rt.gap.point import Point, linearised, normal_of, z_of
from epa_rt.gap.problem import Problem
from epa_rt.gap.recording import Recording
from epa_rt.gap.refit import Fit, refit, searched, settled
from epa_rt.gap.role import ABSORBED, Role, gains, starts
from epa_rt.gap.screen import Screening, screen
from epa_rt.gap.select import MOST_EFFECTS, Selection

ROUNDS = 5
AS_PROMISED, TRIFLE = 0.05, 3.0   # of a step's fall, and chi-square: a fit that falls as its derivatives promised has arrived


@dataclass(frozen=True)
class Rules:
    """When free run decides; the figures are from the development cases.

    ``better``: chi-square by which a law is ahead, and ``part`` of what the best one explains: no law is the rig's own. ``near``: of the best
    law's gain block by block, from which a law is tried; ``tries``: at most as many for each effect. ``stays``: chi-square above noise and steps,
    and ``rest`` of what there is without effects, from which something is missing. ``most``: of that which a further effect must explain; ``screened``: families that are fitted for it.
    """

    better: float = 25.0
    part: float = 0.05
    near: float = 0.8
    tries: int = 4
    stays: float = 100.0
    rest: float = 0.3
    most: float = 0.5
    screened: int = 4


@dataclass(frozen=True)
class Heard:
    """``gap``, ``left``: chi-square above noise and steps in free run without effects and with those named, nominal parameters fitted
    in both. ``apart``: effects that free run tells from the named ones. ``sure``: from which ``gap`` is one."""

    gap: float
    left: float
    apart: frozenset[str]
    sure: float = Rules.stays

    @property
    def part(self) -> float | None:
        """Of the gap that the named effects explain; None where free run shows none."""
        return None if self.gap <= self.sure else 1.0 - self.left / self.gap


def heard(problem: Problem, selection: Selection, rules: Rules = Rules(),
          progress: Callable[[str, float], None] = lambda stage, share: None) -> tuple[Selection, Heard | None]:
    """The selection as free run leaves it, and what it says; None where the rig has no model of the whole that is more than one link."""
    recordings = _judged(problem)
    twins = twins_of(problem.subject, recordings, selection.base.values) if len(problem.links) > 1 else None
    if twins is None:
        return selection, None
    progress("free run", 0.0)
    deviation = deviations(recordings, twins)
    whole = problem.as_one(AsOne(problem.subject, deviation), recordings, floor())
    none = _fitted(whole, (), selection.base.values)
    noise = quiet(none, deviation, twins)
    best = _fitted(whole, selection.final.effects, selection.final.values) if selection.roles else none
    tried: dict[str, float] = {}
    for k in range(len(selection.roles)):
        progress("free run: what comes near", 0.3 + 0.1 * k)
        selection, best = _carried(problem, whole, selection, k, none, best, tried, rules)
    margin = _margin(none, best, rules)
    apart = frozenset(name for name, chi in tried.items() if chi > best.normal.chi + margin)
    progress("free run: what is left", 0.7)
    while len(selection.roles) < MOST_EFFECTS:
        further = _further(problem, whole, selection, none, best, noise, rules)
        if further is None:
            break
        selection, best = further
    return selection, Heard(_above(none, noise), _above(best, noise), apart)


def _fitted(whole: Problem, effects: tuple[str, ...], values: Mapping[str, float]) -> Point:
    """Everything free refitted. Derivatives are what costs here, so they are made anew only where the last step fell otherwise than they promised."""
    point = linearised(whole, effects, dict(values))
    for _ in range(ROUNDS):
        after = searched(whole, point)
        if after is None:
            break
        normal = point.normal
        step = z_of(whole, normal.keys, after) - normal.z
        promised, most = (normal.chi - float(normal.loss(by).sum() + normal.prior @ (normal.z + by) ** 2) for by in (step, normal.solved(np.ones(whole.blocks))))
        residual = {LINK: whole.residual(after, LINK)}
        moved = Point(effects, after, residual, point.columns, normal_of(whole, normal.keys, after, residual, point.columns))
        if abs(normal.chi - moved.normal.chi - promised) + most - promised < max(AS_PROMISED * promised, TRIFLE):
            return moved
        point = linearised(whole, effects, after)
    return point


def _judged(problem: Problem) -> Sequence[Recording]:
    """Recordings with those trials alone that the problem fits."""
    only = getattr(problem.subject, "only", None)
    return only(problem.recordings) if only else problem.recordings


def _above(point: Point, noise: float) -> float:
    return max(point.normal.chi - noise, 0.0)


def _margin(none: Point, best: Point, rules: Rules) -> float:
    return max(rules.better, rules.part * (none.normal.chi - best.normal.chi))


def _carried(problem: Problem, whole: Problem, selection: Selection, k: int, none: Point, best: Point, tried: dict[str, float],
             rules: Rules) -> tuple[Selection, Point]:
    """The k-th role with the near law in it that carries the plant best. ``tried`` gets each law's chi-square."""
    role = selection.roles[k]
    first = role.best
    for fit in _near(problem, role, rules):
        effects = tuple(fit.effect if name == first.effect else name for name in selection.final.effects)
        point = _fitted(whole, effects, fit.values)
        tried[fit.effect] = point.normal.chi
        if point.normal.chi < best.normal.chi - _margin(none, point, rules):
            tried[role.best.effect] = best.normal.chi
            role, best = _with_first(role, fit), point
    if role.best is first:
        return selection, best
    roles = tuple(role if i == k else one for i, one in enumerate(selection.roles))
    final = settled(problem, tuple(role.best.effect if name == first.effect else name for name in selection.final.effects), role.best.values)
    return replace(selection, roles=roles, final=final), best


def _near(problem: Problem, role: Role, rules: Rules) -> list[Fit]:
    """One law of every other family that gains nearly as much as the best one."""
    total = role.gains.sum(axis=1)
    families, found = {problem.effects[role.best.effect].family}, []
    for fit, gain in zip(role.fits, total, strict=True):
        family = problem.effects[fit.effect].family
        if family not in families and gain > rules.near * total[0]:
            families.add(family)
            found.append(fit)
    return found[: rules.tries]


def _with_first(role: Role, fit: Fit) -> Role:
    at = [one.effect for one in role.fits].index(fit.effect)
    order = [at, *(i for i in range(len(role.fits)) if i != at)]
    return replace(role, fits=tuple(role.fits[i] for i in order), gains=role.gains[order])


def _further(problem: Problem, whole: Problem, selection: Selection, none: Point, best: Point, noise: float,
             rules: Rules) -> tuple[Selection, Point] | None:
    """One more effect, looked for in free run, where much is missing there and it explains most of that."""
    missing = _above(best, noise)
    if missing < max(rules.stays, rules.rest * _above(none, noise)):
        return None
    fit = _promising(whole, best, rules)
    if fit is None or best.normal.chi - fit.chi < 0.5 * rules.most * missing:
        return None
    point = _afresh(whole, best, fit)
    if best.normal.chi - point.normal.chi < max(rules.stays, rules.most * missing):
        return None
    return _with_effect(problem, selection, fit.effect, point), point


def _afresh(whole: Problem, best: Point, fit: Fit) -> Point:
    """Fitted with fresh derivatives; where nominal parameters had gone far to hide the gap from the plant file's as well, and the better one."""
    effects = (*best.effects, fit.effect)
    own = {key for name in effects for key in whole.effects[name].knobs}
    points = [_fitted(whole, effects, fit.values)]
    if np.max(np.abs(best.normal.z * best.normal.prior)) > ABSORBED:
        points.append(_fitted(whole, effects, {key: value for key, value in fit.values.items() if key in own}))
    return min(points, key=lambda point: point.normal.chi)


def _promising(whole: Problem, point: Point, rules: Rules) -> Fit | None:
    """Of the families whose signatures promise most the law that fits best. All recordings: in a single one nominal parameters imitate anything."""
    screening = screen(whole, point)
    on, best = {whole.effects[name].family for name in point.effects}, screening.best()
    names: dict[str, str] = {}
    for name in sorted(best, key=lambda name: -best[name].gain):
        if whole.effects[name].family not in on:
            names.setdefault(whole.effects[name].family, name)
    chosen = list(names.values())[: rules.screened]
    fits = whole.each(lambda name: refit(whole, point, name, starts(whole, screening, name)[0], rounds=4), chosen)
    return min(fits, key=lambda fit: fit.chi, default=None)


def _with_effect(problem: Problem, selection: Selection, name: str, point: Point) -> Selection:
    """An effect with the numbers that free run gave it; block by block the nominal parameters are fitted around them."""
    before = selection.final if selection.roles else selection.base
    own = {key: point.values[key] for key in problem.effects[name].knobs}
    fit = refit(problem, before, name, own)
    role = Role(before, (fit,), np.array([gains(problem, before, fit)]), _screening(problem, selection, before), dict(problem.scale))
    around = settled(problem, before.effects, {**before.values, **own})
    return replace(selection, roles=(*selection.roles, role), final=linearised(problem, (*before.effects, name), around.values))


def _screening(problem: Problem, selection: Selection, before: Point) -> Screening:
    seen = selection.roles[0] if selection.roles else selection.refused
    return seen.screening if seen else screen(problem, before)
