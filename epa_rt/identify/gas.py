"""The gas shut in with the muscle: Boyle (eq. 3) against a polytropic exponent and a leak, beside
the plant's dead volume.

Exponent and dead volume cannot be told apart by these trials: both only make the pressure stiffer
or softer over length.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from epa_rt.identify.data import Trial
from epa_rt.models.blocks.muscle import NO_LOAD

MEAN_S = 0.02
LOW, HIGH = np.array((1.0, 0.0)), np.array((1.7, 0.1))
START, SCALE = np.array((1.2, 1e-4)), np.array((0.1, 1e-4))


@dataclass(frozen=True)
class GasFit:
    """``r2_boyle`` and ``rms_boyle_pa``: eq. 3 (no dead volume) with each trial's best amount of
    gas; ``r2`` and ``rms_pa`` with exponent and leak fitted at ``dead_volume_m3``, R2 within
    trials: against each trial's own mean.
    """

    r2_boyle: float
    rms_boyle_pa: float
    r2: float
    rms_pa: float
    polytropic_ratio: float
    leak_per_s: float
    dead_volume_m3: float


def fit_gas(
    data: Sequence[Trial], braid_length_m: float, turns: float, dead_volume_m3: float
) -> GasFit:
    """Fits log P = log c - n log((V + Vd)/V0) - leak, c free per trial. Source: eqs. 2 and 3,
    polytropic.
    """
    parts = [_prepared(trial, braid_length_m, turns) for trial in data]
    total = sum(float(np.sum((p - p.mean()) ** 2)) for p, _, _, _ in parts)
    count = sum(len(p) for p, _, _, _ in parts)

    def errors(numbers: np.ndarray, dead: float) -> np.ndarray:
        return np.concatenate([_error(numbers, dead, *part) for part in parts])

    boyle = errors(np.array([1.0, 0.0]), 0.0)
    found = least_squares(
        lambda z: errors(z * SCALE, dead_volume_m3),
        START / SCALE,
        bounds=(LOW / SCALE, HIGH / SCALE),
    )
    left = found.fun
    return GasFit(
        1.0 - float(boyle @ boyle) / total,
        float(np.sqrt(boyle @ boyle / count)),
        1.0 - float(left @ left) / total,
        float(np.sqrt(left @ left / count)),
        *map(float, found.x * SCALE),
        dead_volume_m3,
    )


def _prepared(
    trial: Trial, b: float, turns: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Absolute pressure, volume (eq. 2) and time, averaged over MEAN_S, and the atmosphere."""
    step = max(1, round(MEAN_S / trial.period_s))
    whole = trial.samples // step * step
    length = np.maximum(trial.length_m, b * NO_LOAD)
    rows = [
        values[:whole].reshape(-1, step).mean(axis=1)
        for values in (
            trial.gauge_pa + trial.atmosphere_pa,
            (b * b - length**2) * length / (4.0 * np.pi * turns**2),
            np.arange(trial.samples) * trial.period_s,
        )
    ]
    return rows[0], rows[1], rows[2], trial.atmosphere_pa


def _error(
    numbers: np.ndarray,
    dead: float,
    pressure: np.ndarray,
    volume: np.ndarray,
    time: np.ndarray,
    atmosphere_pa: float,
) -> np.ndarray:
    """Predicted minus measured pressure (Pa). The leak lowers it by rate x (P - Pa); c is least
    squares.
    """
    exponent, leak = numbers
    room = (volume + dead) / (volume.mean() + dead)
    lost = leak * np.cumsum(1.0 - atmosphere_pa / pressure) * (time[1] - time[0])
    shape = room**-exponent * np.exp(-lost)
    return shape * (shape @ pressure) / (shape @ shape) - pressure
