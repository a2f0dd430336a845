"""How large a link's noise is by what the rig does: at reversals more is left than at an even pace.

The variance is a product of one factor by each measured state, of which each region has its own:
fitted by maximum likelihood of a Gaussian whose variance is that product.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.config.rig_rows import PLACES
from epa_rt.gap.likelihood.regressors import SPEEDS

KNOWN_TO = 0.1  # of itself, to which a region's deviation is known at the least: 50 samples
FEWEST = 0.5 / KNOWN_TO**2
ROUNDS = 20  # over the states, which are hardly dependent


@dataclass(frozen=True)
class RegionNoise:
    """``edges`` (b - 1,) of a state's regions and ``variances`` (b,) in them, by its name: factors
    without unit. ``rms``: of the noise as a whole, in the link's unit. ``slowest``: by a speed's
    name, below which too few rows of the runs are for a region.
    """

    edges: Mapping[str, np.ndarray]
    variances: Mapping[str, np.ndarray]
    rms: float
    slowest: Mapping[str, float]

    def weights(self, features: Mapping[str, np.ndarray]) -> np.ndarray:
        """(n,) by which a residual is multiplied for noise of one size, ``rms``. NaN where the rig
        is slower than the runs say anything of: friction jumps there, so that no region beside it
        tells how much is left.
        """
        variance = np.ones(len(next(iter(features.values()))))
        for name, edges in self.edges.items():
            variance *= self.variances[name][np.digitize(_size(name, features[name]), edges)]
        for name, least in self.slowest.items():
            variance[np.abs(features[name]) < least] = np.nan
        return np.asarray(1.0 / np.sqrt(variance))


def region_noise(
    left: Sequence[np.ndarray], features: Sequence[Mapping[str, np.ndarray]]
) -> RegionNoise:
    """Of what is left (n,) of several runs, NaN where they are not judged, by their features."""
    squares = np.concatenate(left) ** 2
    judged = np.isfinite(squares)
    mean = float(np.mean(squares[judged]))
    squares = np.maximum(squares[judged] / max(mean, np.finfo(float).tiny), np.finfo(float).eps)
    edges, places, slowest = {}, {}, {}
    for name in features[0]:
        values = _size(name, np.concatenate([one[name] for one in features])[judged])
        if np.isfinite(values).all() and np.ptp(values) > 0.0:
            edges[name] = _edges(values)
            places[name] = np.digitize(values, edges[name])
            if name.endswith(SPEEDS):
                slowest[name] = float(np.quantile(values, min(FEWEST / len(values), 0.5)))
    factors = {name: np.ones(len(one) + 1) for name, one in edges.items()}
    for _ in range(ROUNDS):
        for name, at in places.items():
            others = np.ones(len(at))
            for other, there in places.items():
                if other != name:
                    others *= factors[other][there]
            factors[name] = np.bincount(at, squares / others, len(factors[name])) / np.maximum(
                np.bincount(at, minlength=len(factors[name])), 1
            )
            factors[name][~(factors[name] > 0.0)] = 1.0
    return RegionNoise(edges, factors, float(np.sqrt(mean)), slowest)


def _size(name: str, values: np.ndarray) -> np.ndarray:
    """A place as it is, anything else without its sign."""
    return values if name.endswith(PLACES) else np.abs(values)


def _edges(values: np.ndarray) -> np.ndarray:
    """Quantiles, each outer region half of the next one in, while ``KNOWN_TO`` allows."""
    halvings = max(int(np.log2(len(values) / FEWEST)), 1)
    shares = 0.5 ** np.arange(1, halvings + 1)
    found: np.ndarray = np.unique(np.quantile(values, [*shares[::-1], *(1.0 - shares[1:])]))
    return found
