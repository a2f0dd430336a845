"""What of a channel answers to commands and motion, so that a line beside it can be seen.

Least squares on powers of each moving column, its steps and their sign, now and some rows ago. What
is coherent with none of them stays.
"""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.finding import regular
from epa_rt.gap.recording import Recording

_POWERS = (1, 2, 3)
_LAGS = (0, 1, 4, 16)  # rows; a rig answers late
_STILL = 1e-6  # of the largest, below which a direction of the terms is rounding


def terms_of_motion(recording: Recording, names: Sequence[str]) -> np.ndarray:
    """(n, p) columns of unit square, orthogonal, that span what may answer to the named columns;
    without the mean.
    """
    made = []
    for name in names:
        values = regular(recording, name)
        spread = float(values.std())
        if not (np.ptp(values) > 0.0 and spread > 0.0):  # a constant's deviation is rounding
            continue
        own = (values - values.mean()) / spread
        steps = np.gradient(own)
        made += [*(own**power for power in _POWERS), steps, np.sign(steps)]
    if not made:
        return np.zeros((0, 0))
    whole = _late(made)
    whole -= whole.mean(axis=1, keepdims=True)
    size = np.sqrt(np.einsum("pn,pn->p", whole, whole))
    whole = whole[size > 0.0]
    if not len(whole):
        return np.zeros((0, 0))
    whole /= size[size > 0.0, None]
    variance, vectors = np.linalg.eigh(whole @ whole.T)
    kept = variance > _STILL * variance[-1]
    found: np.ndarray = (vectors[:, kept] / np.sqrt(variance[kept])).T @ whole
    return found.astype(np.float32).T  # a log of minutes has many rows


def without_answer(values: np.ndarray, terms: np.ndarray, frequency: float | None) -> np.ndarray:
    """(n,) less what of it the terms (n, p) explain; beside a line of ``frequency`` (cycles a row),
    of which nothing is taken for theirs.
    """
    if not terms.size:
        return values
    answer = values - values.mean()
    if frequency is None:
        return values - terms @ (terms.T @ answer)
    turns = 2.0 * np.pi * frequency * np.arange(len(values))
    line = np.column_stack([np.cos(turns), np.sin(turns)])
    beside = line - terms @ (terms.T @ line)
    weights = np.linalg.lstsq(beside, answer, rcond=None)[0]
    return values - terms @ (terms.T @ (answer - line @ weights))


def _late(made: Sequence[np.ndarray]) -> np.ndarray:
    """(p, n): each of them, (n,), by every lag; the first value stands for those before it."""
    found = np.empty((len(made) * len(_LAGS), len(made[0])))
    late = ((values, lag) for values in made for lag in _LAGS)
    for row, (values, lag) in zip(found, late, strict=True):
        row[:lag], row[lag:] = values[0], values[: len(values) - lag]
    return found
