"""Calibration of the posterior: its numbers as cases with a known truth have them.

What calibration maximises is the log score: the mean log probability that the posterior gives to
what the rig really has. The prior of each number is wide, around where it began.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.optimize import minimize

from epa_rt.benchmark.figures import strong
from epa_rt.gap.posterior.evidence import Numbers, log_evidence
from epa_rt.gap.posterior.search import Table
from epa_rt.gap.posterior.unknown import Found, inclusion, posterior

LEAST = 1e-3  # no probability counts for less: one case must not decide alone
SPREAD = 1.0  # of a number around its start: of its logarithm, of log odds in nats
TOO_MANY = 0.5  # of a set that names the truth and something else
WITHIN = 15.0  # nats behind the best model, where no numbers near the start make up for it
EVALUATIONS = 150  # of the score, in each round
BINS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)


@dataclass(frozen=True)
class Example:
    """A case whose truth is known: its models, fitted, and the sealed truth's entry."""

    name: str
    table: Table
    truth: dict


def of_truth(found: Found, families: Mapping[str, str], truth: dict) -> float:
    """Probability that the posterior gives to the truth: to nothing, to something that the
    catalogue lacks, to sets that hold a family of each effect; one with a name too many counts
    half. An effect that is not twice its detection limit may as well be none.
    """
    if truth["kind"] == "none":
        return _none(found)
    if truth["kind"] == "withheld":
        share = found.unknown
    else:
        wanted = [set(effect["families"]) for effect in truth["effects"]]
        share = sum(
            probability * (1.0 if len(kinds) == len(wanted) else TOO_MANY)
            for model, probability in found.models
            for kinds in [{families[name] for name in model.effects}]
            if all(one & kinds for one in wanted)
        )
    return share if strong(truth) and truth["kind"] != "not_excited" else share + _none(found)


def _none(found: Found) -> float:
    return sum(share for model, share in found.models if not model.effects)


def log_score(examples: Sequence[Example], numbers: Numbers) -> float:
    """Mean log probability of the truth, nats."""
    return float(np.mean([np.log(max(one, LEAST)) for one in probabilities(examples, numbers)]))


def probabilities(examples: Sequence[Example], numbers: Numbers) -> list[float]:
    """Of the truth, case by case."""
    return [
        of_truth(posterior(one.table, numbers), one.table.families, one.truth) for one in examples
    ]


def that_count(example: Example, numbers: Numbers) -> Example:
    """The same with those models alone that may count, the one without an effect first."""
    table = example.table
    logs = [log_evidence(model, table.families, numbers) for model in table.models]
    kept = tuple(
        model
        for i, (model, log) in enumerate(zip(table.models, logs, strict=True))
        if i == 0 or log > max(logs) - WITHIN
    )
    return replace(example, table=replace(table, models=kept))


def calibrated(examples: Sequence[Example], start: Numbers, rounds: int = 2) -> Numbers:
    """The numbers that give the truth the highest log score, the prior of the numbers included."""
    examples = [that_count(one, start) for one in examples]
    best = _flat(start)
    begun = best.copy()

    def loss(at: np.ndarray) -> float:
        score = len(examples) * log_score(examples, _numbers(at))
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
                "xatol": 0.02,
                "fatol": 0.02,
            },
        )
        best = found.x
    return _numbers(best)


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


def reliability(examples: Sequence[Example], numbers: Numbers) -> list[dict[str, float]]:
    """By bins of the first name's probability: how many names, the mean probability, and how many
    are right.
    """
    said: list[tuple[float, bool]] = []
    for one in examples:
        found = posterior(one.table, numbers)
        wanted = {family for effect in one.truth["effects"] for family in effect["families"]}
        for family, share in list(inclusion(found, one.table.families).items())[:1]:
            said.append((min(share, 1.0), family in wanted))
    rows = []
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        inside = [one for one in said if low <= one[0] < high or one[0] == high == 1.0]
        if inside:
            rows.append(
                {
                    "from": low,
                    "to": high,
                    "names": len(inside),
                    "said": float(np.mean([share for share, _ in inside])),
                    "right": float(np.mean([is_right for _, is_right in inside])),
                }
            )
    return rows


_LOGS = ("effect_odds", "further_odds", "unknown_odds")  # the others are positive


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
