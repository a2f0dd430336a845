"""A role: the place of one found effect while all others are on. Its candidates are refitted side
by side.

That gives the best one, what else would do as well, and the swap of an early choice that a later
one shows to be wrong.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.likelihood.point import Point
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import Fit, refit, settled
from epa_rt.gap.likelihood.screen import STRONGEST, WEAKEST, Screening, scaled, screen

BEST = 8  # candidates by expected gain that are refitted
PER_LINK = 1  # further ones that gain most in a link with an excess of its own
STARTS = 2  # starting points of a refit
# of the best gain: where half of unlike candidates gain as much, it is the nominal parameters that
# were off
ALL_ALIKE = 0.5
# spreads of a nominal parameter from which candidates that gain CLOSE to the best are fitted more
# thoroughly
ABSORBED = 4.0
CLOSE, POLISHED = 0.7, 3
# candidates that are, whatever they gain, beside an effect whose shape another one may have bent,
# where one reading is all there is
BESIDE_A_SHAPE = 6
TIE, TIE_SHARE = 10.0, 5e-4  # difference of gains, and share of the best, that is none
NOT_LITTLE = 100.0  # chi-square below which that does not matter


@dataclass(frozen=True)
class Role:
    """``point``: everything else on. ``fits``: the candidates, best first. ``gains`` (C, B): what
    each one's chi-square falls in every block, on trials left out.
    """

    point: Point
    fits: tuple[Fit, ...]
    gains: np.ndarray

    @property
    def best(self) -> Fit:
        return self.fits[0]


def played(
    problem: Problem,
    point: Point,
    worth: Callable[[float], bool] = lambda gain: True,
    screening: Screening | None = None,
) -> Role | None:
    """Candidates of one role, refitted and ranked by what they gain on trials left out. ``worth``:
    whether one that gains so much in screening is to be refitted at all. ``screening``: at
    ``point``, where there is one already.

    Where most of them gain alike although they have nothing in common, ``point`` was not at its
    optimum: it is settled again from where the best one took the nominal parameters. Families that
    are on already are not asked again.
    """
    role = _played(problem, point, worth, screening or screen(problem, point))
    if role is None or not _all_alike(role):
        return role
    keys = point.normal.keys
    again = settled(
        problem,
        point.effects,
        {key: value for key, value in role.best.values.items() if key in keys},
    )
    return (
        role
        if again.normal.chi > point.normal.chi - NOT_LITTLE
        else _played(problem, again, worth, screen(problem, again))
    )


def _all_alike(role: Role) -> bool:
    total = role.gains.sum(axis=1)
    return (
        len(total) > 3 and total[0] > NOT_LITTLE and float(np.median(total)) > ALL_ALIKE * total[0]
    )


def _played(
    problem: Problem, point: Point, worth: Callable[[float], bool], screening: Screening
) -> Role | None:
    promised = screening.best()
    on = {problem.effects[name].family for name in point.effects}
    names = [
        n
        for n in candidates(problem, screening)
        if problem.effects[n].family not in on and (n not in promised or worth(promised[n].gain))
    ]
    if not names:
        return None
    jobs = [(name, start) for name in names for start in starts(problem, screening, name)]
    fits: dict[str, Fit] = {}
    for (name, _), fit in zip(
        jobs, problem.each(lambda job: _fitted(problem, point, *job), jobs), strict=True
    ):
        if name not in fits or fit.chi < fits[name].chi:
            fits[name] = fit
    scored = _ranked(problem, point, fits.values())
    shaped = _beside_a_shape(problem, point)
    if shaped or np.max(np.abs(point.normal.z * point.normal.prior), initial=0.0) > ABSORBED:
        close = [fit for gain, fit in scored if shaped or gain.sum() > CLOSE * scored[0][0].sum()][
            : BESIDE_A_SHAPE if shaped else POLISHED
        ]
        polished = {fit.effect: _polished(problem, point, fit) for fit in close}
        scored = _ranked(problem, point, [polished.get(fit.effect, fit) for _, fit in scored])
    return Role(point, tuple(fit for _, fit in scored), np.array([g for g, _ in scored]))


def _fitted(problem: Problem, point: Point, name: str, start: Mapping[str, float]) -> Fit:
    """Refitted from a start; with fresh derivatives where an effect sets in only from some strength
    on, since those of before know nothing of it.
    """
    if not problem.effects[name].sets_in:
        return refit(problem, point, name, start)
    return _as_fit(name, settled(problem, (*point.effects, name), {**point.values, **start}))


def _as_fit(name: str, end: Point) -> Fit:
    return Fit(name, dict(end.values), end.normal.chi, end.normal)


def _beside_a_shape(problem: Problem, point: Point) -> bool:
    """Whether an effect that is on has a shape and all there is is one reading: the shape then
    stands for something of what is looked for, and refits keep its derivatives.
    """
    return len(problem.links) == 1 and any(
        len(problem.effects[name].knobs) > len(problem.strength(name)) for name in point.effects
    )


def _ranked(problem: Problem, point: Point, fits: Iterable[Fit]) -> list[tuple[np.ndarray, Fit]]:
    """Best first; of those that gain as much as the best one that with the fewest knobs: a lock
    that begins nowhere is a plain spring.
    """
    scored = sorted(
        ((gains(problem, point, fit), fit) for fit in fits), key=lambda pair: -_total(pair[0])
    )
    most = _total(scored[0][0])
    least = most - max(TIE, TIE_SHARE * most)
    same = [i for i, (gain, _) in enumerate(scored) if _total(gain) >= least]
    simplest = min(same, key=lambda i: len(problem.effects[scored[i][1].effect].knobs))
    return [scored[simplest], *scored[:simplest], *scored[simplest + 1 :]]


def _total(gain: np.ndarray) -> float:
    """Of all blocks; of a plant that ran away, less than of any other."""
    return float(np.nan_to_num(gain.sum(), nan=-np.inf))


def _polished(problem: Problem, point: Point, fit: Fit) -> Fit:
    """Fitted with fresh derivatives from the plant file's nominal parameters, where that is better.

    Where those have hidden a gap by going far, a refit with the derivatives they have there does
    not find its way back.
    """
    effects = (*point.effects, fit.effect)
    own = {key for name in effects for key in problem.effects[name].knobs}
    end = settled(problem, effects, {key: value for key, value in fit.values.items() if key in own})
    return fit if end.normal.chi >= fit.chi else _as_fit(fit.effect, end)


def gains(problem: Problem, point: Point, fit: Fit) -> np.ndarray:
    """(B,) fall of chi-square in every block under fits to the other trials; what the nominal
    parameters pay is spread evenly.
    """
    before = point.normal.left_out(problem.fold_of_block).sum(axis=0)
    after = fit.normal.left_out(problem.fold_of_block).sum(axis=0)
    paid = fit.normal.prior @ fit.normal.z**2 - point.normal.prior @ point.normal.z**2
    return before - after - paid / len(before)


def candidates(problem: Problem, screening: Screening) -> list[str]:
    """Effects worth a refit: the best overall, and the best of each link."""
    best = screening.best()
    order = sorted(best, key=lambda name: -best[name].gain)
    names = order[:BEST]
    for link in problem.links:
        own = [name for name in order if link in problem.touched(problem.effects[name].knobs)]
        names += own[:PER_LINK]
    return list(dict.fromkeys(names))


def starts(problem: Problem, screening: Screening, effect: str) -> list[dict[str, float]]:
    """The most promising starting points of an effect, at the strength that screening found; where
    it sets in only from some strength on as they are, and as unlike as there are.
    """
    one = problem.effects[effect]
    own = sorted(
        (s for s in screening.signatures if s.effect == effect),
        key=lambda s: -(s.as_is if one.sets_in else s.gain),
    )
    if own and one.sets_in:
        return unlike([s.start for s in own])
    if not own:
        return [dict(zip(one.knobs, one.starts[0], strict=True))]
    return [
        scaled(
            problem,
            effect,
            s.start,
            float(np.sign(s.amplitude) or 1.0) * min(max(abs(s.amplitude), WEAKEST), STRONGEST),
        )
        for s in own[:STARTS]
    ]


def unlike(ordered: Sequence[Mapping[str, float]], most: int = STARTS) -> list[dict[str, float]]:
    """The first, and those after it that have no number in common with one before but what all
    have; then the next ones as they come, up to ``most``. One that is wrong in one number draws
    its neighbours into its own valley.
    """
    same = {key for key in ordered[0] if len({start[key] for start in ordered}) == 1}
    taken: list[Mapping[str, float]] = []
    for start in ordered:
        if all(start[key] != other[key] for other in taken for key in start.keys() - same):
            taken.append(start)
    rest = [start for start in ordered if start not in taken]
    return [dict(start) for start in (*taken, *rest)[:most]]


def z_of_sum(per_block: np.ndarray) -> float:
    """A sum over blocks in units of its standard deviation by the blocks' own scatter."""
    used = per_block[per_block != 0.0]
    scatter = np.sqrt(len(used)) * np.std(used) if len(used) > 1 else np.inf
    return float(used.sum() / scatter) if scatter > 0.0 else 0.0
