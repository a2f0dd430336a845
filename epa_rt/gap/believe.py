"""Whether an effect is believed: beyond chance, beyond the method's own misfit, and not as a mender
of another one's formula.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.bars import BARS
from epa_rt.gap.plausible import beyond_belief
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.role import Role, z_of_sum
from epa_rt.gap.subject import Values
from epa_rt.gap.yardstick import Left

LeftAt = Callable[[Point], Left]


@dataclass(frozen=True)
class Rules:
    """When an effect is believed; the figures are from the development cases.

    ``gain``: fall of chi-square on trials left out (residuals in units of s). ``z``: of that fall
    over blocks; an effect that shows at a few valve strokes has no large one. ``share``: least part
    of what is left to explain. ``size``: least strength, as a part of the typical one; below it
    nobody would act on the name, unless it gains ``plain`` and is most of what there is: a twelfth
    of a millisecond of encoder age was 323 332 in a drive's current, and hid what else the knee
    had. Further effects also mend what another formula of the first ones left, so they need more:
    ``z_more``, ``share_more``, and half of what they gain must lie in links where it is more than
    ``mends`` of what the others explain there: another formula of the same physics leaves a tenth
    of the chi-square it explains, an effect of its own leaves more or shows elsewhere. What mends a
    formula looks like it: where no signature's cosine with the others' is above ``resembles``,
    ``mends_unlike`` will do. What gains ``nearly_all`` where the others explain less than
    ``untouched`` of that is judged like a first one. And it mends only some of it: an effect that
    closes ``closes`` of all that lies above the noise in its links needs ``trifling``. ``jolt``:
    median gains of a block that one block may count for.
    """

    gain: float = 240.0
    z: float = 2.0
    z_much: float = 1.2
    much: float = 0.6
    share: float = 0.10
    size: float = 0.004
    size_reading: float = 0.06
    z_more: float = 2.5
    share_more: float = 0.20
    mends: float = 0.15
    resembles: float = 0.1
    mends_unlike: float = 0.05
    untouched: float = 0.1
    nearly_all: float = 0.9
    plain: float = 1e4
    closes: float = 0.5
    trifling: float = 0.02
    jolt: float = 5.0


def believed(problem: Problem, role: Role, first: Role, left_at: LeftAt, rules: Rules) -> bool:
    """Whether the best candidate of a role is more than chance, misfit or mending. ``first``: the
    role with no effect on, at any scale.
    """
    gain, z = float(role.gains[0].sum()), agreed(role.gains[0], rules)
    share = gain / max(left_at(role.point).amount(problem.scale), 1e-9)
    plain = gain > rules.plain and share > rules.much
    if gain <= rules.gain or (
        negligible(problem, role.best.effect, role.best.values, rules) and not plain
    ):
        return False
    if not role.point.effects:
        return share > rules.share and (z > rules.z or (share > rules.much and z > rules.z_much))
    if elsewhere(problem, role, first, rules):
        return z > rules.z and share > rules.share
    return z > rules.z_more and share > rules.share_more and not mends(problem, role, first, rules)


def agreed(gains: np.ndarray, rules: Rules) -> float:
    """z of a gain over blocks, no block counting for more than so many times the median one where
    they gain enough so: a log that begins with a jolt has one block with nine tenths of a delay's
    gain, and every other block has the same to say.
    """
    level = np.clip(gains, None, rules.jolt * max(float(np.median(gains)), 0.0))
    return max(z_of_sum(gains), z_of_sum(level) if float(level.sum()) > rules.gain else 0.0)


def negligible(problem: Problem, effect: str, values: Values, rules: Rules = Rules()) -> bool:
    """Whether an effect is so weak that nobody would act on its name: an offset of a fifth of an
    instrument's step.
    """
    return strength(problem, effect, values) < (
        rules.size_reading if problem.effects[effect].block == "sensors" else rules.size
    )


def strength(problem: Problem, effect: str, values: Values) -> float:
    """An effect's strength as a part of its typical one: the largest over the knobs that switch it
    off.
    """
    one = problem.effects[effect]
    found = []
    for start in one.starts:
        typical = dict(zip(one.knobs, start, strict=True))
        for key in problem.strength(effect):
            neutral = problem.knobs[key].value
            if typical[key] != neutral:
                found.append(abs(values.get(key, neutral) - neutral) / abs(typical[key] - neutral))
    return max(found, default=1.0)


def elsewhere(problem: Problem, role: Role, first: Role, rules: Rules) -> bool:
    """Whether nearly all that an effect gains lies in links where the others explain next to
    nothing: a gap of its own.
    """
    own = np.maximum((role.point.normal.square - role.best.normal.square).sum(axis=1), 0.0)
    others = explained(problem, first.point, role.point)
    return float(own[others < rules.untouched * own].sum()) > rules.nearly_all * float(own.sum())


def mends(problem: Problem, role: Role, first: Role, rules: Rules) -> bool:
    """Whether most of what an effect gains lies where the others explain far more.

    What it frees in nominal parameters that nobody believes is no mending: they had hidden it.
    Where it takes all of them from there to where a plant file may have them, it mends nothing (a
    level of dry friction under a rise towards standstill, which 27 spreads of viscous friction had
    stood for, gained a fiftieth of the rise).
    """
    before, after = role.point.normal, role.best.normal
    if beyond_belief(before, BARS.belief_named) and not beyond_belief(after, BARS.own):
        return False
    own = (role.point.normal.square - role.best.normal.square).sum(axis=1)
    others = explained(problem, first.point, role.point)
    resembling = max(first.screening.cosine(name, role.best.effect) for name in role.point.effects)
    part = rules.mends if resembling > rules.resembles else rules.mends_unlike
    gained = np.maximum(own, 0.0)
    if gained.sum() > rules.closes * _above_noise(problem, role)[own > 0.0].sum():
        part = rules.trifling
    freed = max(float(before.prior @ before.z**2 - after.prior @ after.z**2), 0.0)
    return float(gained[own > part * others].sum()) + freed < 0.5 * (float(gained.sum()) + freed)


def _above_noise(problem: Problem, role: Role) -> np.ndarray:
    """(L,) chi-square above that of the floor's own noise, before the role's effect."""
    return np.maximum(role.point.normal.square.sum(axis=1) - noise(problem), 0.0)


def noise(problem: Problem) -> np.ndarray:
    """(L,) chi-square of the floor's own noise, in the problem's present scale."""
    return np.array([problem.samples(link) / problem.scale[link] ** 2 for link in problem.links])


def explained(problem: Problem, base: Point, point: Point) -> np.ndarray:
    """(L,) chi-square that the effects of a point take off each link, both in the problem's present
    scale.
    """
    now = [float(base_square(problem, base, link)) for link in problem.links]
    return np.maximum(np.array(now) - point.normal.square.sum(axis=1), 0.0)


def base_square(problem: Problem, base: Point, link: str) -> float:
    """Chi-square of a link without effects in the problem's present scale, which changes as misfits
    fall.
    """
    residual = problem.residual(base.values, link)
    return float(residual @ residual)


def dispensable(
    problem: Problem, roles: Sequence[Role], first: Role, left_at: LeftAt, rules: Rules
) -> int | None:
    """The weakest role that is no longer believed with the others on; None where all are."""
    order = sorted(range(len(roles)), key=lambda i: float(roles[i].gains[0].sum()))
    return next((i for i in order if not believed(problem, roles[i], first, left_at, rules)), None)
