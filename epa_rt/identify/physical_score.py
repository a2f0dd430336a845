"""How good a fitted physical model is: as for the linear ones, from its residuals and their derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import lsq_linear

from epa_rt.identify.data import Trial, closed_path
from epa_rt.identify.scores import Score, loop_figures

if TYPE_CHECKING:
    from epa_rt.identify.physical import Physical

BLOCK_S = 2.0
TWO_SIDED_95 = 1.96
UNSEEN_N = 1e-4         # a number that moves no force by more per its typical size is not seen
Limits = tuple[np.ndarray, np.ndarray]


def seen(table: Sequence[np.ndarray]) -> np.ndarray:
    """(k,) of bool: which numbers change the force at all."""
    return np.max([np.abs(part).max(axis=0) for part in table], axis=0) > UNSEEN_N


def physical_score(model: Physical, values: np.ndarray, data: Sequence[Trial], groups: np.ndarray, holdout: str, residual: list[np.ndarray],
                   table: list[np.ndarray], forces: list[np.ndarray], slower: list[np.ndarray], limits: Limits) -> Score:
    """The score of a fit. ``residual`` and ``table``: per trial (m,) and (m, k), averaged in time and per scale of a number;

    ``forces`` and ``slower``: the model's force (n,) at the measured and at half the speed; ``limits`` of the numbers.
    """
    measured = np.concatenate([trial.force_n for trial in data])
    total, error = float(np.sum((measured - measured.mean()) ** 2)), sum(float(np.sum((t.force_n - f) ** 2)) for t, f in zip(data, forces, strict=True))
    scales = np.array(model.scales)
    room = tuple((end - values) / scales for end in limits)
    left = {kind: _left_out(residual, table, label, room) if holdout in (kind, "both") else float("nan")
            for kind, label in (("trial", np.arange(len(data))), ("pressure", groups))}
    averaged = len(measured) / sum(map(len, residual))
    left = {kind: error + averaged * rise for kind, rise in left.items()}
    width = intervals(residual, table, BLOCK_S * sum(map(len, residual)) / sum(t.samples * t.period_s for t in data)) * scales
    works = np.array([(f @ closed_path(t.length_m), t.force_n @ closed_path(t.length_m)) for t, f in zip(data, forces, strict=True)])
    speed = np.concatenate([t.speed_m_s for t in data])
    damping = 2.0 * float(speed @ (np.concatenate(forces) - np.concatenate(slower))) / float(speed @ speed)
    felt = seen(table)
    columns = np.concatenate(table)[:, felt]
    width[~felt] = np.nan
    return Score(model.name, model.says, dict(zip(model.keys, values.tolist(), strict=True)),
                 {key: (float(np.maximum(v - w, a)), float(np.minimum(v + w, b)))
                  for key, v, w, a, b in zip(model.keys, values, width, *limits, strict=True)},
                 1.0 - error / total, float(np.sqrt(error / len(measured))), 1.0 - left["trial"] / total, 1.0 - left["pressure"] / total,
                 float(np.sqrt(left["trial"] / len(measured))), loop_figures(works)[0], tuple((float(a), float(b)) for a, b in works),
                 loop_figures(works)[1], damping, float(np.linalg.cond(columns / (np.sqrt((columns**2).sum(axis=0)) + 1e-12))))


def _left_out(residual: list[np.ndarray], table: list[np.ndarray], label: np.ndarray, room: Limits) -> float:
    """What the squared error of each label's trials grows by at the linearised optimum of the others, against that of all;
    NaN where there is one label."""
    if len(np.unique(label)) < 2:
        return float("nan")
    best = _optimum(residual, table, range(len(label)), room)
    total = 0.0
    for one in np.unique(label):
        step = _optimum(residual, table, [i for i in range(len(label)) if label[i] != one], room)
        for i in np.flatnonzero(label == one):
            total += float(np.sum((residual[i] + table[i] @ step) ** 2) - np.sum((residual[i] + table[i] @ best) ** 2))
    return total


def _optimum(residual: list[np.ndarray], table: list[np.ndarray], which: Sequence[int], room: Limits) -> np.ndarray:
    matrix, right = np.concatenate([table[i] for i in which]), np.concatenate([residual[i] for i in which])
    size = np.sqrt((matrix**2).sum(axis=0)) + 1e-12
    return lsq_linear(matrix / size, -right, (room[0] * size - 1e-9, room[1] * size + 1e-9)).x / size


def intervals(residual: list[np.ndarray], table: list[np.ndarray], step: float) -> np.ndarray:
    """(k,) half widths of 95 % intervals, in scales: sandwich covariance over blocks of ``step`` values, so that colour counts."""
    step = max(1, round(step))
    pushes = [t[s:s + step].T @ r[s:s + step] for t, r in zip(table, residual, strict=True) for s in range(0, len(r), step)]
    matrix = sum(t.T @ t for t in table)
    size = np.sqrt(np.diag(matrix)) + 1e-12
    inverse = np.linalg.pinv(matrix / np.outer(size, size), rcond=1e-12, hermitian=True) / np.outer(size, size)
    few = len(pushes) / max(len(pushes) - len(matrix), 1)
    covariance = inverse @ (few * sum(np.outer(p, p) for p in pushes)) @ inverse
    return TWO_SIDED_95 * np.sqrt(np.maximum(np.diag(covariance), 0.0))
