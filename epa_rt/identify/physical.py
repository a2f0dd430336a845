"""Physical force models: the plant's own muscle block, its numbers fitted to the trials by
Gauss-Newton within bounds.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from epa_rt.identify.data import Trial
from epa_rt.identify.physical_score import physical_score, seen
from epa_rt.identify.scores import Score
from epa_rt.models.blocks.muscle import muscle_over_log
from epa_rt.models.knobs import read_knob, row_of, write_knob

MEAN_S = 0.02  # residuals are averaged over so long before they are fitted
ROUNDS = 8
ARRIVED = 1e-4
WORKERS = 2


@dataclass(frozen=True)
class Physical:
    """``keys``: numbers that are fitted, ``starts`` where from (None: the plant file's), ``scales``
    their typical sizes.
    """

    name: str
    says: str
    keys: tuple[str, ...]
    starts: tuple[float | None, ...]
    scales: tuple[float, ...]


_HELD = (
    "muscle0.end_length_m",
    "muscle0.bladder_stiffness_n_m",
    "muscle0.lock_stiffness_n_m",
    "muscle0.lock_length_m",
)
_HELD_STARTS, _HELD_SCALES = (0.0, 100.0, 1e4, None), (1e-3, 100.0, 5e3, 1e-3)
MODELS: tuple[Physical, ...] = (
    Physical(
        "physical",
        "eq. 1 with b and n, viscous damping, braid friction as Maxwell slip",
        (
            "muscle0.braid_length_m",
            "muscle0.braid_turns_ratio",
            "muscle0.viscous_n_s_m",
            "muscle0.slip_ratio",
        ),
        (None, None, None, 0.03),
        (1e-3, 0.05, 2.0, 0.02),
    ),
    Physical(
        "physical, held",
        "the same with end fittings, bladder spring and a braid that locks; b as in the plant file",
        ("muscle0.braid_turns_ratio", "muscle0.viscous_n_s_m", "muscle0.slip_ratio", *_HELD),
        (None, None, 0.03, *_HELD_STARTS),
        (0.05, 2.0, 0.02, *_HELD_SCALES),
    ),
    Physical(
        "physical, held, Dahl",
        "the same with Dahl friction in place of Maxwell slip",
        (
            "muscle0.braid_turns_ratio",
            "muscle0.viscous_n_s_m",
            "muscle0.dahl_ratio",
            "muscle0.dahl_m",
            *_HELD,
        ),
        (None, None, 0.03, 1e-3, *_HELD_STARTS),
        (0.05, 2.0, 0.02, 5e-4, *_HELD_SCALES),
    ),
)


@dataclass(frozen=True)
class PhysicalFit:
    """``params``: (1,) PARAMS with the fitted numbers; ``at_bound``: those that stand at an end of
    what the plant allows, ``unseen``: those that change nothing in these trials, which say nothing
    of them.
    """

    model: Physical
    params: np.ndarray
    score: Score
    at_bound: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()


def predicted(params: np.ndarray, trial: Trial) -> np.ndarray:
    """Force (n,) of the plant's muscle along a trial."""
    return muscle_over_log(
        params, trial.gauge_pa, trial.length_m, trial.speed_m_s, 0, trial.period_s
    )


def fit_physical(
    model: Physical,
    params: np.ndarray,
    data: Sequence[Trial],
    groups: np.ndarray,
    holdout: str = "both",
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> PhysicalFit:
    """Fits one model from a plant's ``params``; ``groups`` (trials,) and ``holdout`` as for the
    linear models.

    What is not fitted stays as in the plant file. Scores on trials left out are those of the fit's
    linearisation: one Gauss-Newton solution without the trial, within the same bounds.
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
    forces = [predicted(fitted, trial) for trial in data]
    slower = [predicted(fitted, replace(trial, speed_m_s=0.5 * trial.speed_m_s)) for trial in data]
    low, high = limits(model)
    judged = physical_score(
        model, at, data, groups, holdout, residual, table, forces, slower, (low, high)
    )
    unseen = tuple(key for key, felt in zip(model.keys, seen(table), strict=True) if not felt)
    return PhysicalFit(
        model,
        fitted,
        judged,
        tuple(
            key
            for key, v, a, b in zip(model.keys, at, low, high, strict=True)
            if key not in unseen and (v <= a or v >= b)
        ),
        unseen,
    )


def limits(model: Physical) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest value of every fitted number that a plant file may have."""
    return np.array([row_of(key)[1].low for key in model.keys]), np.array(
        [row_of(key)[1].high for key in model.keys]
    )


def _with(params: np.ndarray, keys: Sequence[str], values: np.ndarray) -> np.ndarray:
    found = params.copy()
    for key, value in zip(keys, values, strict=True):
        write_knob(found, key, float(value))
    return found


def _residuals(
    model: Physical, params: np.ndarray, values: np.ndarray, data: Sequence[Trial]
) -> list[np.ndarray]:
    chosen = _with(params, model.keys, values)
    with ThreadPoolExecutor(WORKERS) as pool:
        return list(
            pool.map(lambda trial: _averaged(trial.force_n - predicted(chosen, trial), trial), data)
        )


def _averaged(values: np.ndarray, trial: Trial) -> np.ndarray:
    step = max(1, round(MEAN_S / trial.period_s))
    whole = len(values) // step * step
    return values[:whole].reshape(-1, step).mean(axis=1)


def _table(
    model: Physical,
    params: np.ndarray,
    values: np.ndarray,
    data: Sequence[Trial],
    here: list[np.ndarray],
) -> list[np.ndarray]:
    """Per trial (m, k): change of the residual per scale of a number."""
    columns = []
    for i, (key, scale) in enumerate(zip(model.keys, model.scales, strict=True)):
        row = row_of(key)[1]
        step = 1e-2 * scale if values[i] + 1e-2 * scale <= row.high else -1e-2 * scale
        moved = values.copy()
        moved[i] += step
        columns.append(
            [
                (new - old) * (scale / step)
                for new, old in zip(_residuals(model, params, moved, data), here, strict=True)
            ]
        )
    return [np.column_stack([column[t] for column in columns]) for t in range(len(data))]


def _stepped(model: Physical, params, values, data, residual, table, damping):
    """A better set of numbers, its residuals and the next damping; None where no step helps."""
    low, high = limits(model)
    scales = np.array(model.scales)
    matrix, right = np.concatenate(table), np.concatenate(residual)
    size = np.sqrt((matrix**2).sum(axis=0)) + 1e-12
    for _ in range(5):
        stacked = np.concatenate([matrix, np.diag(np.sqrt(damping) * size)])
        step = lsq_linear(
            stacked,
            np.concatenate([-right, np.zeros(len(size))]),
            ((low - values) / scales - 1e-12, (high - values) / scales + 1e-12),
        ).x
        after = np.clip(values + step * scales, low, high)
        new = _residuals(model, params, after, data)
        if _square(new) < _square(residual):
            return after, new, max(damping / 10.0, 1e-9)
        damping = max(damping, 1e-4) * 10.0
    return None


def _square(residual: list[np.ndarray]) -> float:
    return float(sum(r @ r for r in residual))
