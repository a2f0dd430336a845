"""What the data themselves allow: a diagnoser that is told the true law and only has to see it.

It runs the true plant again over the logged commands, with and without the effect, and asks how far
apart the readings are, in units of the sensors' noise, once the nominal parameters have done their
best to hide the difference.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

DECIMATION = 10  # readings are averaged over so many cycles: 100 Hz, as the diagnosis judges them
SLOW = (
    100  # noise is compared at 100 Hz and at 1 Hz, because steps of a converter do not average out
)
LIMIT = 5.0  # an effect is detectable where its distance is at least this: chi-square of 25
# how many readings a second count: what a model leaves of a real log is correlated, and the method
INDEPENDENT_HZ = 4.0
# divides its gains by that misfit, so the oracle must not count 100 Hz of white noise either
FLOOR_SHARE = 1e-3  # readings are not believed better than this share of their own deviation
STOP_S = 3.0  # after an end stop was near: the swing from it has then died away


class Bench(NamedTuple):
    """What one case's oracle works with: noise-free readings (n, channels) of the true plant
    without its effect, the noise of each channel (channels,), and the whitened directions (judged
    rows * channels, k) in which nominal parameters move the readings per standard deviation of what
    is believed of them. ``judged``: (n,) bool, rows that count; None: all.
    """

    base: np.ndarray
    noise: np.ndarray
    nominal: np.ndarray
    judged: np.ndarray | None = None

    def white(self, readings: np.ndarray) -> np.ndarray:
        """Difference to the base in units of noise, (judged rows * channels,)."""
        off = (readings - self.base) / self.noise
        return (off if self.judged is None else off[self.judged]).ravel()


def averaged(readings: np.ndarray) -> np.ndarray:
    """Means over DECIMATION rows; (n, channels) to (n // DECIMATION, channels)."""
    n = len(readings) // DECIMATION
    return readings[: n * DECIMATION].reshape(n, DECIMATION, -1).mean(axis=1)


def clear_of_stops(place: np.ndarray, low: float, high: float, margin: float) -> np.ndarray:
    """Rows (n,) bool of one log, averaged, in which a load at ``place`` (n,) is and was for STOP_S
    further than ``margin`` from its end stops.

    Where exactly a stop is, how it gives and when the load leaves it, nobody knows of a real rig:
    readings there would be information that no diagnosis has.
    """
    near = (place < low + margin) | (place > high - margin)
    total = np.concatenate([[0], np.cumsum(near)])
    k = np.arange(len(place)) + 1
    return total[k] == total[np.maximum(k - 1 - round(STOP_S * 100.0), 0)]


def noise_of(noisy: np.ndarray, clean: np.ndarray) -> np.ndarray:
    """Noise per channel at 100 Hz from averaged readings with and without noise and steps, (n,
    channels) each.

    Where the noise at 1 Hz is larger than white noise would be, it is raised to what the slow part
    says; then to what INDEPENDENT_HZ independent readings a second leave.
    """
    off = noisy - clean
    off = off - off.mean(axis=0)
    slow = off[: len(off) // SLOW * SLOW].reshape(-1, SLOW, off.shape[1]).mean(axis=1)
    fast_noise, slow_noise = off.std(axis=0), slow.std(axis=0) * np.sqrt(SLOW)
    return np.sqrt(100.0 / INDEPENDENT_HZ) * np.maximum(
        np.maximum(fast_noise, slow_noise), FLOOR_SHARE * clean.std(axis=0) + 1e-12
    )


def left(white: np.ndarray, nominal: np.ndarray, others: Sequence[np.ndarray] = ()) -> float:
    """Length of a whitened difference after nominal parameters (with their prior) and other laws
    have fitted it.
    """
    return explained(white, nominal, others)[0]


def explained(
    white: np.ndarray, nominal: np.ndarray, others: Sequence[np.ndarray] = ()
) -> tuple[float, np.ndarray]:
    """As ``left``, and the factors of all columns (k + others,) that do it."""
    columns = np.column_stack([nominal, *others]) if others else nominal
    prior = np.ones(columns.shape[1])
    prior[nominal.shape[1] :] = 1e-9  # nothing is believed of another law's strength
    scale = np.linalg.norm(columns, axis=0) + 1e-12
    scale[: nominal.shape[1]] = 1.0
    columns = columns / scale
    normal = columns.T @ columns + np.diag(prior)
    b = columns.T @ white
    x = np.linalg.solve(normal, b)
    return float(np.sqrt(max(white @ white - b @ x, 0.0))), x / scale


def distance(bench: Bench, with_effect: np.ndarray) -> float:
    """Expected square root of chi-square between the plant with its effect and the best plant
    without.
    """
    return left(bench.white(with_effect), bench.nominal)


def strength_for(
    wanted: float,
    distance_at: Callable[[float], float],
    typical: float,
    most: float,
    tries: int = 4,
) -> tuple[float, float]:
    """Strength at which ``distance_at`` is nearest to ``wanted`` of all tried, and its distance; at
    most ``most`` in size.

    Runs along a straight line in the logarithms, as distances grow nearly in proportion to
    strength.
    """
    strength = min(typical, most)
    tried = [(strength, distance_at(strength))]
    for _ in range(tries):
        strength, reached = tried[-1]
        if reached <= 0.0 or not np.isfinite(reached) or abs(np.log(reached / wanted)) < 0.2:
            break
        strength = min(strength * float(np.clip(wanted / reached, 1e-3, 30.0)), most)
        if strength == tried[-1][0]:
            break
        tried.append((strength, distance_at(strength)))
    return min(
        tried,
        key=lambda pair: (
            abs(np.log(max(pair[1], 1e-12) / wanted)) if np.isfinite(pair[1]) else np.inf
        ),
    )
