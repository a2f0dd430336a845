"""Free run has its say: fed with measured inputs, a wrong law may explain all that its block shows,
and still not carry the whole plant.

Every law that comes near is fitted once more from commands to readings. The one that carries the
plant is named, those that do not are no longer alike, and what block by block shows too faintly is
looked for there. Chi-square here counts INDEPENDENT_HZ readings a second (as_one.py).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from epa_rt.gap.as_one import fitted
from epa_rt.gap.completed import completed
from epa_rt.gap.fewer import fewer
from epa_rt.gap.forms import exact, of_one_form
from epa_rt.gap.further import as_there, in_other_words, plainer
from epa_rt.gap.ground import Ground
from epa_rt.gap.heard import Beside, Heard
from epa_rt.gap.law_ends import pressed
from epa_rt.gap.one_alone import one_alone
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import Fit, refit, settled
from epa_rt.gap.role import Role
from epa_rt.gap.rules import Rules, above, strain
from epa_rt.gap.select import Selection
from epa_rt.gap.together import serving_both
from epa_rt.models.effect import one_of_each_family


def heard(
    problem: Problem,
    selection: Selection,
    ground: Ground | None,
    rules: Rules = Rules(),
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> tuple[Selection, Heard | None]:
    """The selection as free run leaves it, and what it says; None where there is no ``ground`` to
    hear it on.
    """
    if ground is None:
        return selection, None
    whole, none, noise = ground.whole, ground.none, ground.noise
    best = (
        fitted(whole, selection.final.effects, selection.final.values) if selection.roles else none
    )
    beside: dict[str, dict[str, Beside]] = {}
    for k in range(len(selection.roles)):
        progress("free run: what comes near", 0.3 + 0.1 * k)
        selection, best = _carried(problem, whole, selection, k, none, best, beside, rules, noise)
    run = len(selection.roles)
    selection, best = fewer(problem, whole, selection, best, rules)
    alone = (
        run == len(selection.roles) == 1 and none.normal.chi - best.normal.chi > rules.gained
    )  # with two on, or one dropped since, a law was tried beside others
    tied = frozenset(
        law
        for laws in beside.values()
        for law, one in laws.items()
        if alone and one.behind < rules.tied
    )
    progress("free run: what is left", 0.7)
    selection, best, as_well, others_gone = completed(
        problem, whole, selection, none, best, noise, rules
    )
    tied = frozenset() if others_gone else tied
    said = Heard(
        above(none, noise),
        above(best, noise),
        strain(best),
        _of_named(beside, selection.final.effects),
        as_well,
        tied=tied,
        alone=len(selection.roles) == 1,
        one_form=of_one_form(problem, selection),
        exact=exact(problem, selection),
    )
    if said.asks_for_one:
        progress("free run: one law alone", 0.8)
        selection, best, said = one_alone(problem, ground, selection, rules) or (
            selection,
            best,
            said,
        )
    if selection.roles and said.carried:
        progress("free run and blocks together", 0.9)
        selection, refitted = serving_both(problem, whole, selection, none.values, best.values)
        said = replace(said, refitted=refitted, pressed=pressed(problem, whole, none, best, rules))
    return selection, replace(said, bare=none.values)


def _carried(
    problem: Problem,
    whole: Problem,
    selection: Selection,
    k: int,
    none: Point,
    best: Point,
    beside: dict[str, dict[str, Beside]],
    rules: Rules,
    noise: float,
) -> tuple[Selection, Point]:
    """The k-th role with the near law in it that carries the plant best. ``beside`` gets the
    others.
    """
    role = selection.roles[k]
    first = role.best
    left: dict[str, float] = {}

    def instead(fit: Fit, begins: Sequence[Mapping[str, float]] = ()) -> Point:
        effects = tuple(
            fit.effect if name == first.effect else name for name in selection.final.effects
        )
        return min(
            whole.each(lambda values: fitted(whole, effects, values), [fit.values, *begins]),
            key=lambda point: point.normal.chi,
        )

    def ahead(fit: Fit, point: Point) -> bool:
        return rules.told(
            none, point, best.normal.chi, noise, plainer(problem, fit.effect, role.best.effect)
        )

    for fit in _near(problem, role, rules):
        point = instead(fit)
        left[fit.effect] = point.normal.chi
        if ahead(fit, point):
            left[role.best.effect] = best.normal.chi
            role, best = _with_first(role, fit), point
    for fit in (
        (role.best, *_kin(problem, role, rules))
        if above(best, noise) > in_other_words(above(none, noise))
        else ()
    ):
        same, begins = fit is role.best, _shapes(problem, whole, role, fit)[: rules.shapes]
        if same and not begins:
            continue
        point = instead(fit, begins)
        if (
            (same and point.normal.chi < best.normal.chi)
            or ahead(fit, point)
            or rules.in_its_place(best, point, noise)
        ):
            role, best = as_there(problem, role, fit, point), point
    named = role.best.effect
    others = {
        name: chi
        for name, chi in left.items()
        if problem.effects[name].family != problem.effects[named].family
    }
    beside[named] = {
        name: Beside(
            chi - best.normal.chi, rules.told(none, best, chi, noise, plainer(problem, named, name))
        )
        for name, chi in others.items()
    }
    if role.best is first:
        return selection, best
    roles = tuple(role if i == k else one for i, one in enumerate(selection.roles))
    final = settled(
        problem,
        tuple(
            role.best.effect if name == first.effect else name for name in selection.final.effects
        ),
        role.best.values,
    )
    return replace(selection, roles=roles, final=final), best


def _of_named(
    beside: Mapping[str, Mapping[str, Beside]], named: Sequence[str]
) -> dict[str, dict[str, Beside]]:
    """What was tried in the place of those that are named still, and is not named in another
    one's.
    """
    return {
        name: {law: one for law, one in laws.items() if law not in named}
        for name, laws in beside.items()
        if name in named
    }


def _near(problem: Problem, role: Role, rules: Rules) -> list[Fit]:
    """One law of every other family that gains nearly as much as the best one."""
    total = role.gains.sum(axis=1)
    near = [fit for fit, gain in zip(role.fits, total, strict=True) if gain > rules.near * total[0]]
    first = one_of_each_family(
        (fit.effect for fit in near), problem.effects, but=(role.best.effect,)
    )
    return [fit for fit in near if fit.effect in first][: rules.tries]


def _kin(problem: Problem, role: Role, rules: Rules) -> list[Fit]:
    """Laws of the best one's own family that gain nearly as much: its thing in other words (a
    spool's play that had worn in five places left 54 as one that is the same all around).
    """
    total = role.gains.sum(axis=1)
    family = problem.effects[role.best.effect].family
    found = [
        fit
        for fit, gain in zip(role.fits, total, strict=True)
        if fit is not role.best
        and problem.effects[fit.effect].family == family
        and gain > rules.near * total[0]
    ]
    return found[: rules.kin]


def _shapes(problem: Problem, whole: Problem, role: Role, fit: Fit) -> list[dict[str, float]]:
    """A law as strong as it was fitted, from each of the shapes from which fits of it begin,
    refitted block by block: the one that leaves the blocks least, then those that leave the plant
    least. Strengths of two shapes alone, which screening chose before anything was fitted, may have
    led nowhere (worn spots at 28 limits).
    """
    effect = problem.effects[fit.effect]
    shapes = [
        dict(zip(effect.knobs, start, strict=True))
        | {key: fit.values[key] for key in problem.strength(fit.effect)}
        for start in effect.starts
    ]
    shapes = [
        shape
        for i, shape in enumerate(shapes)
        if shape not in [{key: fit.values[key] for key in effect.knobs}, *shapes[:i]]
    ]
    fits = sorted(
        problem.each(lambda shape: refit(problem, role.point, fit.effect, shape), shapes),
        key=lambda one: one.chi,
    )
    left = whole.each(
        lambda one: sum(
            float(r @ r) for r in (whole.residual(one.values, link) for link in whole.links)
        ),
        fits[1:],
    )
    return [
        one.values for one in (*fits[:1], *(fits[1 + i] for i in np.argsort(left, kind="stable")))
    ]


def _with_first(role: Role, fit: Fit) -> Role:
    at = [one.effect for one in role.fits].index(fit.effect)
    order = [at, *(i for i in range(len(role.fits)) if i != at)]
    return replace(role, fits=tuple(role.fits[i] for i in order), gains=role.gains[order])
