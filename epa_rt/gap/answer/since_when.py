"""Whether an effect begins, or changes its strength, within a log: a strap that slips at 14 s.

Every effect of the catalogue is given a step at every block's start, up to the end of that log or
of the last one; its rivals are the effects all along. For a law linear in its strength that costs
one signature: steps are sums over blocks. What a step leaves is weighed as a set of effects is
(posterior/evidence.py).
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from epa_rt.gap.diagnosis import Onset
from epa_rt.gap.likelihood.point import Point
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.screen import amplitudes, difference, starts
from epa_rt.gap.posterior.evidence import Numbers, scale, strain
from epa_rt.gap.posterior.views import BLOCKS, Seen, View

LIKELY = 0.5  # probability from which a change is said: it is likelier than none
PARTS = 6  # of a block, at each of which a step may begin


class _Place(NamedTuple):
    """Parts of blocks from ``first`` on, up to ``stop``."""

    log: str
    at_s: float
    first: int
    stop: int
    lasts: Literal["log", "logs"]


@dataclass(frozen=True)
class _Signature:
    """What an effect changes, by link and part of a block (B of them): ``own`` (L, B) its square,
    ``onto`` (L, B) with the residual, ``cross`` (L, B, k) with the derivatives of all that is free.
    ``number``: the knob that is its strength; it goes from ``neutral`` to ``neutral + typical`` at
    an amplitude of 1, which may lie between ``low`` and ``high``.
    """

    effect: str
    number: str
    neutral: float
    typical: float
    low: float
    high: float
    own: np.ndarray
    onto: np.ndarray
    cross: np.ndarray


class _Left(NamedTuple):
    """What steps leave, one for each of P places: ``amplitude`` (P,), ``moved`` (P, k) of all that
    is free, ``excess`` (P, L) above noise, ``gain`` (P,) of log evidence.
    """

    amplitude: np.ndarray
    moved: np.ndarray
    excess: np.ndarray
    gain: np.ndarray


def onset(problem: Problem, point: Point, numbers: Numbers) -> Onset | None:
    """The step of an effect within a log that explains most of what ``point`` leaves; None where
    none is likelier than none at all.

    ``point``: of ``problem``, fitted to what is named. Raises Stopped.
    """
    places = _places(problem)
    before = _excess(problem, point.normal.square.sum(axis=1))
    kinds = len({effect.family for effect in problem.effects.values()})
    of_one = (numbers.further_odds if point.effects else numbers.effect_odds) - np.log(kinds)
    odds = of_one - np.log(max(len(places), 1))
    if not places or odds + _most(problem, before, numbers) < 0.0:
        return None  # whatever a step explains
    made = problem.each(lambda name: _signature(problem, point, name), list(problem.effects))
    signatures = {one.effect: one for one in made if one is not None}
    always = _Place("", 0.0, 0, PARTS * problem.blocks, "logs")

    def left(one: _Signature) -> _Left:
        return _left(problem, point, one, [*places, always], before, numbers)

    found = {name: left(one) for name, one in signatures.items()}
    best, at, straight = "", 0, set(signatures)
    while found:
        best = max(found, key=lambda name: float(found[name].gain[:-1].max()))
        at = int(np.argmax(found[best].gain[:-1]))
        if best not in straight:
            break
        straight.remove(best)  # a law that is not linear is asked again, as strong as it came out
        again = _signature(problem, point, best, float(found[best].amplitude[at]))
        if again is None:
            del found[best]
        else:
            signatures[best], found[best] = again, left(again)
    if not found:
        return None
    steps = odds + np.array([one.gain[:-1] for one in found.values()])
    rivals = [0.0, *(of_one + one.gain[-1] for one in found.values())]  # none, and all along
    change = float(np.logaddexp.reduce(steps, axis=None))
    probability = float(np.exp(change - np.logaddexp(change, np.logaddexp.reduce(rivals))))
    if not probability > LIKELY:
        return None
    one, told, place = signatures[best], found[best], places[at]
    was = one.neutral
    if one.number in point.normal.keys:
        was += float(told.moved[at, point.normal.keys.index(one.number)]) * one.typical
    return Onset(
        effect=one.effect,
        on=one.effect in point.effects,
        log=place.log,
        at_s=place.at_s,
        within_s=problem.block_s / PARTS,
        lasts=place.lasts,
        number=one.number,
        unit=problem.knobs[one.number].unit,
        before=was,
        after=was + float(told.amplitude[at]) * one.typical,
        explained_share=1.0 - float(told.excess[at].sum() / before.sum()),
        probability=probability,
    )


def _places(problem: Problem) -> list[_Place]:
    """Where a step may be: every part of a block but those of the first and the last one of its
    log, where hardly anything is before or after it.
    """
    places, end = [], PARTS * problem.blocks
    for log, blocks in problem.blocks_of.items():
        begins, stop = PARTS * blocks.start, PARTS * blocks.stop
        for first in range(begins + PARTS, stop - PARTS + 1):
            at_s = (first - begins) * problem.block_s / PARTS
            places.append(_Place(log, at_s, first, stop, "log"))
            if stop < end:
                places.append(_Place(log, at_s, first, end, "logs"))
    return places


def _signature(
    problem: Problem, point: Point, name: str, amplitude: float | None = None
) -> _Signature | None:
    """At a typical strength, or per amplitude at this one; None where the effect changes nothing
    here.
    """
    if amplitude == 0.0:
        return None
    number = problem.strength(name)[0]
    knob, own = problem.knobs[number], {}
    if name in point.effects:
        at, typical = point.values.get(number, knob.value), problem.spread(number)
        low, high = (knob.low - at) / typical, (knob.high - at) / typical
        key, part = point.normal.keys.index(number), amplitude or 0.0
        there = {**point.values, number: at + part * typical}
        for link, (positions, table) in point.columns.items():
            if key in positions:
                own[link] = table[:, list(positions).index(key)]
                if amplitude is not None:
                    here = point.residual[link]
                    own[link] = problem.change(there, point.values, link, here) / part
    else:
        start = starts(problem, name)[0]
        at, typical = knob.value, start[number] - knob.value
        low, high = amplitudes(problem, name, start)
        own = difference(problem, point, name, start, 1.0 if amplitude is None else amplitude)
    if not any(one.any() and np.isfinite(one).all() for one in own.values()):
        return None
    shape = (len(problem.links), PARTS * problem.blocks)
    square, onto = np.zeros(shape), np.zeros(shape)
    cross = np.zeros((*shape, len(point.normal.keys)))
    for i, link in enumerate(problem.links):
        if link in own:
            positions, table = point.columns[link]
            edges, change = _edges(problem, link), own[link]
            for b in np.flatnonzero(np.diff(edges)):
                part = slice(edges[b], edges[b + 1])
                square[i, b] = change[part] @ change[part]
                onto[i, b] = change[part] @ point.residual[link][part]
                cross[i, b, positions] = change[part] @ table[part]
    return _Signature(name, number, at, typical, low, high, square, onto, cross)


def _edges(problem: Problem, link: str) -> np.ndarray:
    """(PARTS * B + 1,) samples of a link at which parts of blocks begin."""
    edges = problem.edges[link]
    at = np.arange(PARTS * problem.blocks + 1) / PARTS
    return np.round(np.interp(at, np.arange(len(edges)), edges)).astype(int)


def _left(
    problem: Problem,
    point: Point,
    one: _Signature,
    places: list[_Place],
    before: np.ndarray,
    numbers: Numbers,
) -> _Left:
    """Steps of an effect, each with the best amplitude and all that is free fitted again."""
    normal, free = point.normal, ~point.normal.frozen
    matrix, vector = normal.matrix.sum(axis=1), normal.vector.sum(axis=1)
    own, onto, cross = (_over(part, places) for part in (one.own, one.onto, one.cross))
    whole = matrix.sum(axis=0)[np.ix_(free, free)] + np.diag(normal.prior[free] + 1e-9)
    slope = (vector.sum(axis=0) + normal.prior * normal.z)[free]
    inverse = np.linalg.inv(whole)
    seen = cross.sum(axis=1)[:, free]
    curvature = own.sum(axis=1) - np.einsum("pi,ij,pj->p", seen, inverse, seen)
    toward = onto.sum(axis=1) - seen @ inverse @ slope
    amplitude = np.clip(-toward / (np.maximum(curvature, 0.0) + 1.0), one.low, one.high)
    moved = np.zeros((len(places), len(free)))
    moved[:, free] = -(slope + amplitude[:, None] * seen) @ inverse
    square = (
        normal.square.sum(axis=1)
        + 2.0 * moved @ vector.T
        + np.einsum("pi,lij,pj->pl", moved, matrix, moved, optimize=True)
        + 2.0 * amplitude[:, None] * (onto + np.einsum("pli,pi->pl", cross, moved))
        + amplitude[:, None] ** 2 * own
    )
    excess = _excess(problem, square)
    return _Left(
        amplitude, moved, excess, _gain(problem, point, moved, before, excess, own, numbers)
    )


def _over(parts: np.ndarray, places: list[_Place]) -> np.ndarray:
    """(P, L, ...) sums over the blocks of each place of what is given by link and block."""
    sums = np.concatenate([np.zeros_like(parts[:, :1]), parts.cumsum(axis=1)], axis=1)
    stop, first = [place.stop for place in places], [place.first for place in places]
    return np.moveaxis(sums[:, stop] - sums[:, first], 0, 1)


def _gain(
    problem: Problem,
    point: Point,
    moved: np.ndarray,
    before: np.ndarray,
    excess: np.ndarray,
    own: np.ndarray,
    numbers: Numbers,
) -> np.ndarray:
    """(P,) log evidence of each step above that of none: likelihood, prior of the nominal
    parameters, and the part of its prior volume that the data leave its size.
    """
    freedom, normal, wide = numbers.freedom_of(BLOCKS), point.normal, _wide(problem, numbers)
    likelihood = -0.5 * freedom * (np.log1p(excess / wide) - np.log1p(before / wide)).sum(axis=1)
    told = (own * _floors(problem) * freedom / (wide + excess)).sum(axis=1)
    nominal = normal.prior > 0.0
    there, here = (strain(View({}, normal.keys, z, nominal)) for z in (normal.z + moved, normal.z))
    gain: np.ndarray = likelihood + there - here - 0.5 * np.log1p(told)
    return gain


def _wide(problem: Problem, numbers: Numbers) -> np.ndarray:
    """(L,) chi-square above noise from which on a link's discrepancy counts (``scale``)."""
    samples = (float(problem.samples(link)) for link in problem.links)
    freedom, share = numbers.freedom_of(BLOCKS), numbers.floor_share
    return np.array([scale(Seen(n, n), freedom, share) for n in samples])


def _most(problem: Problem, before: np.ndarray, numbers: Numbers) -> float:
    """Log evidence that a step would gain that leaves nothing."""
    freedom = numbers.freedom_of(BLOCKS)
    return 0.5 * freedom * float(np.log1p(before / _wide(problem, numbers)).sum())


def _floors(problem: Problem) -> np.ndarray:
    """(L,) chi-square in floors of one in the problem's deviations."""
    return np.array([problem.scale[link] ** 2 for link in problem.links])


def _excess(problem: Problem, square: np.ndarray) -> np.ndarray:
    """(..., L) chi-square above noise in floors, of what is left in deviations of the problem."""
    samples = np.array([problem.samples(link) for link in problem.links])
    return np.maximum(square * _floors(problem) - samples, 0.0)
