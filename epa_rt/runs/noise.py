"""How much two recordings of one signal may differ by chance, estimated from the recordings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BLOCK_S = 0.1
"""Means are compared over this long: longer than any sensor's lag here, shorter than a stroke."""

LATE_CYCLES = 3
"""A phase begins on a whole cycle, and a measured value is up to two cycles old."""

SIGMAS = 5.0
"""A mean of Gaussian noise is further off once in two million; a comparison looks at 1e4 of them
and asks for two in a row.
"""

_OF_MAD = 1.4826  # standard deviation of a Gaussian by its median absolute deviation
_FEWEST = 20  # differences of neighbours that one phase's own noise is estimated from
_DUST = 1e-9  # of the largest value: steps below are rounding of floats, no counts


@dataclass(frozen=True)
class Blocks:
    """Two stretches of one signal as means over blocks, all (N,), in the signal's unit.

    ``late``: how far a mean moves if its block begins up to LATE_CYCLES earlier or later.
    """

    a: np.ndarray
    b: np.ndarray
    late: np.ndarray

    @property
    def difference(self) -> np.ndarray:
        """B less A; NaN where either has no value."""
        found: np.ndarray = self.b - self.a
        return found


def block_samples(period_s: float) -> int:
    """Samples of a block, one at least."""
    return max(round(BLOCK_S / period_s), 1)


def blocks_of(a: np.ndarray, b: np.ndarray, n: int) -> Blocks:
    """Means over blocks of ``n`` samples of two stretches that begin together; what is left over
    at the end is dropped. A block of which half is NaN has the mean NaN.
    """
    count = min(len(a), len(b)) // n
    pair = [x[: count * n] for x in (a, b)]
    return Blocks(_means(pair[0], n), _means(pair[1], n), np.maximum(*(_late(x, n) for x in pair)))


def _means(values: np.ndarray, n: int) -> np.ndarray:
    table = values.reshape(-1, n)
    there = np.isfinite(table)
    counts = there.sum(axis=1)
    sums = np.where(there, table, 0.0).sum(axis=1)
    return np.where(2 * counts > n, sums / np.maximum(counts, 1), np.nan)


def _late(values: np.ndarray, n: int) -> np.ndarray:
    here = _means(values, n)
    worst = np.zeros(len(here))
    for cycles in range(1, LATE_CYCLES + 1):
        padded = np.pad(values, cycles, mode="edge") if len(values) else values
        for shifted in (padded[2 * cycles :], padded[: len(values)]):
            worst = np.fmax(worst, np.abs(_means(shifted[: len(values)], n) - here))
    return worst


def step_of(values: np.ndarray) -> float:
    """The smallest step between two values: one count of the converter; 0 where none is seen."""
    finite = values[np.isfinite(values)]
    steps = np.abs(np.diff(finite))
    steps = steps[steps > _DUST * np.abs(finite).max(initial=0.0)]
    return float(steps.min()) if len(steps) else 0.0


def sample_noise(a: np.ndarray, b: np.ndarray) -> float:
    """Standard deviation of one sample's noise, from the sample-to-sample changes of B - A.

    What both runs do alike falls out of the difference, and what changes slowly out of its steps.
    """
    count = min(len(a), len(b))
    steps = np.diff(b[:count] - a[:count])
    steps = steps[np.isfinite(steps)]
    if not len(steps):
        return 0.0
    usual = np.percentile(np.abs(steps), 99.0)  # jumps of a signal are no noise
    return float(np.sqrt(np.mean(np.minimum(np.abs(steps), usual) ** 2) / 4.0))


def own_noise(values: np.ndarray, step: float) -> float:
    """Standard deviation of one recording's own noise, from its second differences, in which a
    motion leaves little; at least half of ``step``, by which a value between two counts flickers.
    """
    bends = np.abs(np.diff(values, 2))
    bends = bends[np.isfinite(bends)]
    least = 0.5 * step
    if not len(bends):
        return float(least)
    usual = np.percentile(bends, 99.0)
    return float(max(np.sqrt(np.mean(np.minimum(bends, usual) ** 2) / 6.0), least))


def rounding(step: float, noise: float) -> float:
    """How far means may be apart because converters round to ``step``, with ``noise`` before them.

    Undithered, by one count; noise averages it out: the ripple of a quantiser's mean falls with
    exp(-2 pi^2 noise^2 / step^2) (Widrow, Kollar: Quantization Noise, 2008).
    """
    if step <= 0.0:
        return 0.0
    counts = min(noise / step, 100.0)  # beyond which nothing of the ripple is left
    before = max(counts**2 - 1.0 / 12.0, 0.0)
    return step * float(np.exp(-2.0 * np.pi**2 * before))


def block_noise(phases: list[np.ndarray]) -> list[float]:
    """Standard deviation of B - A over a block for each phase, from the differences of
    neighbouring blocks (Allan deviation, by the median): a lasting difference does not enter.

    ``phases``: the differences (N,) of each phase. A phase of few blocks takes that of all.
    """
    steps = [np.abs(np.diff(d)) for d in phases]
    steps = [step[np.isfinite(step)] for step in steps]
    pooled = _sigma(np.concatenate(steps)) if steps else 0.0
    return [max(_sigma(step), pooled) if len(step) >= _FEWEST else pooled for step in steps]


def _sigma(steps: np.ndarray) -> float:
    return _OF_MAD * float(np.median(steps)) / np.sqrt(2.0) if len(steps) else 0.0
