"""What the pictures of an identification draw: measured and modelled force, thinned, of whole
clouds and of short stretches.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.identify import models
from epa_rt.identify.answer import Answer
from epa_rt.identify.data import Trial
from epa_rt.identify.linear import Scaled
from epa_rt.identify.linear import predicted as linear_force
from epa_rt.identify.physical import predicted as physical_force

STRETCH_S = 5.0
MEAN_S = 0.01


@dataclass(frozen=True)
class Cloud:
    """Samples spread evenly over all trials, (n,) each: length (mm), gauge pressure (kPa),
    contraction speed (mm/s), force (N), and the force of one model.
    """

    length_mm: np.ndarray
    gauge_kpa: np.ndarray
    speed_mm_s: np.ndarray
    force_n: np.ndarray
    model_n: np.ndarray


@dataclass(frozen=True)
class Stretch:
    """A few seconds of one trial, averaged over MEAN_S: time (s), length (mm), measured force (N),
    modelled force by model.
    """

    p0_kpa: float
    time_s: np.ndarray
    length_mm: np.ndarray
    force_n: np.ndarray
    models: dict[str, np.ndarray]


def forces(found: Answer, name: str, trial: Trial, data: Scaled) -> np.ndarray:
    """Force (N), (n,), of a fitted model along a trial."""
    for fit in found.physical:
        if fit.model.name == name:
            return physical_force(fit.params, trial)
    model, fitted, _ = next(one for one in found.linear if one[0].name == name)
    return linear_force(model, fitted, data) * found.normalisation.force_n


def drawn(found: Answer) -> tuple[str, ...]:
    """Models that are drawn: those of Table 1 and the best physical one."""
    best = min(found.physical, key=lambda fit: fit.score.rms_n, default=None)
    return (
        models.GEOMETRY,
        models.TANG_GEOMETRIC,
        models.POLYNOMIAL,
        *((best.model.name,) if best else ()),
    )


def cloud(
    found: Answer, trials: Sequence[Trial], data: Sequence[Scaled], name: str, most: int
) -> Cloud:
    """At most ``most`` samples; those of the model ``name`` beside the measured ones."""
    parts = []
    for trial, normal in zip(trials, data, strict=True):
        at = np.linspace(
            0, trial.samples - 1, min(max(most // len(trials), 1), trial.samples)
        ).astype(int)
        parts.append(
            (
                trial.length_m[at] * 1e3,
                trial.gauge_pa[at] / 1e3,
                -trial.speed_m_s[at] * 1e3,
                trial.force_n[at],
                forces(found, name, trial, normal)[at],
            )
        )
    return Cloud(*(np.concatenate([part[i] for part in parts]) for i in range(5)))


def stretches(found: Answer, trials: Sequence[Trial], data: Sequence[Scaled]) -> list[Stretch]:
    """A stretch from the middle of the trials with the lowest, a middle and the highest no-load
    pressure.
    """
    order = np.argsort([trial.p0_pa for trial in trials])
    chosen = dict.fromkeys(int(order[i]) for i in (0, len(order) // 2, len(order) - 1))
    return [_stretch(found, trials[k], data[k]) for k in chosen]


def _stretch(found: Answer, trial: Trial, data: Scaled) -> Stretch:
    span = min(round(STRETCH_S / trial.period_s), trial.samples)
    begin = (trial.samples - span) // 2
    step = max(1, round(MEAN_S / trial.period_s))

    def mean(values: np.ndarray) -> np.ndarray:
        part = values[begin : begin + span // step * step]
        return part.reshape(-1, step).mean(axis=1)

    return Stretch(
        trial.p0_pa / 1e3,
        mean(np.arange(trial.samples) * trial.period_s),
        mean(trial.length_m) * 1e3,
        mean(trial.force_n),
        {name: mean(forces(found, name, trial, data)) for name in drawn(found)},
    )
