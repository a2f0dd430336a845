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
    strain_freedom: float


# Guessed, not calibrated: the answer says so.
START = Numbers(
    freedom={BLOCKS: 6.0, FREE_RUN: 12.0, HELD_OUT: 3.0, HELD_OUT_FREE_RUN: 6.0},
    effect_odds=1.0,
    further_odds=-1.0,
    strain_freedom=4.0,
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


def log_prior(effects: Sequence[str], families: Mapping[str, str], numbers: Numbers) -> float:
    """Of a set of effects. Sets of families share the odds of their size, laws of a family theirs.
    ``families``: of each effect of the catalogue.
    """
    if not effects:
        return 0.0
    of_all = list(families.values())
    laws = sum(float(np.log(of_all.count(families[name]))) for name in effects)
    return _odds(len(effects), len(set(of_all)), numbers) - laws


def _odds(count: int, kinds: int, numbers: Numbers) -> float:
    """Log prior odds of one set of ``count`` of ``kinds`` families against none."""
    odds = numbers.effect_odds + (count - 1) * numbers.further_odds
    return odds - float(np.log(comb(kinds, count)))


def log_evidence(model: Model, families: Mapping[str, str], numbers: Numbers) -> float:
    """Log of the joint probability of data and model, up to what is the same for all models, over
    the views that the model has.
    """
    total = log_prior(model.effects, families, numbers) + occam(model, numbers.freedom)
    fits = [view for view in model.views.values() if view.keys]
    total += sum(strain(view, numbers.strain_freedom) for view in fits) / max(len(fits), 1)
    for name, view in model.views.items():
        total += log_likelihood(view, numbers.freedom[name])
    return total


@dataclass(frozen=True)
class Formula:
    """The formula for the search, which knows the catalogue and no models yet."""

    families: Mapping[str, str]
    numbers: Numbers

    def evidence(self, model: Model) -> float:
        """As ``log_evidence``."""
        return log_evidence(model, self.families, self.numbers)

    def with_one_more(self, model: Model) -> float:
        """Log evidence if an effect more, of a family with one law, left nothing of any view."""
        effects, kinds = model.effects, len(set(self.families.values()))
        more = _odds(len(effects) + 1, kinds, self.numbers) - _odds(
            len(effects), kinds, self.numbers
        )
        return log_prior(effects, self.families, self.numbers) + more


def posterior(table: Table, numbers: Numbers) -> list[tuple[Model, float]]:
    """Models with their probabilities, most probable first. Those that were not fitted in every
    view that the first one was are left out: they were not worth it.
    """
    views = set(table.models[0].views)
    models = [model for model in table.models if set(model.views) >= views]
    logs = np.array([log_evidence(model, table.families, numbers) for model in models])
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
