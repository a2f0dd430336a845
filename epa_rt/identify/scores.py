"""How good a fitted model is: R2, RMS in newtons, loop area, in sample and on trials or pressures that it has not seen."""

from dataclasses import dataclass

import numpy as np

from epa_rt.identify.data import Normalisation
from epa_rt.identify.linear import Fitted, Model, Sums, error_of, fit, resampled


@dataclass(frozen=True)
class Score:
    """``r2`` and ``rms_n`` in sample and left out by trial and by no-load pressure (NaN with one only).

    ``loop_error``: work per trial of the model over that of the measurement (integral of force over length), minus one;
    the mean size over trials. ``intervals``: 95 % by block bootstrap, (j, 2). ``condition``: of the regressors.
    """

    name: str
    coefficients: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    r2: float
    rms_n: float
    r2_trial: float
    r2_pressure: float
    rms_trial_n: float
    loop_error: float
    loop_work_j: tuple[float, ...]
    condition: float


def score(model: Model, data: Sums, groups: np.ndarray, norm: Normalisation) -> tuple[Fitted, Score]:
    """Fits a model and judges it. ``groups`` (trials,): the no-load pressure that each trial belongs to."""
    everything = np.ones(len(data.square))
    found = fit(model, data, everything)
    left_trial = _left_out(model, data, data.trial)
    left_pressure = _left_out(model, data, groups[data.trial])
    count = data.force[:, 2].sum()
    inside = error_of(data, found.coefficients, everything > 0)
    names = free_names(model)
    spread = resampled(model, data, found) if len(found.free) else np.zeros((1, 0))
    errors, works = _loops(data, found.coefficients)
    return found, Score(
        model.name, dict(zip(names, found.free.tolist(), strict=True)) | ({model.mix_name: found.mixed} if model.mix else {}),
        {name: (float(low), float(high)) for name, low, high in zip(names, *np.percentile(spread, (2.5, 97.5), axis=0), strict=True)},
        _r2(inside, data), norm.force_n * float(np.sqrt(inside / count)), _r2(left_trial, data), _r2(left_pressure, data),
        norm.force_n * float(np.sqrt(left_trial / count)), float(np.mean(np.abs(errors))),
        tuple((works * norm.force_n * norm.length_m).tolist()), found.condition)


def free_names(model: Model) -> tuple[str, ...]:
    """Names of the coefficients that are fitted linearly."""
    return model.terms if model.mix is None else model.terms[:-3]


def _r2(error: float, data: Sums) -> float:
    """Against the mean force of all trials together, as the paper's coefficient."""
    total, square, count = data.force.sum(axis=0)
    return 1.0 - error / (square - total**2 / count)


def _left_out(model: Model, data: Sums, label: np.ndarray) -> float:
    """Squared error of every label's blocks under the fit to the others; NaN where there is one label only."""
    labels = np.unique(label)
    if len(labels) < 2:
        return float("nan")
    return sum(error_of(data, fit(model, data, (label != one).astype(float)).coefficients, label == one) for one in labels)


def _loops(data: Sums, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relative error of each trial's loop work, and the measured work (normalised)."""
    errors, works = [], []
    for trial in np.unique(data.trial):
        work = data.work[data.trial == trial].sum(axis=0)
        modelled, measured = work[:-2] @ coefficients + work[-2], work[-1]
        errors.append((modelled - measured) / measured if measured else np.nan)
        works.append(measured)
    return np.array(errors), np.array(works)
