"""The share of a gap that is closed, with its interval: squares per block, resampled by log and by
block.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

NO_GAP = 1.05  # before below so many times the floor: no gap to close
RESAMPLES = 1000
INTERVAL = (2.5, 97.5)


class Squares(NamedTuple):
    """Squared misfits of one channel in one log, a row per block of 1 to 2 s: (blocks,) sums, and
    samples in each.

    ``floor``: the same of the noise floor, or a constant times the samples where only its rms is
    known.
    """

    before: np.ndarray
    after: np.ndarray
    floor: np.ndarray
    samples: np.ndarray


class Share(NamedTuple):
    """rms before and after, floor, and ``closed`` = 1 - (after^2 - floor^2)/(before^2 - floor^2),
    never clipped.

    ``closed`` is None where before does not rise above the floor, ``interval`` (95 %) also where a
    single block is all.
    """

    before: float
    after: float
    floor: float
    closed: float | None
    interval: tuple[float, float] | None

    @property
    def times_floor(self) -> float:
        return self.after / self.floor


def squares(
    before: np.ndarray, after: np.ndarray, floor: np.ndarray | float, samples_per_block: int
) -> Squares:
    """Sums over blocks of three misfits (n,); samples that are NaN in any are left out. Blocks
    stay, also empty ones.
    """
    floor = np.full(len(before), float(floor)) if np.isscalar(floor) else floor
    judged = np.isfinite(before) & np.isfinite(after) & np.isfinite(floor)
    blocks = np.arange(len(before)) // samples_per_block
    count = -(-len(before) // samples_per_block)
    sums = [
        np.bincount(blocks[judged], x[judged] ** 2, minlength=count) for x in (before, after, floor)
    ]
    return Squares(*sums, np.bincount(blocks[judged], minlength=count).astype(float))


def share(logs: Sequence[Squares], seed: int = 0) -> Share | None:
    """The share over all logs; None where nothing was judged. Logs are resampled where there are
    several, blocks always.
    """
    rows = [np.column_stack(log)[log.samples > 0] for log in logs]
    rows = [one for one in rows if len(one)]
    if not rows:
        return None
    before2, after2, floor2 = _means(np.concatenate(rows))
    rms = [float(np.sqrt(x)) for x in (before2, after2, floor2)]
    if not floor2 > 0.0 or before2 <= NO_GAP**2 * floor2:
        return Share(*rms, None, None)
    return Share(*rms, float(_closed(before2, after2, floor2)), _interval(rows, seed))


def _interval(rows: Sequence[np.ndarray], seed: int) -> tuple[float, float] | None:
    """``rows``: per log (blocks, 4)."""
    if sum(map(len, rows)) < 2:
        return None
    rng = np.random.default_rng(seed)
    chosen = rng.integers(
        len(rows), size=(RESAMPLES, len(rows))
    )  # which logs a resample is made of
    sums = np.zeros((RESAMPLES, 4))
    for i, log in enumerate(rows):
        times = (chosen == i).sum(axis=1)
        for k in range(times.max()):
            drawn = np.flatnonzero(times > k)
            sums[drawn] += log[rng.integers(len(log), size=(len(drawn), len(log)))].sum(axis=1)
    closed = _closed(*(sums[:, :3] / sums[:, 3:]).T)
    closed = closed[np.isfinite(closed)]
    if not closed.size:
        return None
    low, high = np.percentile(closed, INTERVAL)
    return float(low), float(high)


def _means(rows: np.ndarray) -> np.ndarray:
    return rows[:, :3].sum(axis=0) / rows[:, 3].sum()


def _closed(before2: np.ndarray, after2: np.ndarray, floor2: np.ndarray) -> np.ndarray:
    """NaN where a resample has no gap: it says nothing of how much of one is closed."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(before2 > floor2, 1.0 - (after2 - floor2) / (before2 - floor2), np.nan)
