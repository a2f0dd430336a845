"""Which terms of a third-order polynomial in pressure, length and speed: the paper's elimination
and sound ways beside it.

All 64 products P^i L^j v^k with i, j, k up to 3 are nearly collinear, so the size of a coefficient
says little about what its term is worth. What a term is worth is what the error grows without it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from epa_rt.identify.linear import Model, Scaled, Sums

ORDER = 3
MOST = 24  # terms that the greedy way goes up to
FEWEST = 5  # as many as eq. 8 has
RISE = 0.005  # fall of R2 below that of all terms at which the paper's elimination stops
TERMS = tuple(product(range(ORDER + 1), repeat=3))
EQ8 = ((1, 1, 0), (1, 0, 1), (0, 0, 2), (2, 0, 1), (0, 0, 0))


@dataclass(frozen=True)
class Step:
    """``terms`` that are in, ``r2`` of their fit, ``condition`` of the regressors, ``gone``: what
    was taken out or put in last.
    """

    terms: tuple[str, ...]
    r2: float
    condition: float
    changed: str


@dataclass(frozen=True)
class Selected:
    """One way to choose terms: ``path`` step by step, ``chosen`` where it stops, ``why``."""

    name: str
    path: tuple[Step, ...]
    chosen: Step
    why: str


def all_terms() -> Model:
    """The polynomial with all 64 terms."""
    return Model("all 64 terms", "third order in P, L, v", tuple(_name(t) for t in TERMS), _columns)


def _columns(part: Scaled) -> np.ndarray:
    powers = [np.stack([np.ones_like(x), x, x * x, x * x * x]) for x in (part.p, part.l, part.v)]
    return np.column_stack([powers[0][i] * powers[1][j] * powers[2][k] for i, j, k in TERMS])


def _name(term: tuple[int, int, int]) -> str:
    made = " ".join(
        f"{letter}^{power}" if power > 1 else letter
        for letter, power in zip("PLv", term, strict=True)
        if power
    )
    return made or "1"


class _System:
    """Normal equations of all terms, and the fit of any subset."""

    def __init__(self, data: Sums) -> None:
        self.matrix, self.right = data.matrix.sum(axis=0), data.right.sum(axis=0)
        total, square, self.count = data.force.sum(axis=0)
        self.square, self.spread = float(data.square.sum()), float(square - total**2 / self.count)
        self.size = np.sqrt(np.diag(self.matrix))
        self.blocks = data

    def solved(self, terms: Sequence[int]) -> np.ndarray:
        size, inverse = self.size[list(terms)], self._inverse(terms)
        return inverse @ (self.right[list(terms)] / size) / size

    def _inverse(self, terms: Sequence[int]) -> np.ndarray:
        """Of the normal equations with columns scaled to one; directions that the data lack are
        left out.
        """
        size = self.size[list(terms)]
        values, vectors = np.linalg.eigh(self.matrix[np.ix_(terms, terms)] / np.outer(size, size))
        kept = np.where(values > 1e-13 * values[-1], 1.0 / np.maximum(values, 1e-300), 0.0)
        return (vectors * kept) @ vectors.T

    def cost_of_leaving(self, terms: Sequence[int]) -> np.ndarray:
        """What the squared error grows by when a term alone is dropped: its coefficient squared
        over its own variance.
        """
        inverse = self._inverse(terms)
        own = inverse @ (self.right[list(terms)] / self.size[list(terms)])
        return own**2 / np.maximum(np.diag(inverse), 1e-300)

    def r2(self, terms: Sequence[int]) -> float:
        return (
            1.0 - (self.square - float(self.solved(terms) @ self.right[list(terms)])) / self.spread
        )

    def condition(self, terms: Sequence[int]) -> float:
        size = self.size[list(terms)]
        values = np.linalg.eigvalsh(self.matrix[np.ix_(terms, terms)] / np.outer(size, size))
        return float(np.sqrt(values[-1] / max(values[0], 1e-300)))

    def step(self, terms: Sequence[int], changed: int | None) -> Step:
        return Step(
            tuple(_name(TERMS[t]) for t in terms),
            self.r2(terms),
            self.condition(terms),
            _name(TERMS[changed]) if changed is not None else "",
        )


def select_terms(
    data: Sums,
    effective_samples: float,
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> list[Selected]:
    """The paper's elimination, drop-least-R2, greedy forward, forward by BIC, and eq. 8's own
    terms.

    ``data``: Sums of ``all_terms``. ``effective_samples``: how many independent ones the residual
    is worth, for the BIC.
    """
    system = _System(data)
    progress("terms: elimination of the smallest coefficient", 0.0)
    paper = _paper(system)
    progress("terms: elimination of the least R2", 0.4)
    backward = _backward(system)
    progress("terms: greedy forward", 0.7)
    forward = _forward(system, MOST)
    own = system.step([TERMS.index(t) for t in EQ8], None)
    return [
        paper,
        backward,
        *_stopped(system, forward, effective_samples),
        Selected("terms of eq. 8", (own,), own, "as published"),
    ]


def _paper(system: _System) -> Selected:
    """Drops the smallest normalised coefficient while R2 stays within RISE of all terms'; the path
    goes on to FEWEST.
    """
    terms = list(range(len(TERMS)))
    path, chosen = [system.step(terms, None)], None
    while len(terms) > FEWEST:
        gone = terms[int(np.argmin(np.abs(system.solved(terms))))]
        terms = [t for t in terms if t != gone]
        path.append(system.step(terms, gone))
        if chosen is None and path[-1].r2 < path[0].r2 - RISE:
            chosen = path[-2]
    return Selected(
        "paper: drop the smallest coefficient",
        tuple(path),
        chosen or path[-1],
        f"stops before R2 falls {RISE:g} below that of all terms; {FEWEST} terms are at the end of"
        " its path",
    )


def _backward(system: _System) -> Selected:
    """Drops the term whose loss costs least R2, down to FEWEST."""
    terms = list(range(len(TERMS)))
    path = [system.step(terms, None)]
    while len(terms) > FEWEST:
        gone = terms[int(np.argmin(system.cost_of_leaving(terms)))]
        terms = [t for t in terms if t != gone]
        path.append(system.step(terms, gone))
    return Selected(
        "backward: drop the least R2",
        tuple(path),
        path[-1],
        f"down to {FEWEST} terms, as many as eq. 8",
    )


def _forward(system: _System, most: int) -> list[tuple[list[int], Step]]:
    terms: list[int] = []
    found = []
    while len(terms) < most:
        new = max(
            (t for t in range(len(TERMS)) if t not in terms), key=lambda t: system.r2([*terms, t])
        )
        terms = [*terms, new]
        found.append((terms, system.step(terms, new)))
    return found


def _stopped(system: _System, forward, effective: float) -> list[Selected]:
    """The greedy path cut at FEWEST terms, and where the BIC with effective samples stops."""
    path = tuple(step for _, step in forward)
    bic = [
        effective * np.log(max(1.0 - step.r2, 1e-12)) + len(terms) * np.log(effective)
        for terms, step in forward
    ]
    best = int(np.argmin(bic))
    return [
        Selected(
            "forward: add the most R2", path, path[FEWEST - 1], f"{FEWEST} terms, as many as eq. 8"
        ),
        Selected(
            "forward, stopped by BIC",
            path[: best + 1],
            path[best],
            f"{effective:.0f} effective"
            f" samples{'' if best < len(path) - 1 else f'; its path ends at {MOST} terms'}",
        ),
    ]


def effective_samples(residuals: Sequence[np.ndarray]) -> float:
    """Samples over the integrated autocorrelation time of a fit's residuals, by batch means over 2
    000 samples.
    """
    count = sum(len(r) for r in residuals)
    batches = np.concatenate(
        [r[: len(r) // 2000 * 2000].reshape(-1, 2000).mean(axis=1) for r in residuals]
    )
    variance = float(np.mean(np.concatenate(residuals) ** 2))
    if len(batches) < 2 or variance == 0.0:
        return float(count)
    return float(
        np.clip(len(batches) * variance / max(float(np.var(batches)), 1e-300), 10.0, count)
    )
