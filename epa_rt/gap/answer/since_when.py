"""Whether an effect begins, or changes its strength, within a log: a strap that slips at 14 s.

Every effect of the catalogue is given a step at the start of each part of a block, up to the end of
that log or of the last one; its rivals are the effects all along. For a law linear in its strength
that costs one signature: steps are sums over parts. What a step leaves is weighed as a set of
effects is (posterior/evidence.py).
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from epa_rt.gap.diagnosis import Onset
from epa_rt.gap.likelihood.point import Point
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.screen import amplitudes, difference, starts
from epa_rt.gap.posterior.decide import MISSED, WRONG_NAME
from epa_rt.gap.posterior.evidence import Numbers, scale, strain
from epa_rt.gap.posterior.views import BLOCKS, Seen, View

# Probability from which to say a change is expected to cost no more than to say none, by the losses
# of names.
LIKELY = WRONG_NAME / (WRONG_NAME + MISSED)
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
    none is ``LIKELY``.

    ``point``: of ``problem``, fitted to what is named. Raises Stopped.
    """
    places = _places(problem)
    always = _Place("", 0.0, 0, PARTS * problem.blocks, "logs")
    ground = _Ground(problem, point, [*places, always], numbers)
    kinds = len({effect.family for effect in problem.effects.values()})
    of_one = (numbers.further_odds if point.effects else 0.0) - np.log(kinds)
    odds = of_one - np.log(max(len(places), 1))
    if not places or odds + ground.most < 0.0:
        return None  # whatever a step explains
    made = problem.each(lambda name: _signature(problem, point, name), list(problem.effects))
    signatures = {one.effect: one for one in made if one is not None}
    found = {name: ground.left(one) for name, one in signatures.items()}
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
            signatures[best], found[best] = again, ground.left(again)
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
        explained_share=1.0 - float(told.excess[at].sum() / ground.before.sum()),
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


class _Ground:
    """What steps are held against: a point with all that is free fitted again, what that leaves,
    and where they may be. A fit to free run as well is none of the blocks' alone.

    ``before`` (L,): chi-square above noise in floors that it leaves; ``most``: log evidence
    that a step would gain that leaves nothing.
    """

    def __init__(
        self, problem: Problem, point: Point, places: list[_Place], numbers: Numbers
    ) -> None:
        self._normal, self._places, self._free = point.normal, places, ~point.normal.frozen
        normal, free = self._normal, self._free
        self._matrix, self._vector = normal.matrix.sum(axis=1), normal.vector.sum(axis=1)
        self._square = normal.square.sum(axis=1)
        whole = self._matrix.sum(axis=0)[np.ix_(free, free)] + np.diag(normal.prior[free] + 1e-9)
        self._inverse = np.linalg.inv(whole)
        self._slope = (self._vector.sum(axis=0) + normal.prior * normal.z)[free]
        self._floors = np.array([problem.scale[link] ** 2 for link in problem.links])
        self._noise = np.array([float(problem.samples(link)) for link in problem.links])
        self._freedom, share = numbers.freedom_of(BLOCKS), numbers.floor_share
        self._wide = np.array([scale(Seen(n, n), self._freedom, share) for n in self._noise])
        still = np.zeros(len(free))
        still[free] = -self._inverse @ self._slope
        self._z = normal.z + still
        self.before = self._excess(
            self._square + 2.0 * self._vector @ still + still @ self._matrix @ still
        )
        self.most = float(self._gained(np.zeros(len(self._noise))))

    def left(self, one: _Signature) -> _Left:
        """Steps of an effect, each with the best amplitude and all that is free fitted again."""
        own, onto, cross = (_over(part, self._places) for part in (one.own, one.onto, one.cross))
        seen = cross.sum(axis=1)[:, self._free]
        imitated = np.einsum("pi,ij,pj->p", seen, self._inverse, seen)
        toward = onto.sum(axis=1) - seen @ self._inverse @ self._slope
        curvature = np.maximum(own.sum(axis=1) - imitated, 0.0)
        amplitude = np.clip(-toward / (curvature + 1.0), one.low, one.high)
        moved = np.zeros((len(self._places), len(self._free)))
        moved[:, self._free] = -(self._slope + amplitude[:, None] * seen) @ self._inverse
        excess = self._excess(
            self._square
            + 2.0 * moved @ self._vector.T
            + np.einsum("pi,lij,pj->pl", moved, self._matrix, moved, optimize=True)
            + 2.0 * amplitude[:, None] * (onto + np.einsum("pli,pi->pl", cross, moved))
            + amplitude[:, None] ** 2 * own
        )
        told = (own * self._floors * self._freedom / (self._wide + excess)).sum(axis=1)
        gain = self._gained(excess) + self._strained(moved) - 0.5 * np.log1p(told)
        return _Left(amplitude, moved, excess, gain)

    def _excess(self, square: np.ndarray) -> np.ndarray:
        """(..., L) chi-square above noise in floors, of (..., L) in deviations of the problem."""
        return np.maximum(square * self._floors - self._noise, 0.0)

    def _gained(self, excess: np.ndarray) -> np.ndarray:
        """(...) log likelihood of an excess (..., L) above that of what there is."""
        fell = np.log1p(self.before / self._wide) - np.log1p(excess / self._wide)
        return 0.5 * self._freedom * fell.sum(axis=-1)

    def _strained(self, moved: np.ndarray) -> np.ndarray:
        """(P,) what the prior of the nominal parameters gains by a move from the point."""
        normal = self._normal
        nominal = normal.prior > 0.0
        there, here = (
            strain(View({}, normal.keys, z, nominal)) for z in (normal.z + moved, self._z)
        )
        return there - here


def _over(parts: np.ndarray, places: list[_Place]) -> np.ndarray:
    """(P, L, ...) sums over each place of what is given by link and part of a block."""
    sums = np.concatenate([np.zeros_like(parts[:, :1]), parts.cumsum(axis=1)], axis=1)
    stop, first = [place.stop for place in places], [place.first for place in places]
    return np.moveaxis(sums[:, stop] - sums[:, first], 0, 1)
