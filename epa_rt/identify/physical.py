"""Physical force models: the plant's own muscle block, its numbers fitted to the trials by Gauss-Newton within bounds."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from epa_rt.identify.data import Trial
from epa_rt.identify.scores import Score
from epa_rt.models.blocks.muscle import muscle_over_log
from epa_rt.models.knobs import read_knob, row_of, write_knob

MEAN_S = 0.02          # residuals are averaged over so long before they are fitted
BLOCK_S = 2.0
ROUNDS = 8
ARRIVED = 1e-4
TWO_SIDED_95 = 1.96
WORKERS = 2


@dataclass(frozen=True)
class Physical:
    """``keys``: numbers that are fitted, ``starts`` where from (None: the plant file's), ``scales`` their typical sizes."""

    name: str
    says: str
    keys: tuple[str, ...]
    starts: tuple[float | None, ...]
    scales: tuple[float, ...]


MODELS: tuple[Physical, ...] = (
    Physical("physical: McKibben, damping, braid friction", "eq. 1 with b and n, viscous damping, Maxwell slip",
             ("muscle.braid_length_m", "muscle.braid_turns_ratio", "muscle.viscous_n_s_m", "muscle.slip_ratio"),
             (None, None, None, 0.03), (1e-3, 0.05, 2.0, 0.02)),
    Physical("physical: and fittings, bladder, lock", "the same with end fittings, bladder spring and a locking braid",
             ("muscle.braid_turns_ratio", "muscle.viscous_n_s_m", "muscle.slip_ratio", "muscle.end_length_m",
              "muscle.bladder_stiffness_n_m", "muscle.lock_stiffness_n_m", "muscle.lock_length_m"),
             (None, None, 0.03, 0.0, 100.0, 1e4, None), (0.05, 2.0, 0.02, 1e-3, 100.0, 5e3, 1e-3)),
)


@dataclass(frozen=True)
class PhysicalFit:
    """``params``: (1,) PARAMS with the fitted numbers; ``errors``: force, predicted minus measured, per trial (m,) averages."""

    model: Physical
    params: np.ndarray
    score: Score


def predicted(params: np.ndarray, trial: Trial) -> np.ndarray:
    """Force (n,) of the plant's muscle along a trial."""
    return muscle_over_log(params, trial.gauge_pa, trial.length_m, trial.speed_m_s, 0, trial.period_s)


def fit_physical(model: Physical, params: np.ndarray, data: Sequence[Trial], groups: np.ndarray,
                 progress: Callable[[str, float], None] = lambda stage, share: None) -> PhysicalFit:
    """Fits one model from a plant's ``params``; ``groups`` (trials,) as for the linear models.

    Scores on trials left out are those of the fit's linearisation: one Gauss-Newton solution without the trial.
    """
    start = params.copy()
    lock = max(float(t.length_m.max()) for t in data) - 4e-3
    for key, value in zip(model.keys, model.starts, strict=True):
        if value is not None:
            write_knob(start, key, value)
        elif key.endswith("lock_length_m"):
            write_knob(start, key, lock)
    values = np.array([read_knob(start, key) for key in model.keys])
    at, residual, damping = values, _residuals(model, start, values, data), 1e-3
    table = _table(model, start, at, data, residual)
    for turn in range(ROUNDS):
        progress(model.name, turn / ROUNDS)
        better = _stepped(model, start, at, data, residual, table, damping)
        if better is None:
            break
        after, new, damping = better
        arrived = _square(residual) - _square(new) < ARRIVED * _square(residual)
        at, residual = after, new
        table = _table(model, start, at, data, residual)
        if arrived:
            break
    fitted = _with(start, model.keys, at)
    return PhysicalFit(model, fitted, _score(model, fitted, at, data, groups, residual, table))


def _with(params: np.ndarray, keys: Sequence[str], values: np.ndarray) -> np.ndarray:
    found = params.copy()
    for key, value in zip(keys, values, strict=True):
        write_knob(found, key, float(value))
    return found


def _residuals(model: Physical, params: np.ndarray, values: np.ndarray, data: Sequence[Trial]) -> list[np.ndarray]:
    chosen = _with(params, model.keys, values)
    with ThreadPoolExecutor(WORKERS) as pool:
        return list(pool.map(lambda trial: _averaged(trial.force_n - predicted(chosen, trial), trial), data))


def _averaged(values: np.ndarray, trial: Trial) -> np.ndarray:
    step = max(1, round(MEAN_S / trial.period_s))
    whole = len(values) // step * step
    return values[:whole].reshape(-1, step).mean(axis=1)


def _table(model: Physical, params: np.ndarray, values: np.ndarray, data: Sequence[Trial], here: list[np.ndarray]) -> list[np.ndarray]:
    """Per trial (m, k): change of the residual per scale of a number."""
    columns = []
    for i, (key, scale) in enumerate(zip(model.keys, model.scales, strict=True)):
        row = row_of(key)[1]
        step = 1e-2 * scale if values[i] + 1e-2 * scale <= row.high else -1e-2 * scale
        moved = values.copy()
        moved[i] += step
        columns.append([(new - old) * (scale / step) for new, old in zip(_residuals(model, params, moved, data), here, strict=True)])
    return [np.column_stack([column[t] for column in columns]) for t in range(len(data))]


def _stepped(model: Physical, params, values, data, residual, table, damping):
    """A better set of numbers, its residuals and the next damping; None where no step helps."""
    low = np.array([row_of(key)[1].low for key in model.keys])
    high = np.array([row_of(key)[1].high for key in model.keys])
    scales = np.array(model.scales)
    matrix, right = np.concatenate(table), np.concatenate(residual)
    size = np.sqrt((matrix**2).sum(axis=0)) + 1e-12
    for _ in range(5):
        stacked = np.concatenate([matrix, np.diag(np.sqrt(damping) * size)])
        step = lsq_linear(stacked, np.concatenate([-right, np.zeros(len(size))]), ((low - values) / scales - 1e-12, (high - values) / scales + 1e-12)).x
        after = np.clip(values + step * scales, low, high)
        new = _residuals(model, params, after, data)
        if _square(new) < _square(residual):
            return after, new, max(damping / 10.0, 1e-9)
        damping = max(damping, 1e-4) * 10.0
    return None


def _square(residual: list[np.ndarray]) -> float:
    return float(sum(r @ r for r in residual))


def _score(model: Physical, params: np.ndarray, values: np.ndarray, data: Sequence[Trial], groups: np.ndarray, residual, table) -> Score:
    full = [trial.force_n - predicted(params, trial) for trial in data]
    force = np.concatenate([trial.force_n for trial in data])
    total, error = float(np.sum((force - force.mean()) ** 2)), _square(full)
    works = [(float(trial.force_n @ np.gradient(trial.length_m)), float(r @ np.gradient(trial.length_m))) for trial, r in zip(data, full, strict=True)]
    labels = np.arange(len(data))
    scale = _square(full) / max(_square(residual), 1e-300)
    left = [_left_out(residual, table, label) * scale for label in (labels, groups)]
    width = intervals(residual, table, data) * np.array(model.scales)
    return Score(model.name, dict(zip(model.keys, values.tolist(), strict=True)),
                 {key: (float(v - w), float(v + w)) for key, v, w in zip(model.keys, values, width, strict=True)},
                 1.0 - error / total, float(np.sqrt(error / len(force))), 1.0 - left[0] / total, 1.0 - left[1] / total,
                 float(np.sqrt(left[0] / len(force))), float(np.mean([abs(lost / work) for work, lost in works if work])),
                 tuple(work for work, _ in works), float(np.linalg.cond(np.concatenate(table) / (np.sqrt((np.concatenate(table)**2).sum(axis=0)) + 1e-12))))


def _left_out(residual: list[np.ndarray], table: list[np.ndarray], label: np.ndarray) -> float:
    """Squared error of each label's trials at the linearised optimum of the others; NaN where there is one label."""
    if len(np.unique(label)) < 2:
        return float("nan")
    total = 0.0
    for one in np.unique(label):
        rest = [i for i in range(len(label)) if label[i] != one]
        step = np.linalg.lstsq(np.concatenate([table[i] for i in rest]), -np.concatenate([residual[i] for i in rest]), rcond=1e-10)[0]
        total += sum(float(np.sum((residual[i] + table[i] @ step) ** 2)) for i in range(len(label)) if label[i] == one)
    return total


def intervals(residual: list[np.ndarray], table: list[np.ndarray], data: Sequence[Trial]) -> np.ndarray:
    """(k,) half widths of 95 % intervals, in scales: sandwich covariance over blocks of 2 s, so that colour counts."""
    step = max(1, round(BLOCK_S / MEAN_S))
    pushes = [t[s:s + step].T @ r[s:s + step] for t, r in zip(table, residual, strict=True) for s in range(0, len(r), step)]
    matrix = sum(t.T @ t for t in table)
    inverse = np.linalg.pinv(matrix, rcond=1e-12, hermitian=True)
    few = len(pushes) / max(len(pushes) - len(matrix), 1)
    covariance = inverse @ (few * sum(np.outer(p, p) for p in pushes)) @ inverse
    return TWO_SIDED_95 * np.sqrt(np.maximum(np.diag(covariance), 0.0))
