"""Calibration of the posterior: its numbers as cases with a known truth have them.

What calibration maximises is the log score: the mean log probability that the posterior gives to
what the rig really has. The prior of each number is wide, around where it began.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.optimize import minimize

from epa_rt.benchmark.compare import LEAST, Shares, reliability, share_of
from epa_rt.gap.posterior.evidence import Numbers, log_evidence
from epa_rt.gap.posterior.search import WHOLE, Table
from epa_rt.gap.posterior.unknown import Found, inclusion, posterior
from epa_rt.gap.posterior.views import FREE_RUN

SPREAD = 2.0  # of a number around its start: of its logarithm, of log odds in nats
WITHIN = 15.0  # nats behind the best model, where no numbers near the start make up for it
EVALUATIONS = 500  # of the score, in each round


@dataclass(frozen=True)
class Example:
    """A case whose truth is known: its models, fitted, and the sealed truth's entry. ``weight``:
    how often it counts.
    """

    name: str
    table: Table
    truth: dict
    weight: float = 1.0


def of_truth(found: Found, families: Mapping[str, str], truth: dict) -> float:
    """Probability that the posterior gives to the truth. ``families``: of each effect of the
    catalogue.
    """
    none = sum(share for model, share in found.models if not model.effects)
    sets = [
        ({name: families[name] for name in model.effects}, share)
        for model, share in found.models
        if model.effects
    ]
    return share_of(truth, Shares(none, found.unknown, sets))


def log_score(examples: Sequence[Example], numbers: Numbers) -> float:
    """Mean log probability of the truth, nats."""
    return mean_log(examples, probabilities(examples, numbers))


def mean_log(examples: Sequence[Example], of_truth: Sequence[float]) -> float:
    """Mean log probability, each example by its weight."""
    logs = np.log(np.maximum(of_truth, LEAST))
    return float(np.average(logs, weights=[one.weight for one in examples]))


def as_drawn(examples: Sequence[Example], shares: Mapping[str, float]) -> list[Example]:
    """The examples weighed so that each kind has the share that a draw gives it, however many of
    them were made; all together weigh as much as before. ``shares``: of each kind.
    """
    made = Counter(one.truth["kind"] for one in examples)
    drawn = sum(shares[kind] for kind in made)
    return [
        replace(one, weight=shares[kind] / drawn * len(examples) / made[kind])
        for one in examples
        for kind in [one.truth["kind"]]
    ]


def probabilities(examples: Sequence[Example], numbers: Numbers) -> list[float]:
    """Of the truth, case by case."""
    return [
        of_truth(posterior(one.table, numbers), one.table.families, one.truth) for one in examples
    ]


def of_links_alone(example: Example) -> Example:
    """The same as of a rig that has no model of the whole: with what its links show and nothing
    else.
    """
    models = tuple(
        replace(
            model, views={name: view for name, view in model.views.items() if name not in WHOLE}
        )
        for model in example.table.models
    )
    return replace(example, table=replace(example.table, models=models))


def that_count(example: Example, numbers: Numbers) -> Example:
    """The same with those models alone that may count, the one without an effect first."""
    table = example.table
    logs = [log_evidence(model, table.prior, numbers) for model in table.models]
    kept = tuple(
        model
        for i, (model, log) in enumerate(zip(table.models, logs, strict=True))
        if i == 0 or log > max(logs) - WITHIN
    )
    return replace(example, table=replace(table, models=kept))


def calibrated(examples: Sequence[Example], start: Numbers, rounds: int = 2) -> Numbers:
    """The numbers that give the truth the highest log score, the prior of the numbers included; of
    every rig as it is, and as one that has no model of the whole.
    """
    examples = [that_count(one, start) for one in _both(examples)]
    best = _flat(start)
    begun = best.copy()

    def loss(at: np.ndarray) -> float:
        score = sum(one.weight for one in examples) * log_score(examples, _numbers(at))
        return -score + 0.5 * float(np.sum(((at - begun) / SPREAD) ** 2))

    for _ in range(rounds):  # a simplex that has shrunk too early begins anew
        size = 0.5 * np.eye(len(best))
        simplex = np.vstack([best, best + size])
        found = minimize(
            loss,
            best,
            method="Nelder-Mead",
            options={
                "initial_simplex": simplex,
                "maxfev": EVALUATIONS,
                "xatol": 0.01,
                "fatol": 0.005,
            },
        )
        best = found.x
    return _numbers(best)


def _both(examples: Sequence[Example]) -> list[Example]:
    """Every rig as it is, and half as often as one that has no model of the whole."""
    whole = [one for one in examples if FREE_RUN in one.table.models[0].views]
    alone = [replace(of_links_alone(one), weight=0.5 * one.weight) for one in whole]
    return [*examples, *alone]


def left_out(examples: Sequence[Example], start: Numbers, parts: int = 4) -> list[float]:
    """Probability of the truth of each case, with numbers that were calibrated on others."""
    found = [0.0] * len(examples)
    for part in range(parts):
        mine = range(part, len(examples), parts)
        others = [one for i, one in enumerate(examples) if i not in mine]
        numbers = calibrated(others, start, rounds=1)
        for i, share in zip(mine, probabilities([examples[i] for i in mine], numbers), strict=True):
            found[i] = share
    return found


def of_names(examples: Sequence[Example], numbers: Numbers) -> list[dict[str, float]]:
    """How far the probability of first names holds, by bins."""
    said: list[tuple[float, bool]] = []
    for one in examples:
        found = posterior(one.table, numbers)
        wanted = {family for effect in one.truth["effects"] for family in effect["families"]}
        for family, share in list(inclusion(found, one.table.families).items())[:1]:
            said.append((min(share, 1.0), family in wanted))
    return reliability(said)


_LOGS = ("further_odds", "unknown_odds", "imitated_odds")  # the others are positive


def _flat(numbers: Numbers) -> np.ndarray:
    return np.array(
        [
            getattr(numbers, one.name) if one.name in _LOGS else np.log(getattr(numbers, one.name))
            for one in fields(numbers)
        ]
    )


def _numbers(flat: np.ndarray) -> Numbers:
    names = [one.name for one in fields(Numbers)]
    return Numbers(
        **{
            name: float(value) if name in _LOGS else float(np.exp(value))
            for name, value in zip(names, flat, strict=True)
        }
    )
