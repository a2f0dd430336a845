"""How good a fitted physical model is: as for the linear ones, from its residuals and their
derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import t as t_law

from epa_rt.identify.data import Trial, closed_path
from epa_rt.identify.scores import Score, loop_figures

if TYPE_CHECKING:
    from epa_rt.identify.physical import Physical

BLOCK_S = 2.0
UNSEEN_N = 1e-4  # a number that moves no force by more per its typical size is not seen
Limits = tuple[np.ndarray, np.ndarray]


def seen(table: Sequence[np.ndarray]) -> np.ndarray:
    """(k,) of bool: which numbers change the force at all."""
    return np.max([np.abs(part).max(axis=0) for part in table], axis=0) > UNSEEN_N


def physical_score(
    model: Physical,
    values: np.ndarray,
    data: Sequence[Trial],
    groups: np.ndarray,
    holdout: str,
    residual: list[np.ndarray],
    table: list[np.ndarray],
    forces: list[np.ndarray],
    slower: list[np.ndarray],
    limits: Limits,
) -> Score:
    """The score of a fit. ``residual`` and ``table``: per trial (m,) and (m, k), averaged in time
    and per scale of a number;

    ``forces`` and ``slower``: the model's force (n,) at the measured and at half the speed;
    ``limits`` of the numbers.
    """
    measured = np.concatenate([trial.force_n for trial in data])
    total, error = (
        float(np.sum((measured - measured.mean()) ** 2)),
        sum(float(np.sum((t.force_n - f) ** 2)) for t, f in zip(data, forces, strict=True)),
    )
    scales = np.array(model.scales)
    room = tuple((end - values) / scales for end in limits)
    left = {
        kind: _left_out(residual, table, label, room) if holdout in (kind, "both") else float("nan")
        for kind, label in (("trial", np.arange(len(data))), ("pressure", groups))
    }
    averaged = len(measured) / sum(map(len, residual))
    left = {kind: error + averaged * rise for kind, rise in left.items()}
    width = (
        intervals(
            residual,
            table,
            BLOCK_S * sum(map(len, residual)) / sum(t.samples * t.period_s for t in data),
        )
        * scales
    )
    works = np.array(
        [
            (f @ closed_path(t.length_m), t.force_n @ closed_path(t.length_m))
            for t, f in zip(data, forces, strict=True)
        ]
    )
    speed = np.concatenate([t.speed_m_s for t in data])
    damping = (
        2.0
        * float(speed @ (np.concatenate(forces) - np.concatenate(slower)))
        / float(speed @ speed)
    )
    felt = seen(table)
    columns = np.concatenate(table)[:, felt]
    width[~felt] = np.nan
    return Score(
        model.name,
        model.says,
        dict(zip(model.keys, values.tolist(), strict=True)),
        {
            key: (float(np.maximum(v - w, a)), float(np.minimum(v + w, b)))
            for key, v, w, a, b in zip(model.keys, values, width, *limits, strict=True)
        },
        1.0 - error / total,
        float(np.sqrt(error / len(measured))),
        1.0 - left["trial"] / total,
        1.0 - left["pressure"] / total,
        float(np.sqrt(left["trial"] / len(measured))),
        loop_figures(works)[0],
        tuple((float(a), float(b)) for a, b in works),
        loop_figures(works)[1],
        damping,
        float(np.linalg.cond(columns / (np.sqrt((columns**2).sum(axis=0)) + 1e-12))),
    )


def _left_out(
    residual: list[np.ndarray], table: list[np.ndarray], label: np.ndarray, room: Limits
) -> float:
    """What the squared error of each label's trials grows by at the linearised optimum of the
    others, against that of all; NaN where there is one label.
    """
    if len(np.unique(label)) < 2:
        return float("nan")
    best = _optimum(residual, table, range(len(label)), room)
    total = 0.0
    for one in np.unique(label):
        step = _optimum(residual, table, [i for i in range(len(label)) if label[i] != one], room)
        for i in np.flatnonzero(label == one):
            total += float(
                np.sum((residual[i] + table[i] @ step) ** 2)
                - np.sum((residual[i] + table[i] @ best) ** 2)
            )
    return total


def _optimum(
    residual: list[np.ndarray], table: list[np.ndarray], which: Sequence[int], room: Limits
) -> np.ndarray:
    matrix, right = (
        np.concatenate([table[i] for i in which]),
        np.concatenate([residual[i] for i in which]),
    )
    size = np.sqrt((matrix**2).sum(axis=0)) + 1e-12
    return (
        lsq_linear(matrix / size, -right, (room[0] * size - 1e-9, room[1] * size + 1e-9)).x / size
    )


def intervals(residual: list[np.ndarray], table: list[np.ndarray], step: float) -> np.ndarray:
    """(k,) half widths of 95 % intervals, in scales: the jackknife over blocks of ``step`` values,
    so that colour counts, and so that numbers which only a few blocks show (a lock at the end of
    long strokes) are not believed more than these blocks agree: Student's t with as many degrees of
    freedom as blocks matter (Satterthwaite; normal values have a fourth moment of 3).
    """
    step = max(1, round(step))
    blocks = [
        (t[s : s + step], r[s : s + step])
        for t, r in zip(table, residual, strict=True)
        for s in range(0, len(r), step)
    ]
    matrices, pushes = (
        np.array([t.T @ t for t, _ in blocks]),
        np.array([t.T @ r for t, r in blocks]),
    )
    size = np.sqrt(np.diag(matrices.sum(axis=0))) + 1e-12
    matrices, pushes = matrices / np.outer(size, size), pushes / size
    without = np.linalg.pinv(matrices.sum(axis=0) - matrices, rcond=1e-12, hermitian=True)
    found = np.einsum("bij,bj->bi", without, pushes.sum(axis=0) - pushes) / size
    count, moves = len(blocks), found - found.mean(axis=0)
    freedom = 3.0 * (moves**2).sum(axis=0) ** 2 / np.maximum((moves**4).sum(axis=0), 1e-300)
    return t_law.ppf(0.975, np.clip(freedom, 1.0, max(count - len(size), 1))) * np.sqrt(
        (count - 1) * np.mean(moves**2, axis=0)
    )
