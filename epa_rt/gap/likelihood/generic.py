"""The data-driven residual model: how much of a link's residual can be explained at all, and by
what.

It is the yardstick of the open set: an effect that explains little of what this explains is not the
cause. A ridge regression on the terms of ``regressors.py`` in whitened space, always judged on
blocks that it has not seen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.likelihood.floor import Floor
from epa_rt.gap.likelihood.regressors import terms

BLOCK_S = 4.0  # short enough that every fold sees all that an experiment does
FOLDS = 5
RIDGES = (1e-4, 1e-3, 1e-2, 1e-1, 1.0)  # per sample, of columns that have unit square once whitened
RANKED_RIDGE = 1e-2
# deviations beyond which a term is cut off: a rare extreme on a block left out would rule the whole
# sum
CLIP = 4.0
MOST_GROUPS = 6


@dataclass(frozen=True)
class GenericFit:
    """``before`` and ``after``: chi-square per whitened sample, without the model and with it on
    blocks left out.

    ``misfit`` (s^2, at least 1) is what even this model leaves. ``explained`` is the part of the
    excess (before - 1) that it explains. ``ranked``: groups of terms in the order in which they
    help most, with the part of the excess that all up to and including this one explain together.
    """

    link: str
    samples: int
    before: float
    after: float
    explained: float
    ranked: tuple[tuple[str, float], ...]

    @property
    def misfit(self) -> float:
        """s^2, the chi-square per whitened sample that even this model leaves; at least 1."""
        return max(self.after, 1.0)


@dataclass(frozen=True)
class Design:
    """Whitened terms of a link over several recordings, made once and used for every residual of
    theirs.

    ``blocks``: per block its recording, its rows in there, which of them count, its terms (n, k)
    and its fold. ``matrices``: by fold (k, k). ``judged``: recording name to which samples have a
    residual and all terms.
    """

    names: tuple[str, ...]
    slices: Mapping[str, slice]
    floor: Floor
    judged: Mapping[str, np.ndarray]
    blocks: tuple[tuple[str, slice, np.ndarray, np.ndarray, int], ...]
    matrices: tuple[np.ndarray, ...]


@dataclass
class _Grams:
    """Normal equations by fold: G (k, k), b (k,), r'r and the number of samples."""

    matrices: Sequence[np.ndarray]
    rights: list[np.ndarray]
    squares: list[float]
    samples: list[int]


def designed(
    residuals: Mapping[str, np.ndarray],
    states: Mapping[str, Mapping[str, np.ndarray]],
    floor: Floor,
    rate_hz: float,
) -> Design:
    """The terms of a link. ``residuals``: recording name to (n,), NaN where not judged; ``states``:
    to ``Subject.features``.
    """
    names, columns, slices = _columns(states, rate_hz)
    size = max(
        round(BLOCK_S * rate_hz), 2 * len(floor.ar)
    )  # whitening takes the first rows of every block: of a slow rig's it would take all
    judged, blocks = {}, []
    for recording, residual in residuals.items():
        table = np.column_stack([columns[recording], np.ones(len(residual))])
        judged[recording] = np.isfinite(residual) & np.isfinite(table).all(axis=1)
        table[~judged[recording]] = np.nan
        for start in range(0, len(table), size):
            rows, fold = slice(start, min(start + size, len(table))), len(blocks) % FOLDS
            white = floor.whiten(table[rows])
            keep = np.isfinite(white).all(axis=1)
            blocks.append((recording, rows, keep, white[keep], fold))
    return Design(tuple(names), slices, floor, judged, *_scaled(blocks))


def _scaled(blocks: list) -> tuple[tuple, tuple[np.ndarray, ...]]:
    """Blocks with every whitened column scaled to unit mean square, so that one ridge fits them
    all, and their matrices by fold.
    """
    samples = max(sum(len(white) for *_, white, _ in blocks), 1)
    size = np.sqrt(sum(np.sum(white**2, axis=0) for *_, white, _ in blocks) / samples)
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    made = [(*place, (white * scale).astype(np.float32), fold) for *place, white, fold in blocks]
    matrices = [np.zeros((len(size), len(size))) for _ in range(FOLDS)]
    for *_, white, fold in made:
        wide = white.astype(float)
        matrices[fold] += wide.T @ wide
    return tuple(made), tuple(matrices)


