"""Screening: what every effect of the catalogue would change at a typical strength, and how much of
the gap that could be.

A signature is a finite difference of the whitened residuals between an effect at a start value and
none, with what the nominal parameters could imitate projected out.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from epa_rt.gap.likelihood.point import Point
from epa_rt.gap.likelihood.problem import Problem

WEAKER = 0.3  # of a typical strength: where saturating laws look different
STRONGEST, WEAKEST = 4.0, 0.02  # strengths in units of the typical one that a refit may start from


@dataclass(frozen=True)
class Signature:
    """``start``: knob values it stands for. ``size``: expected chi-square at that strength,
    projected. ``gain``: fall of chi-square with the best ``amplitude`` that the bounds allow;
    ``as_is``: at that strength.
    """

    effect: str
    start: dict[str, float]
    size: float
    gain: float
    amplitude: float
    as_is: float


class Pair(NamedTuple):
    """Two signatures, each with the amplitude that it has beside the other. ``gain``: fall of
    chi-square with both.
    """

    one: tuple[Signature, float]
    other: tuple[Signature, float]
    gain: float


@dataclass(frozen=True)
class Screening:
    """Signatures of all effects, and ``gram`` (S, S): their inner products, projected; ``right``
    (S,): with the residual.
    """

    signatures: tuple[Signature, ...]
    gram: np.ndarray
    right: np.ndarray

    def best(self) -> dict[str, Signature]:
        """Every effect's signature with the largest gain."""
        found: dict[str, Signature] = {}
        for s in self.signatures:
            if s.effect not in found or s.gain > found[s.effect].gain:
                found[s.effect] = s
        return found

    def typical(self) -> dict[str, float]:
        """Expected chi-square of every effect at its typical strength; what only its curvature
        shows does not count.
        """
        first: dict[str, float] = {}
        weaker: dict[str, float] = {}
        for s in self.signatures:
            first.setdefault(s.effect, s.size)
            weaker[s.effect] = s.size  # the last one of an effect
        square = WEAKER**2
        return {
            name: min(size, max((weaker[name] / square - square * size) / (1.0 - square), 0.0))
            for name, size in first.items()
        }

    def cosine(self, a: str, b: str) -> float:
        """Largest |cosine| between two effects' projected signatures."""
        ia = [i for i, s in enumerate(self.signatures) if s.effect == a]
        ib = [i for i, s in enumerate(self.signatures) if s.effect == b]
        size = np.sqrt(np.maximum(np.diag(self.gram), 1e-30))
        return (
            float(np.max(np.abs(self.gram[np.ix_(ia, ib)]) / np.outer(size[ia], size[ib])))
            if ia and ib
            else 0.0
        )

    def hidden_pair(self, families: Mapping[str, str], on: Collection[str] = ()) -> Pair | None:
        """The pair of effects of two families that together would explain most, of those that
        explain more so than in sum alone: what one does the other hides. None of the families that
        are ``on``; None where there is no such pair.
        """
        own = [i for i, s in enumerate(self.signatures) if families[s.effect] not in on]
        if not own:
            return None
        kinds = np.array([families[self.signatures[i].effect] for i in own])
        gain = np.array([self.signatures[i].gain for i in own])
        together = self._together(np.array(own, int))
        hidden = (kinds[:, None] != kinds) & (together > gain[:, None] + gain)
        most = np.where(hidden, together, 0.0)
        i, j = np.unravel_index(int(np.argmax(most)), most.shape)
        if not hidden[i, j]:
            return None
        pair = [own[i], own[j]]
        amplitudes = np.linalg.solve(self.gram[np.ix_(pair, pair)], -self.right[pair])
        one, other = (
            (self.signatures[k], float(amplitude))
            for k, amplitude in zip(pair, amplitudes, strict=True)
        )
        return Pair(one, other, float(together[i, j]))

    def _together(self, index: np.ndarray) -> np.ndarray:
        """(I, I) fall of chi-square with two of these signatures at once; 0 where they are one."""
        g, r = self.gram[np.ix_(index, index)], self.right[index]
        own = np.diag(g)
        sizes = own[:, None] * own[None, :]
        determinant = sizes - g**2
        both = r[:, None] ** 2 * own[None, :] - 2.0 * r[:, None] * r[None, :] * g
        both += r[None, :] ** 2 * own[:, None]
        apart = determinant >= 1e-6 * sizes
        return np.where(apart, both, 0.0) / np.where(apart, determinant, 1.0)


