"""What an identification found: models with their scores, chosen terms, what the trials were, and
all of it as JSON.
"""

from dataclasses import asdict, dataclass, field
from typing import Any

from epa_rt.gap.report.as_json import finite
from epa_rt.identify.data import Normalisation, Trial
from epa_rt.identify.gas import GasFit
from epa_rt.identify.linear import Fitted, Model
from epa_rt.identify.physical import PhysicalFit
from epa_rt.identify.scores import Score
from epa_rt.identify.selection import Selected, Step

PAPER_R2 = {
    "static, geometry": 0.916,
    "Tang, geometric": 0.921,
    "polynomial": 0.971,
}  # Table 1, where our reading comes closest


@dataclass(frozen=True)
class Answer:
    """``linear``: model, fit and score, ``physical``, ``gas`` (None where it was not fitted),
    ``selected`` ways to choose terms.

    ``geometry``: b (m) and n of "static, b and n fitted". ``remarks``: what the logs or the fits
    lack, in sentences.
    """

    trials: tuple[dict[str, Any], ...]
    normalisation: Normalisation
    linear: tuple[tuple[Model, Fitted, Score], ...]
    geometry: tuple[float, float]
    physical: tuple[PhysicalFit, ...]
    gas: GasFit | None
    selected: tuple[Selected, ...]
    effective_samples: float
    remarks: tuple[str, ...]
    seconds: float = 0.0
    inputs: dict[str, Any] = field(default_factory=dict)

    @property
    def scores(self) -> tuple[Score, ...]:
        return (*(score for _, _, score in self.linear), *(fit.score for fit in self.physical))


def trial_facts(trial: Trial) -> dict[str, Any]:
    """What a trial covers, in SI."""

    def span(values) -> list[float]:
        return [float(values.min()), float(values.max())]

    return {
        "log": trial.log,
        "name": trial.name,
        "p0_pa": trial.p0_pa,
        "samples": trial.samples,
        "seconds": trial.samples * trial.period_s,
        "gauge_pa": span(trial.gauge_pa),
        "length_m": span(trial.length_m),
        "speed_m_s": span(trial.speed_m_s),
        "force_n": span(trial.force_n),
    }


def as_json(found: Answer) -> dict[str, Any]:
    """Plain data, SI except what is normalised; what is no number is null."""
    return finite(
        {
            "inputs": found.inputs,
            "remarks": found.remarks,
            "normalisation": asdict(found.normalisation) | {"says": found.normalisation.said()},
            "trials": found.trials,
            "models": [_score(score) for score in found.scores],
            "static_geometry": {
                "braid_length_m": found.geometry[0],
                "braid_turns_ratio": found.geometry[1],
            },
            "at_bound": {fit.model.name: fit.at_bound for fit in found.physical},
            "unseen": {fit.model.name: fit.unseen for fit in found.physical},
            "gas": asdict(found.gas) if found.gas else None,
            "terms": [
                {
                    "name": way.name,
                    "why": way.why,
                    "chosen": asdict(way.chosen),
                    "path": [_short(step) for step in way.path],
                }
                for way in found.selected
            ],
            "effective_samples": found.effective_samples,
            "seconds": found.seconds,
        }
    )


def _score(score: Score) -> dict[str, Any]:
    return asdict(score) | {
        "has_hysteresis": score.has_hysteresis,
        "has_damping": score.has_damping,
        "paper_r2": PAPER_R2.get(score.name),
    }


def _short(step: Step) -> dict[str, Any]:
    return {
        "changed": step.changed,
        "terms": len(step.terms),
        "r2": step.r2,
        "condition": step.condition,
    }
