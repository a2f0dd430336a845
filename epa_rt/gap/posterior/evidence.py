"""Log evidence of a model, and the posterior over all of them.

Noise is Gaussian with the size and colour that the floors measured. No law of a catalogue is a
rig's own law, so each link has a discrepancy besides, of a size that nobody knows: integrated over
that size, a link's chi-square above noise counts by its logarithm (a Student's t with few degrees
of freedom). A law that leaves 1 of 1000 is then ahead of one that leaves 20 by the same amount on a
large gap and on a small one.

Sources: Kennedy and O'Hagan (2001) on discrepancy; MacKay, Bayesian interpolation (1992) on the
evidence and its Occam factor; Student's t as a Gaussian of unknown variance (Gelman et al.).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np

from epa_rt.gap.posterior.search import Model, Table
from epa_rt.gap.posterior.views import BLOCKS, FREE_RUN, HELD_OUT, HELD_OUT_FREE_RUN, View


@dataclass(frozen=True)
class Numbers:
    """What calibration sets. ``freedom``: by view, degrees of freedom of a link's discrepancy.
    ``effect_odds``: log prior odds of one effect against none; ``further_odds``: of one more
    against no more. ``strain_freedom``: degrees of freedom of the prior of a nominal parameter, in
    its spread.
    """

    freedom: Mapping[str, float]
    effect_odds: float
    further_odds: float
    strain_freedom: float = 4.0


START = Numbers(
    freedom={BLOCKS: 6.0, FREE_RUN: 12.0, HELD_OUT: 3.0, HELD_OUT_FREE_RUN: 6.0},
    effect_odds=1.0,
    further_odds=-1.0,
)


def log_likelihood(view: View, freedom: float) -> float:
    """Of all links of a view, up to what is the same for all models; 0 of one that leaves noise."""
    return -0.5 * sum(
        freedom * float(np.log1p(seen.excess / freedom)) for seen in view.links.values()
    )


def strain(view: View, freedom: float) -> float:
    """Log prior density of the nominal parameters at the fit, up to a constant: heavy-tailed, so
    that one that is far off costs and forbids nothing.
    """
    z = view.z[view.nominal]
    return -0.5 * (freedom + 1.0) * float(np.log1p(z**2 / freedom).sum())


def occam(model: Model, freedom: Mapping[str, float]) -> float:
    """Log of the part of its prior volume that the data leave an effect's numbers, nominal
    parameters allowed to make up for it.
    """
    views = [(name, view) for name, view in model.views.items() if view.keys]
    keys = tuple(dict.fromkeys(key for _, view in views for key in view.keys))
    own = np.ones(len(keys), bool)
    matrix = np.zeros((len(keys), len(keys)))
    for name, view in views:
        at = np.array([keys.index(key) for key in view.keys])
        own[at[view.nominal]] = False
        for seen in view.links.values():
            if seen.matrix is not None:
                matrix[np.ix_(at, at)] += seen.matrix / (1.0 + seen.excess / freedom[name])
    if not own.any():
        return 0.0
    matrix += np.eye(len(keys))
    rest = ~own
    schur = matrix[np.ix_(own, own)]
    if rest.any():
        cross = matrix[np.ix_(rest, own)]
        schur = schur - cross.T @ np.linalg.solve(matrix[np.ix_(rest, rest)], cross)
    return -0.5 * float(np.linalg.slogdet(schur)[1])


def log_prior(model: Model, table: Table, numbers: Numbers) -> float:
    """Sets of families share the odds of their size, laws of a family theirs."""
    if not model.effects:
        return 0.0
    families = list(table.families.values())
    kinds, count = len(set(families)), len(model.effects)
    laws = sum(np.log(families.count(table.families[name])) for name in model.effects)
    odds = numbers.effect_odds + (count - 1) * numbers.further_odds
    return odds - float(np.log(comb(kinds, count)) + laws)


def log_evidence(model: Model, table: Table, numbers: Numbers) -> float:
    """Log of the joint probability of data and model, up to what is the same for all models."""
    total = log_prior(model, table, numbers) + occam(model, numbers.freedom)
    fits = [view for view in model.views.values() if view.keys]
    total += sum(strain(view, numbers.strain_freedom) for view in fits) / max(len(fits), 1)
    for name, view in model.views.items():
        total += log_likelihood(view, numbers.freedom[name])
    return total


@dataclass(frozen=True)
class Formula:
    """The formula for the search, which knows the catalogue and no models yet."""

    table: Table
    numbers: Numbers

    def evidence(self, model: Model) -> float:
        """As ``log_evidence``, over the views that the model has."""
        return log_evidence(model, self.table, self.numbers)

    def at_best(self, model: Model, more: int) -> float:
        """Log evidence if ``more`` effects beside it left nothing of any view."""
        fuller = Model(model.effects + model.effects[:1] * more, {}, model.values)
        return log_prior(fuller, self.table, self.numbers)


def posterior(table: Table, numbers: Numbers) -> list[tuple[Model, float]]:
    """Models with their probabilities, most probable first. Those that were not fitted in every
    view that the first one was are left out: they were not worth it.
    """
    views = set(table.models[0].views)
    models = [model for model in table.models if model.place is None and set(model.views) >= views]
    logs = np.array([log_evidence(model, table, numbers) for model in models])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    order = np.argsort(-weights, kind="stable")
    return [(models[i], float(weights[i])) for i in order]


def inclusion(found: Sequence[tuple[Model, float]], table: Table) -> dict[str, float]:
    """Family to the probability that the rig has one of its effects, most probable first."""
    total: dict[str, float] = {}
    for model, probability in found:
        for family in {table.families[name] for name in model.effects}:
            total[family] = total.get(family, 0.0) + probability
    return dict(sorted(total.items(), key=lambda item: -item[1]))
