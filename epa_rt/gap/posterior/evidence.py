"""Log evidence of a model, and the posterior over all of them.

Noise is Gaussian with the size and colour that the floors measured, and nobody knows a floor to
the last percent. No law of a catalogue is a rig's own law, so each link has a discrepancy besides,
of a size that nobody knows: integrated over that size, a link's chi-square above noise counts by
its logarithm (a Student's t with few degrees of freedom). A law that leaves 1 of 1000 is then ahead
of one that leaves 20 by the same amount on a large gap and on a small one.

Sources: Kennedy and O'Hagan (2001) on discrepancy; MacKay, Bayesian interpolation (1992) on the
evidence and its Occam factor; Student's t as a Gaussian of unknown variance (Gelman et al.).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import digamma

from epa_rt.gap.posterior.prior import Prior
from epa_rt.gap.posterior.search import Model
from epa_rt.gap.posterior.views import HELD_OUT, HELD_OUT_FREE_RUN, Seen, View

TAILS = 4.0  # degrees of freedom of a Student's t: heavy tails, with a variance


@dataclass(frozen=True)
class Numbers:
    """What calibration sets.

    ``freedom``: degrees of freedom of a link's discrepancy, block by block and in free run alike;
    on held-out logs half of that. ``floor_share``: part of a link's noise that its
    floor may be wrong by; ``loose_share``: the same of one that is known from repeats or from the
    sensors alone, where nothing explains what is left. ``further_odds``: log prior odds of one
    effect more against no more, beside one that is there. ``unknown_odds``: log prior odds of
    something that the catalogue lacks. ``right_left``, ``wrong_left``: part of a gap that the right
    laws leave, and the best of the wrong ones; ``left_spread``: spread of the logarithm of either;
    ``imitated_odds``: log odds that the wrong ones leave as little as right ones. ``wrong_push``:
    how many times as far from the plant file nominal parameters go beside wrong laws.
    """

    freedom: float
    floor_share: float
    loose_share: float
    further_odds: float
    unknown_odds: float
    right_left: float
    wrong_left: float
    left_spread: float
    imitated_odds: float
    wrong_push: float

    def freedom_of(self, view: str) -> float:
        """Degrees of freedom of a link's discrepancy in a view."""
        return 0.5 * self.freedom if view in (HELD_OUT, HELD_OUT_FREE_RUN) else self.freedom


# Where calibration begins (scripts/calibrate_posterior.py); what it found is in calibrated.py.
START = Numbers(
    freedom=6.0,
    floor_share=0.02,
    loose_share=0.3,
    further_odds=-1.0,
    unknown_odds=-1.0,
    right_left=0.01,
    wrong_left=0.3,
    left_spread=1.0,
    imitated_odds=-2.0,
    wrong_push=5.0,
)


def log_likelihood(view: View, freedom: float, floor_share: float) -> float:
    """Of all links of a view, up to what is the same for all models; 0 of one that leaves noise."""
    return -0.5 * sum(
        freedom * float(np.log1p(seen.excess / scale(seen, freedom, floor_share)))
        for seen in view.links.values()
    )


def scale(seen: Seen, freedom: float, floor_share: float) -> float:
    """Chi-square above noise from which on a link's discrepancy is larger than what is known of its
    noise: a part of it by calibration, or what healthy runs differ by where that is more.
    """
    return freedom + max(floor_share * seen.noise, seen.off)


def strain(view: View) -> np.ndarray:
    """Log prior density of the nominal parameters at the fit (or at as many as ``z`` (..., k) has),
    up to a constant: heavy-tailed, so that one that is far off costs and forbids nothing.

    Spreads that healthy runs have are known from these alone: one more run is then of a
    multivariate Student's t about them (Gelman et al., Bayesian Data Analysis, 3.6). A change since
    then has a size too, and so has an error of a reading that was calibrated: an effect's own
    number is heavy-tailed about none where its size is known.
    """
    z = view.z[..., view.nominal]
    if view.runs:
        usual = -0.5 * view.runs * np.log1p((z**2).sum(axis=-1) / (view.runs - 1.0))
    else:
        usual = _heavy_tailed(z)
    own = view.known > 0.0
    if not own.any():
        return usual
    known = view.known[own]
    return usual + _heavy_tailed(view.z[..., own] * known) + float(np.log(known).sum())


def of_sizes(view: View) -> float:
    """Log prior density of the sizes of effects of which nothing is known, up to a constant."""
    return sum(of_size(size) for size in view.sizes.values())


def of_size(size: float) -> float:
    """Log prior density of an effect of so many typical strengths, 0 of one that does nothing: all
    sizes up to a typical one alike, and from there on all decades alike (Jeffreys on scales). What
    an effect does at thirty times a typical strength, another more often does at its own.
    """
    return -float(np.log1p(size))


