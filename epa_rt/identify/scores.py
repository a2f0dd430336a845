"""How good a fitted model is: R2, RMS in newtons, loop area, in sample and on trials or pressures
that it has not seen.
"""

from dataclasses import dataclass

import numpy as np

from epa_rt.identify.data import Normalisation
from epa_rt.identify.linear import Fitted, Model, Sums, error_of, fit, resampled

# a model has hysteresis where its loops lose at least so much of what the measured ones lose
HYSTERESIS_SHARE = 0.5
DAMPING_N_S_M = 0.5  # and damping where its force falls by so much per speed of contraction


@dataclass(frozen=True)
class Score:
    """``r2`` and ``rms_n`` in sample and left out by trial and by no-load pressure (NaN with one
    only).

    ``loop_work_j``: work lost in whole loops (integral of force over length) per trial, modelled
    and measured; ``loop_error``: their relative difference, the mean size over trials;
    ``hysteresis``: all modelled over all measured loop work. ``damping_n_s_m``: what the model's
    force gains per speed of lengthening, from halving every speed; Coulomb friction does not count.
    ``intervals``: 95 %, (j, 2). ``condition``: of the regressors.
    """

    name: str
    says: str
    coefficients: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    r2: float
    rms_n: float
    r2_trial: float
    r2_pressure: float
    rms_trial_n: float
    loop_error: float
    loop_work_j: tuple[tuple[float, float], ...]
    hysteresis: float
    damping_n_s_m: float
    condition: float

    @property
    def has_hysteresis(self) -> bool:
        return self.hysteresis >= HYSTERESIS_SHARE

    @property
    def has_damping(self) -> bool:
        return self.damping_n_s_m >= DAMPING_N_S_M


def loop_figures(works: np.ndarray) -> tuple[float, float]:
    """Mean relative error of the loop work and share of it that the model has; ``works`` (trials,
    2): modelled, measured.
    """
    whole = works[works[:, 1] != 0.0]
    if not len(whole):
        return float("nan"), float("nan")
    return float(np.mean(np.abs(whole[:, 0] / whole[:, 1] - 1.0))), float(
        whole[:, 0].sum() / whole[:, 1].sum()
    )


def score(
    model: Model, data: Sums, groups: np.ndarray, norm: Normalisation, holdout: str = "both"
) -> tuple[Fitted, Score]:
    """Fits a model and judges it. ``groups`` (trials,): the no-load pressure that each trial
    belongs to.

    ``holdout``: trial, pressure, both or none.
    """
    everything = np.ones(len(data.square))
    found = fit(model, data, everything)
    left_trial = (
        _left_out(model, data, data.trial) if holdout in ("trial", "both") else float("nan")
    )
    left_pressure = (
        _left_out(model, data, groups[data.trial])
        if holdout in ("pressure", "both")
        else float("nan")
    )
    count = data.force[:, 2].sum()
    inside = error_of(data, found.coefficients, everything > 0)
    names = (*free_names(model), *((model.mix_name,) if model.mix else ()))
    values = found.free.tolist() + ([found.mixed] if model.mix else [])
    spread = resampled(model, data, found) if names else np.zeros((1, 0))
    works = _works(data, found.coefficients) * norm.force_n * norm.length_m
    speed2 = data.drag[:, -1].sum()
    damping = (
        -2.0
        * float(data.drag[:, :-1].sum(axis=0) @ found.coefficients)
        / speed2
        * norm.force_n
        / norm.speed_m_s
        if speed2
        else float("nan")
    )
    return found, Score(
        model.name,
        model.says,
        dict(zip(names, values, strict=True)),
        {
            name: (float(low), float(high))
            for name, low, high in zip(
                names, *np.percentile(spread, (2.5, 97.5), axis=0), strict=True
            )
        },
        _r2(inside, data),
        norm.force_n * float(np.sqrt(inside / count)),
        _r2(left_trial, data),
        _r2(left_pressure, data),
        norm.force_n * float(np.sqrt(left_trial / count)),
        loop_figures(works)[0],
        tuple((float(a), float(b)) for a, b in works),
        loop_figures(works)[1],
        damping + 0.0,
        found.condition,
    )


def free_names(model: Model) -> tuple[str, ...]:
    """Names of the coefficients that are fitted linearly."""
    return model.terms if model.mix is None else model.terms[:-3]


def _r2(error: float, data: Sums) -> float:
    """Against the mean force of all trials together, as the paper's coefficient."""
    total, square, count = data.force.sum(axis=0)
    return 1.0 - error / (square - total**2 / count)


def _left_out(model: Model, data: Sums, label: np.ndarray) -> float:
    """Squared error of every label's blocks under the fit to the others; NaN where there is one
    label only.
    """
    labels = np.unique(label)
    if len(labels) < 2:
        return float("nan")
    return sum(
        error_of(data, fit(model, data, (label != one).astype(float)).coefficients, label == one)
        for one in labels
    )


def _works(data: Sums, coefficients: np.ndarray) -> np.ndarray:
    """(trials, 2): modelled and measured loop work, normalised."""
    whole = [data.work[data.trial == trial].sum(axis=0) for trial in np.unique(data.trial)]
    return np.array([(work[:-2] @ coefficients + work[-2], work[-1]) for work in whole])
