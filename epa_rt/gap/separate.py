"""What this data cannot tell apart, how sure a name is, and how far its numbers can be trusted.

All by blocks: a block's contributions are resampled or summed as they are, so that neither colour
nor missing physics makes an interval or a choice look surer than it is.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.diagnosis import TELLS
from epa_rt.gap.point import Normal
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import Fit
from epa_rt.gap.role import Role, z_of_sum

RESAMPLES = 300
TWO_SIDED_95 = 1.96


@dataclass(frozen=True)
class Alike:
    """When two refits count as the same; the figures are from the development cases.

    ``chance``: difference of chi-square on trials left out (residuals in units of s). ``exact``: of
    what the best one explains; no law is known to a thousandth. ``rest``: of what even the best one
    leaves above the noise, for then both are the wrong formula; never more than ``part`` of what it
    explains. ``z``: of the difference over blocks; a rival that differs by less must still explain
    ``most`` of what the best one does. ``same``: chi-square between what two fits say, below which
    they say the same. ``tied_share``: of what the best one explains, for a law that is behind block
    by block, because no law is the rig's own, and tied with it in free run: it may as well be the
    one. (Logs of one small sine: dry and low-speed friction explain 0.974 to 0.997 of each other.)
    ``sure``: of the difference over blocks, from which on free run's silence counts no more: it
    weighs four readings a second, and what is behind by a hundredth is lost there. Where no law is
    the rig's own, what is ahead by three or four of them is not always it (dry and low-speed
    friction on a ladder of speeds: the truth first by 3.6 and 4.3, and in a third case, by more
    than 3, the other one).
    """

    chance: float = TELLS
    exact: float = 1e-3
    rest: float = 0.5
    part: float = 0.05
    z: float = 2.0
    most: float = 0.9
    same: float = 25.0
    tied_share: float = 0.97
    sure: float = 5.0


def alike(
    role: Role,
    left: float,
    same_law: Collection[str] = (),
    tied: Collection[str] = (),
    rule: Alike = Alike(),
) -> tuple[Fit, ...]:
    """The role's best fit and all that this data cannot tell from it, best first. ``left``:
    chi-square above the noise that stays with all effects on. ``same_law``: effects that say the
    best one again. ``tied``: those that free run puts nothing between.
    """
    best = role.gains[0]
    within = max(
        rule.chance,
        rule.exact * float(best.sum()),
        min(rule.rest * left, rule.part * float(best.sum())),
    )

    def as_well(fit: Fit, gain: np.ndarray) -> bool:
        z = z_of_sum(best - gain)
        return bool(
            (best - gain).sum() < within
            or (z < rule.z and gain.sum() > rule.most * best.sum())
            or (fit.effect in tied and z < rule.sure and gain.sum() > rule.tied_share * best.sum())
        )

    return tuple(
        fit
        for fit, gain in zip(role.fits, role.gains, strict=True)
        if fit.effect not in same_law and as_well(fit, gain)
    )


def become_best(problem: Problem, role: Role, rule: Alike = Alike()) -> frozenset[str]:
    """Laws for the same thing with more numbers whose fit has become the role's best one: they say
    the same, and are no other answer.

    A lock from where the muscle begins is a bladder. A law for another thing that says the same of
    this data stays one: another experiment may tell them apart.
    """
    named = problem.effects[role.best.effect]
    richer = [
        fit
        for fit in role.fits
        if problem.effects[fit.effect].family == named.family
        and len(problem.effects[fit.effect].knobs) > len(named.knobs)
    ]
    best = (
        {link: problem.residual(role.best.values, link) for link in problem.links} if richer else {}
    )

    def apart(fit: Fit) -> float:
        return sum(
            float(np.sum((problem.residual(fit.values, link) - best[link]) ** 2))
            for link in problem.links
        )

    return frozenset(
        fit.effect
        for fit, off in zip(richer, problem.each(apart, richer), strict=True)
        if off < rule.same
    )


def shares(
    problem: Problem, role: Role, become: Collection[str] = (), seed: int = 0
) -> dict[str, float]:
    """Share of block resamples in which each candidate gains most on trials left out; those that
    have become the best one (``become``) count as it.
    """
    own = [i for i, fit in enumerate(role.fits) if fit.effect not in become]
    rng = np.random.default_rng(seed)
    weights = rng.multinomial(
        problem.blocks, np.full(problem.blocks, 1.0 / problem.blocks), size=RESAMPLES
    ).astype(float)
    first = np.argmax(weights @ role.gains[own].T, axis=1)
    return {role.fits[i].effect: float(np.mean(first == k)) for k, i in enumerate(own)}


def intervals(
    normal: Normal, keys: Sequence[str], astray: np.ndarray | None = None
) -> dict[str, float]:
    """Half width of each key's 95 % interval in spreads: sandwich covariance over blocks, the
    priors believed.

    ``astray`` (n, k): how far fits of twins went from what is true of them (astray.py). What shifts
    all blocks alike no scatter of blocks shows: where the twins' mean square is more than the
    blocks give, it takes their place.
    """
    free = normal.uncertain
    blocks = normal.vector.sum(axis=0)[:, free]
    blocks = blocks[np.any(blocks != 0.0, axis=1)] if blocks.size else blocks
    inverse = normal.covariance()
    few = len(blocks) / max(len(blocks) - int(free.sum()), 1)
    noise = np.einsum("ij,ij->i", inverse @ (few * blocks.T @ blocks), inverse)
    if astray is not None:
        noise = np.maximum(noise, np.mean(astray[:, free] ** 2, axis=0))
    belief = np.einsum("ij,j,ij->i", inverse, normal.prior[free], inverse)
    width = dict.fromkeys(keys, np.inf)
    for i, square in zip(np.flatnonzero(free), noise + belief, strict=True):
        if normal.keys[i] in width:
            width[normal.keys[i]] = TWO_SIDED_95 * float(np.sqrt(max(square, 0.0)))
    return width