def usual_strain(view: View) -> float:
    """What ``strain`` is on average where the plant file is right, of nominal parameters alone."""
    count = int(view.nominal.sum())
    if view.runs:
        return -0.5 * view.runs * _log_of_one_and_square(view.runs - 1.0, count)
    return -0.5 * (TAILS + 1.0) * count * _log_of_one_and_square(TAILS, 1)


def _log_of_one_and_square(tails: float, count: int) -> float:
    """Mean of log(1 + |z|^2/tails) of so many numbers of one Student's t."""
    return float(digamma(0.5 * (tails + count)) - digamma(0.5 * tails))


def _heavy_tailed(z: np.ndarray) -> np.ndarray:
    """(...,) log density of a Student's t at z (..., k), up to a constant."""
    return -0.5 * (TAILS + 1.0) * np.log1p(z**2 / TAILS).sum(axis=-1)


def occam(model: Model, numbers: Numbers) -> float:
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
                freedom = numbers.freedom_of(name)
                wide = scale(seen, freedom, numbers.floor_share) + seen.excess
                matrix[np.ix_(at, at)] += seen.matrix * freedom / wide
    if not own.any():
        return 0.0
    matrix += np.eye(len(keys))
    rest = ~own
    schur = matrix[np.ix_(own, own)]
    if rest.any():
        cross = matrix[np.ix_(rest, own)]
        schur = schur - cross.T @ np.linalg.solve(matrix[np.ix_(rest, rest)], cross)
    return -0.5 * float(np.linalg.slogdet(schur)[1])


def log_evidence(model: Model, prior: Prior, numbers: Numbers) -> float:
    """Log of the joint probability of data and model, up to what is the same for all models, over
    the views that the model has; none of a plant that ran away.
    """
    total = prior.log_odds(model.effects, numbers.further_odds)
    total += occam(model, numbers)
    total += _mean_of_fits(model, of_sizes)
    total += _strain_of(model) + of_views(model.views, numbers)
    return total if np.isfinite(total) else -np.inf


def _strain_of(model: Model) -> float:
    return _mean_of_fits(model, strain)


def _usual_strain_of(model: Model) -> float:
    return _mean_of_fits(model, usual_strain)


def _mean_of_fits(model: Model, of: Callable[[View], float | np.ndarray]) -> float:
    """The mean over the views that have numbers of their own."""
    fits = [view for view in model.views.values() if view.keys]
    return float(sum(of(view) for view in fits)) / max(len(fits), 1)


def of_views(views: Mapping[str, View], numbers: Numbers) -> float:
    """Log likelihood of all views of a model."""
    return sum(
        log_likelihood(view, numbers.freedom_of(name), numbers.floor_share)
        for name, view in views.items()
    )


@dataclass(frozen=True)
class Formula:
    """The formula for the search, which knows the prior and no models yet."""

    prior: Prior
    numbers: Numbers

    def evidence(self, model: Model) -> float:
        """As ``log_evidence``."""
        return log_evidence(model, self.prior, self.numbers)

    def with_one_more(
        self,
        model: Model,
        best: Model,
        views: Sequence[str],
        links: Sequence[str] = (),
        left: float = 0.0,
    ) -> float:
        """Log evidence if an effect more, of a family with one law, left so much of the excess in
        these views, or in these links of them. Nominal parameters that have made up for what is
        missing go back by the rest, to where the ``best`` model has them, or as near to the plant
        file as they usually are.
        """
        more = self.prior.log_of_one_more(model.effects, self.numbers.further_odds)
        seen = {
            name: [one for link, one in view.links.items() if not links or link in links]
            for name, view in model.views.items()
            if name in views
        }
        gained = sum(
            self._likelihood(name, one, 1.0) - self._likelihood(name, one, left)
            for name, of_view in seen.items()
            for one in of_view
        )
        usual = max(_strain_of(best), _usual_strain_of(model))
        back = (1.0 - left) * max(usual - _strain_of(model), 0.0)
        return self.evidence(model) + back + more - gained

    def without(self, model: Model, name: str) -> float:
        """Log prior odds that a set has more without one of its effects, of the size it has."""
        odds = self.numbers.further_odds
        rest = [other for other in model.effects if other != name]
        more = self.prior.log_odds(rest, odds) - self.prior.log_odds(model.effects, odds)
        return more - _mean_of_fits(model, lambda view: of_size(view.sizes.get(name, 0.0)))

    def most(self, view: str, noise: float, loss: float) -> float:
        """Chi-square of a link of a view, of so much noise, that costs a loss of log evidence."""
        freedom = self.numbers.freedom_of(view)
        width = scale(Seen(noise, noise), freedom, self.numbers.floor_share)
        return noise + width * float(np.expm1(2.0 * loss / freedom))

    def _likelihood(self, view: str, seen: Seen, part: float) -> float:
        """Log likelihood of a link with a part of its excess."""
        part_of_it = replace(seen, chi=seen.noise + part * seen.excess)
        freedom, share = self.numbers.freedom_of(view), self.numbers.floor_share
        return log_likelihood(View({"": part_of_it}), freedom, share)
