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
    table = []
    for name in names:
        values = regular(recording, name)
        spread = float(values.std())
        if not spread > 0.0:
            continue
        own = (values - values.mean()) / spread
        steps = np.gradient(own)
        made = [*(own**power for power in _POWERS), steps, np.sign(steps)]
        table += [_late(one, lag) for one in made for lag in _LAGS]
    if not table:
        return np.zeros((0, 0))
    whole = np.column_stack(table)
    whole -= whole.mean(axis=0)
    size = np.sqrt(np.sum(whole**2, axis=0))
    whole = whole[:, size > 0.0] / size[size > 0.0]
    variance, vectors = np.linalg.eigh(whole.T @ whole)
    kept = variance > _STILL * variance[-1]
    found: np.ndarray = whole @ (vectors[:, kept] / np.sqrt(variance[kept]))
    return found.astype(np.float32)  # a log of minutes has many rows


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


def _late(values: np.ndarray, lag: int) -> np.ndarray:
    return values if not lag else np.concatenate([np.full(lag, values[0]), values[:-lag]])