def screen(
    problem: Problem, point: Point, part: float = 1.0, shapes: int | None = None
) -> Screening:
    """Signatures of all effects that are not on at a point, from so many of their ``shapes`` (None:
    all, and the first one weaker). ``part``: of each strength at which the difference is taken; a
    small one gives derivatives, for where nominal parameters imitate an effect so well that its
    curvature would hide that.
    """
    names = [name for name in problem.effects if name not in point.effects]
    jobs = [
        (name, start)
        for name in names
        for start in starts(problem, name)[: None if part == 1.0 else -1][:shapes]
    ]  # the weaker one has the same derivative
    made = problem.each(lambda job: difference(problem, point, *job, part), jobs)
    alive = [
        i for i, difference in enumerate(made) if any(np.any(d != 0.0) for d in difference.values())
    ]
    jobs, made = [jobs[i] for i in alive], [made[i] for i in alive]
    gram, right = projected(problem, point, made)
    found = []
    for i, (name, start) in enumerate(jobs):
        size = max(float(gram[i, i]), 1e-12)
        low, high = amplitudes(problem, name, start)
        amplitude = float(np.clip(-right[i] / size, low, high))
        gain, as_is = (-(2.0 * by * right[i] + by**2 * size) for by in (amplitude, 1.0))
        found.append(Signature(name, start, size, float(gain), amplitude, float(as_is)))
    return Screening(tuple(found), gram, right)


def starts(problem: Problem, effect: str) -> list[dict[str, float]]:
    """Every start of an effect, those that its residual asks for, and its typical one weaker."""
    one = problem.effects[effect]
    whole = [dict(zip(one.knobs, values, strict=True)) for values in one.starts]
    return [
        whole[0],
        *problem.waves.get(effect, ()),
        *whole[1:],
        scaled(problem, effect, whole[0], WEAKER),
    ]


def scaled(
    problem: Problem, effect: str, start: Mapping[str, float], amplitude: float
) -> dict[str, float]:
    """A start at another strength: the distance from neutral scaled, within bounds; knobs that
    shape the effect stay.
    """
    found = dict(start)
    for key in problem.strength(effect):
        knob = problem.knobs[key]
        found[key] = float(
            np.clip(knob.value + amplitude * (start[key] - knob.value), knob.low, knob.high)
        )
    return found


def amplitudes(problem: Problem, effect: str, start: Mapping[str, float]) -> tuple[float, float]:
    """Smallest and largest strength of a start within its knobs' bounds; negative where the bounds
    allow the other sign.
    """
    low, high = -STRONGEST, STRONGEST
    for key in problem.strength(effect):
        knob = problem.knobs[key]
        by = start[key] - knob.value
        if by != 0.0:
            one, other = (knob.low - knob.value) / by, (knob.high - knob.value) / by
            low, high = max(low, min(one, other)), min(high, max(one, other))
    return min(low, 0.0), max(high, 0.0)


def difference(
    problem: Problem, point: Point, effect: str, start: Mapping[str, float], part: float = 1.0
) -> dict[str, np.ndarray]:
    """Link to (n,) change of its residual with an effect on, over ``part`` of its strength; none
    where that is no number.
    """
    values = {**point.values, **(start if part == 1.0 else scaled(problem, effect, start, part))}
    found = {}
    for link in problem.touched(start):
        change = (
            problem.change(values, point.values, link, point.residual[link], far=part == 1.0) / part
        )
        found[link] = change if np.isfinite(change).all() else np.zeros_like(change)
    return found


def projected(
    problem: Problem, point: Point, made: list[dict[str, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """Inner products of the signatures, and with the residual, after everything free has been
    allowed to imitate them.
    """
    count, normal = len(made), point.normal
    gram, right, onto = (
        np.zeros((count, count)),
        np.zeros(count),
        np.zeros((len(normal.keys), count)),
    )
    for link in problem.links:
        own = [i for i, difference in enumerate(made) if link in difference]
        if own:
            table = np.column_stack([made[i][link] for i in own])
            gram[np.ix_(own, own)] += table.T @ table
            right[own] += table.T @ point.residual[link]
            positions, columns = point.columns[link]
            onto[np.ix_(positions, own)] += columns.T @ table
    free = ~normal.frozen
    matrix = normal.matrix.sum(axis=(0, 1))[np.ix_(free, free)] + np.diag(normal.prior[free])
    matrix += 1e-9 * np.diag(np.diag(matrix) + 1e-9)
    slope = (normal.vector.sum(axis=(0, 1)) + normal.prior * normal.z)[free]
    imitated = np.linalg.solve(matrix, onto[free])
    return gram - onto[free].T @ imitated, right - imitated.T @ slope
