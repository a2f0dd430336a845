"""Forward selection: one effect after the other, each judged on trials it was not fitted to, earlier ones tried again.

A role is the place of one found effect while all others are on. Its candidates are refitted side by side; that gives the
best one, what else would do as well, and the swap of an early choice that a later one shows to be wrong.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import Fit, refit, settled
from epa_rt.gap.screen import STRONGEST, WEAKEST, Screening, scaled, screen
from epa_rt.gap.yardstick import Left

MOST_EFFECTS = 3
BEST = 8             # candidates by expected gain that are refitted
PER_LINK = 1         # further ones that gain most in a link with an excess of its own
STARTS = 2           # starting points of a refit
RESCALE = 0.2        # change of log s^2 that is worth settling again


@dataclass(frozen=True)
class Rules:
    """When a further effect is believed; the figures are from the development cases.

    ``gain``: fall of chi-square on trials left out (residuals in units of s). ``z``: of that fall over blocks; an effect
    that shows at a few valve strokes has no large one. ``share``: least part of what is left to explain. Further effects
    also mend what another formula of the first one left, so they need more: ``gain_more``, ``z_more``, ``share_more``, and
    at least ``beside`` of what the first one gained.
    """

    gain: float = 120.0
    z: float = 2.0
    share: float = 0.10
    gain_more: float = 120.0
    z_more: float = 2.5
    share_more: float = 0.30
    beside: float = 0.005


@dataclass(frozen=True)
class Role:
    """``point``: everything else on. ``fits``: the candidates, best first. ``gains`` (C, B): what each one's chi-square falls
    in every block, on trials left out. ``screening``: of the whole catalogue at ``point``."""

    point: Point
    fits: tuple[Fit, ...]
    gains: np.ndarray
    screening: Screening

    @property
    def best(self) -> Fit:
        return self.fits[0]


@dataclass(frozen=True)
class Selection:
    """``base``: no effect on. ``roles``: one for each effect found. ``final``: all found effects on, polished.

    ``problem``: scaled by what was left in the end. ``refused``: the role that was tried last and not believed.
    """

    problem: Problem
    base: Point
    roles: tuple[Role, ...]
    final: Point
    refused: Role | None


LeftAt = Callable[[Point], Left]


def select(problem: Problem, base: Point, left_at: LeftAt, rules: Rules = Rules(),
           progress: Callable[[str, float], None] = lambda stage, share: None) -> Selection:
    """Effects that explain the residual at ``base`` (nominal parameters refitted), one after the other."""
    roles: list[Role] = []
    point, refused = base, None
    for depth in range(MOST_EFFECTS):
        progress(f"effect {depth + 1}", depth / MOST_EFFECTS)
        role = played(problem, point, pairs=depth == 0)
        if role is None or not believed(problem, role, left_at, rules, roles[0] if roles else None):
            refused = role
            break
        effects = (*point.effects, role.best.effect)
        point = settled(problem, effects, role.best.values)
        roles.append(role)
        if depth > 0:
            roles, point = _tried_again(problem, roles, point)
        problem, point = rescaled(problem, point, left_at(point))
    return Selection(problem, base, tuple(roles), point, refused)


def rescaled(problem: Problem, point: Point, left: Left) -> tuple[Problem, Point]:
    """Links whose s^2 has fallen count for more; the point is settled again where that changed anything."""
    before = {link: scale**2 for link, scale in problem.scale.items()}
    after = {link: min(before[link], left.misfit(link)) if point.effects else left.misfit(link) for link in problem.links}
    if all(abs(np.log(after[link] / before[link])) < RESCALE for link in problem.links):
        return problem, point
    problem = problem.rescaled(after)
    return problem, settled(problem, point.effects, point.values, rounds=2)


def _tried_again(problem: Problem, roles: list[Role], final: Point) -> tuple[list[Role], Point]:
    """Every earlier role played again with the others on; a better candidate takes it."""
    for i in range(len(final.effects) - 1):
        others = tuple(e for j, e in enumerate(final.effects) if j != i)
        keep = {k for e in others for k in problem.effects[e].knobs} | set(problem.nominal)
        without = settled(problem, others, {k: v for k, v in final.values.items() if k in keep})
        role = played(problem, without, also=(final.effects[i],))
        if role is None:
            continue
        roles = [*roles[:i], role, *roles[i + 1:]]
        if role.best.effect != final.effects[i]:
            names = (*final.effects[:i], role.best.effect, *final.effects[i + 1:])
            final = settled(problem, names, role.best.values)
    return roles, final


def played(problem: Problem, point: Point, also: Sequence[str] = (), pairs: bool = False) -> Role | None:
    """Candidates of one role, refitted and ranked by what they gain on trials left out."""
    screening = screen(problem, point)
    names = [n for n in dict.fromkeys((*also, *candidates(problem, point, screening, pairs))) if n not in point.effects]
    if not names:
        return None
    jobs = [(name, start) for name in names for start in _starts(problem, screening, name)]
    fits: dict[str, Fit] = {}
    for (name, _), fit in zip(jobs, problem.each(lambda job: refit(problem, point, *job), jobs), strict=True):
        if name not in fits or fit.chi < fits[name].chi:
            fits[name] = fit
    scored = [(gains(problem, point, fit), fit) for fit in fits.values()]
    scored.sort(key=lambda pair: -pair[0].sum())
    return Role(point, tuple(fit for _, fit in scored), np.array([g for g, _ in scored]), screening)


def gains(problem: Problem, point: Point, fit: Fit) -> np.ndarray:
    """(B,) fall of chi-square in every block under fits to the other trials; what the nominal parameters pay is spread evenly."""
    before = point.normal.left_out(problem.fold_of_block).sum(axis=0)
    after = fit.normal.left_out(problem.fold_of_block).sum(axis=0)
    paid = fit.normal.prior @ fit.normal.z**2 - point.normal.prior @ point.normal.z**2
    return before - after - paid / len(before)


def candidates(problem: Problem, point: Point, screening: Screening, pairs: bool) -> list[str]:
    """Effects worth a refit: the best overall, the best of each link, and the members of the best pair."""
    best = screening.best()
    order = sorted(best, key=lambda name: -best[name].gain)
    names = order[:BEST]
    for link in problem.links:
        own = [name for name in order if link in problem.touched(problem.effects[name].knobs)]
        names += own[:PER_LINK]
    if pairs:
        names += [name for pair in screening.pairs(2, order[:30]) for name in pair]
    return list(dict.fromkeys(names))


def _starts(problem: Problem, screening: Screening, effect: str) -> list[dict[str, float]]:
    """The most promising starting points of an effect, at the strength that screening found."""
    own = sorted((s for s in screening.signatures if s.effect == effect), key=lambda s: -s.gain)[:STARTS]
    if not own:
        one = problem.effects[effect]
        return [dict(zip(one.knobs, one.starts[0], strict=True))]
    return [scaled(problem, effect, s.start, float(np.sign(s.amplitude) or 1.0) * min(max(abs(s.amplitude), WEAKEST), STRONGEST)) for s in own]


def believed(problem: Problem, role: Role, left_at: LeftAt, rules: Rules, first: Role | None) -> bool:
    """Whether the best candidate of a role gains enough on trials left out, beyond chance and beyond the method's misfit."""
    gain, z = float(role.gains[0].sum()), z_of_sum(role.gains[0])
    share = gain / max(left_at(role.point).amount(problem.scale), 1e-9)
    if first is None:
        return gain > rules.gain and z > rules.z and share > rules.share
    return gain > max(rules.gain_more, rules.beside * float(first.gains[0].sum())) and z > rules.z_more and share > rules.share_more


def z_of_sum(per_block: np.ndarray) -> float:
    """A sum over blocks in units of its standard deviation by the blocks' own scatter."""
    used = per_block[per_block != 0.0]
    scatter = np.sqrt(len(used)) * np.std(used) if len(used) > 1 else np.inf
    return float(used.sum() / scatter) if scatter > 0.0 else 0.0
