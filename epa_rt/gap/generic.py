"""The data-driven residual model: how much of a link's residual can be explained at all, and by what.

It is the yardstick of the open set: an effect that explains little of what this explains is not the cause. A ridge
regression on the terms of ``regressors.py`` in whitened space, always judged on blocks that it has not seen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.floor import Floor
from epa_rt.gap.regressors import terms

BLOCK_S = 10.0
FOLDS = 5
RIDGES = (1e-1, 1e1, 1e3)   # in units of the floor's variance; columns have unit variance before whitening
MOST_GROUPS = 6


@dataclass(frozen=True)
class GenericFit:
    """``before`` and ``after``: chi-square per whitened sample, without the model and with it on blocks left out.

    ``misfit`` (s^2, at least 1) is what even this model leaves. ``explained`` is the part of the excess (before - 1)
    that it explains. ``ranked``: groups of terms in the order in which they help most, with the part of the excess
    that all up to and including this one explain together.
    """

    link: str
    samples: int
    before: float
    after: float
    explained: float
    ranked: tuple[tuple[str, float], ...]

    @property
    def misfit(self) -> float:
        return max(self.after, 1.0)


@dataclass
class _Grams:
    """Normal equations by fold: G (k, k), b (k,), r'r and the number of samples."""

    matrices: list[np.ndarray]
    rights: list[np.ndarray]
    squares: list[float]
    samples: list[int]


def fit_generic(link: str, residuals: Mapping[str, np.ndarray], states: Mapping[str, Mapping[str, np.ndarray]], floor: Floor,
                rate_hz: float, ranked: bool = True) -> GenericFit:
    """Fits and judges the model for one link over several recordings.

    ``residuals``: recording name to (n,), in the link's unit, bias already taken off, NaN where not judged; ``states``:
    recording name to ``Subject.features``. ``ranked`` False leaves the (slower) ranking of the groups out.
    """
    names, columns, slices = _columns(states, rate_hz)
    grams = _grams(residuals, columns, floor, round(BLOCK_S * rate_hz))
    total = sum(grams.samples)
    if total == 0:
        return GenericFit(link, 0, 1.0, 1.0, 0.0, ())
    before = sum(grams.squares) / total
    everything = np.arange(grams.matrices[0].shape[0])
    after = min(_left_out(grams, everything, ridge) for ridge in RIDGES) / total
    after = min(after, before)
    excess = max(before - 1.0, 1e-12)
    order = _ranking(grams, names, slices, before, excess, total) if ranked and before > after else ()
    return GenericFit(link, total, before, after, (before - after) / excess, order)


def _columns(states: Mapping[str, Mapping[str, np.ndarray]], rate_hz: float):
    """Names of the groups that every recording has, the scaled columns by recording, and each group's columns."""
    made = {recording: terms(found, rate_hz) for recording, found in states.items()}
    shared = [name for name in next(iter(made.values())) if all(name in groups for groups in made.values())]
    slices, start = {}, 0
    for name in shared:
        width = next(iter(made.values()))[name].shape[1]
        slices[name] = slice(start, start + width)
        start += width
    stacked = {recording: np.column_stack([groups[name] for name in shared]) for recording, groups in made.items()}
    everything = np.concatenate(list(stacked.values()))
    centre, spread = np.nanmean(everything, axis=0), np.nanstd(everything, axis=0)
    spread[~(spread > 0.0)] = 1.0
    return shared, {recording: (values - centre) / spread for recording, values in stacked.items()}, slices


def _grams(residuals, columns, floor: Floor, block: int) -> _Grams:
    width = next(iter(columns.values())).shape[1] + 1  # the last column is the mean
    grams = _Grams([np.zeros((width, width)) for _ in range(FOLDS)], [np.zeros(width) for _ in range(FOLDS)],
                   [0.0] * FOLDS, [0] * FOLDS)
    fold = 0
    for recording, residual in residuals.items():
        table = np.column_stack([residual, columns[recording], np.ones(len(residual))])
        table[~np.isfinite(table).all(axis=1)] = np.nan
        for start in range(0, len(table), block):
            white = floor.whiten(table[start:start + block])
            white = white[np.isfinite(white).all(axis=1)]
            r, f = white[:, 0], white[:, 1:]
            grams.matrices[fold] += f.T @ f
            grams.rights[fold] += f.T @ r
            grams.squares[fold] += float(r @ r)
            grams.samples[fold] += len(r)
            fold = (fold + 1) % FOLDS
    return grams


def _left_out(grams: _Grams, chosen: np.ndarray, ridge: float) -> float:
    """Chi-square on every fold of the model fitted to the others, summed; folds without samples are passed over."""
    pick = np.ix_(chosen, chosen)
    matrix, right = sum(grams.matrices)[pick], sum(grams.rights)[chosen]
    total = 0.0
    for m, b, square in zip(grams.matrices, grams.rights, grams.squares, strict=True):
        inner, own = m[pick], b[chosen]
        fitted = np.linalg.solve(matrix - inner + ridge * np.eye(len(chosen)), right - own)
        total += square - 2.0 * fitted @ own + fitted @ inner @ fitted
    return total


def _ranking(grams: _Grams, names: Sequence[str], slices: Mapping[str, slice], before: float, excess: float, total: int):
    """Greedy choice of groups by what they explain on the blocks left out, until nothing helps."""
    chosen = np.array([grams.matrices[0].shape[0] - 1])
    best, order, free = before, [], list(names)
    for _ in range(MOST_GROUPS):
        scored = [(_left_out(grams, np.concatenate([chosen, np.arange(grams.matrices[0].shape[0])[slices[name]]]), RIDGES[1]) / total, name)
                  for name in free]
        if not scored:
            break
        left, name = min(scored)
        if left > best - 0.01 * excess:
            break
        best = left
        chosen = np.concatenate([chosen, np.arange(grams.matrices[0].shape[0])[slices[name]]])
        free.remove(name)
        order.append((name, (before - best) / excess))
    return tuple(order)
