"""Forward selection: one effect after the other, each judged on trials it was not fitted to,
earlier ones tried again.

In the end every role is judged with all others on as they stand then; what is not worth its knobs
any more goes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.at_once import best_pair
from epa_rt.gap.believe import LeftAt, Rules, believed, dispensable
from epa_rt.gap.diagnosis import TELLS
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled, settled_with
from epa_rt.gap.role import Role, played
from epa_rt.gap.waves import look
from epa_rt.gap.yardstick import Left

MOST_EFFECTS = 3
SLIGHT = 1e-3  # of chi-square: fits end where they fall by less than a fifth of that
RESCALE = 0.2  # change of log s^2 that is worth settling again


@dataclass(frozen=True)
class Selection:
    """``base``: no effect on. ``roles``: one for each effect found. ``final``: all found effects
    on, polished.

    ``problem``: scaled by what was left in the end. ``refused``: the role that was tried last and
    not believed.
    """

    problem: Problem
    base: Point
    roles: tuple[Role, ...]
    final: Point
    refused: Role | None


def select(
    problem: Problem,
    base: Point,
    left_at: LeftAt,
    rules: Rules = Rules(),
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> Selection:
    """Effects that explain the residual at ``base`` (nominal parameters refitted), one after the
    other.
    """
    roles: list[Role] = []
    point, first, refused = base, None, None
    for depth in range(MOST_EFFECTS):
        progress(f"effect {depth + 1}", depth / MOST_EFFECTS)
        look(problem, point)
        role = played(problem, point, pairs=depth == 0)
        first = first or role
        if role is None or not believed(problem, role, first, left_at, rules):
            refused = role
            break
        point = settled(problem, (*role.point.effects, role.best.effect), role.best.values)
        roles.append(role)
        if depth > 0:
            roles, point = _tried_again(problem, roles, point, depth)
        problem, point = rescaled(problem, point, left_at(point))
    roles = [role.at_scale_of(problem) for role in roles]
    if (pair := best_pair(problem, first, roles, point)) is not None:
        problem, point = rescaled(problem, pair, left_at(pair))
        roles, point = _tried_again(problem, [], point, len(point.effects))
    if len(roles) > 1:
        roles, point = _pruned(problem, roles, point, first, left_at, rules)
    return Selection(
        problem,
        first.point if first else base,
        tuple(roles),
        point,
        refused if roles or refused else first,
    )


def rescaled(problem: Problem, point: Point, left: Left) -> tuple[Problem, Point]:
    """Links whose s^2 has fallen count for more; the point is settled again where that changed
    anything.
    """
    before = {link: scale**2 for link, scale in problem.scale.items()}
    after = {
        link: min(before[link], left.misfit(link)) if point.effects else left.misfit(link)
        for link in problem.links
    }
    if all(abs(np.log(after[link] / before[link])) < RESCALE for link in problem.links):
        return problem, point
    problem = problem.rescaled(after)
    return problem, settled(problem, point.effects, point.values, rounds=2)


def _tried_again(
    problem: Problem, roles: list[Role], final: Point, first: int
) -> tuple[list[Role], Point]:
    """The ``first`` roles played again with the others on; a better candidate takes its place. So
    do better numbers of the same law: what the others had to make up for until then they are asked
    again (a lock that an early fit had led astray, and a bent force cell that mended it).
    """
    waiting, led_astray = list(range(first)), 0
    while waiting:
        i = waiting.pop(0)
        role = _again(problem, final, i)
        if role is None:
            continue
        roles = [*roles[:i], role, *roles[i + 1 :]]
        if role.best.effect != final.effects[i]:
            final = settled(problem, _swapped(final.effects, i, role.best.effect), role.best.values)
        elif led_astray < MOST_EFFECTS and _falls(final, role.best.chi):
            better = settled(
                problem,
                final.effects,
                role.best.values,
                # a refit takes links that its law does not touch for straight: what it promises
                # need not be there
            )
            if _falls(final, better.normal.chi):
                final, led_astray = better, led_astray + 1
                waiting += [k for k in range(len(final.effects)) if k != i and k not in waiting]
    return roles, final


def _falls(final: Point, chi: float) -> bool:
    """Whether a chi-square is lower than what stands, by more than an unfinished fit may be short
    of.
    """
    return chi < final.normal.chi - max(TELLS, SLIGHT * final.normal.chi)


def _again(problem: Problem, final: Point, i: int) -> Role | None:
    """The role of the i-th effect with the others on."""
    name, others = final.effects[i], _without(final.effects, i)
    without = settled_with(problem, others, final.values)
    return played(
        problem,
        without,
        also={
            name: {
                key: final.values[key] for key in problem.effects[name].knobs if key in final.values
            }
        },
    )


def _pruned(
    problem: Problem, roles: list[Role], final: Point, first: Role, left_at: LeftAt, rules: Rules
) -> tuple[list[Role], Point]:
    """Roles that were played before another one was swapped are played again; those not believed
    any more are dropped.
    """
    while True:
        for i in range(len(roles)):
            if set(roles[i].point.effects) != set(_without(final.effects, i)):
                roles[i] = _again(problem, final, i) or roles[i]
                if roles[i].best.effect != final.effects[i]:
                    final = settled(
                        problem,
                        _swapped(final.effects, i, roles[i].best.effect),
                        roles[i].best.values,
                    )
        drop = dispensable(problem, roles, first, left_at, rules)
        if drop is None:
            return roles, final
        roles = [role for i, role in enumerate(roles) if i != drop]
        others = _without(final.effects, drop)
        final = settled_with(problem, others, final.values)


def _without(effects: tuple[str, ...], i: int) -> tuple[str, ...]:
    return tuple(e for j, e in enumerate(effects) if j != i)


def _swapped(effects: tuple[str, ...], i: int, name: str) -> tuple[str, ...]:
    return (*effects[:i], name, *effects[i + 1 :])