def fit_generic(
    link: str, residuals: Mapping[str, np.ndarray], design: Design, ranked: bool = True
) -> GenericFit:
    """Fits and judges the model for one link over several recordings.

    ``residuals``: recording name to (n,), in the link's unit, bias already taken off, NaN where
    those of ``design`` were. ``ranked`` False leaves the (slower) ranking of the groups out.
    """
    grams = _grams(residuals, design)
    total = sum(grams.samples)
    if total == 0:
        return GenericFit(link, 0, 1.0, 1.0, 0.0, ())
    before = sum(grams.squares) / total
    everything = np.arange(grams.matrices[0].shape[0])
    after = min(_left_out(grams, everything, ridge) for ridge in RIDGES) / total
    after = min(after, before)
    excess = max(before - 1.0, 1e-12)
    order = (
        _ranking(grams, design.names, design.slices, before, excess, total)
        if ranked and before > after
        else ()
    )
    return GenericFit(link, total, before, after, (before - after) / excess, order)


def _columns(states: Mapping[str, Mapping[str, np.ndarray]], rate_hz: float):
    """Names of the groups that every recording has, the scaled columns by recording, and each
    group's columns.
    """
    made = {recording: terms(found, rate_hz) for recording, found in states.items()}
    shared = [
        name
        for name in next(iter(made.values()))
        if all(name in groups for groups in made.values())
    ]
    slices, start = {}, 0
    for name in shared:
        width = next(iter(made.values()))[name].shape[1]
        slices[name] = slice(start, start + width)
        start += width
    nothing = {
        recording: np.empty((len(next(iter(found.values()))), 0))
        for recording, found in states.items()
    }  # where all stands still no group is left
    stacked = {
        recording: np.column_stack([nothing[recording], *(groups[name] for name in shared)])
        for recording, groups in made.items()
    }
    everything = np.concatenate(list(stacked.values()))
    known = np.isfinite(everything)
    many = np.maximum(known.sum(axis=0), 1)  # a memory of what stands still has no value at all
    centre = np.where(known, everything, 0.0).sum(axis=0) / many
    spread = np.sqrt(np.where(known, (everything - centre) ** 2, 0.0).sum(axis=0) / many)
    spread[~(spread > 0.0)] = 1.0
    return (
        shared,
        {
            recording: np.clip((values - centre) / spread, -CLIP, CLIP)
            for recording, values in stacked.items()
        },
        slices,
    )


def _grams(residuals: Mapping[str, np.ndarray], design: Design) -> _Grams:
    rights = [np.zeros(len(design.matrices[0])) for _ in range(FOLDS)]
    squares, samples = [0.0] * FOLDS, [0] * FOLDS
    for recording, rows, keep, white, fold in design.blocks:
        whole = np.where(design.judged[recording][rows], residuals[recording][rows], np.nan)
        r = design.floor.whiten(whole)[keep]
        rights[fold] += r @ white
        squares[fold] += float(r @ r)
        samples[fold] += len(r)
    return _Grams(design.matrices, rights, squares, samples)


def _left_out(grams: _Grams, chosen: np.ndarray, ridge: float) -> float:
    """Chi-square on every fold of the model fitted to the others, summed; folds without samples are
    passed over.
    """
    pick = np.ix_(chosen, chosen)
    matrix, right = sum(grams.matrices)[pick], sum(grams.rights)[chosen]
    priced = (ridge * max(sum(grams.samples), 1)) * np.eye(len(chosen))
    total = 0.0
    for m, b, square in zip(grams.matrices, grams.rights, grams.squares, strict=True):
        inner, own = m[pick], b[chosen]
        fitted = np.linalg.solve(matrix - inner + priced, right - own)
        total += square - 2.0 * fitted @ own + fitted @ inner @ fitted
    return total


def _ranking(
    grams: _Grams,
    names: Sequence[str],
    slices: Mapping[str, slice],
    before: float,
    excess: float,
    total: int,
):
    """Greedy choice of groups by what they explain on the blocks left out, until nothing helps."""
    chosen = np.array([grams.matrices[0].shape[0] - 1])
    best, order, free = before, [], list(names)
    for _ in range(MOST_GROUPS):
        scored = [
            (
                _left_out(
                    grams,
                    np.concatenate([chosen, np.arange(grams.matrices[0].shape[0])[slices[name]]]),
                    RANKED_RIDGE,
                )
                / total,
                name,
            )
            for name in free
        ]
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
