"""Laps: stretches of a recording in which the rig does the same again, and by how much it does
not.
"""

from collections.abc import Mapping

import numpy as np

# rms difference of two laps of a channel, over the channel's own, below which it is the same again
SAME_RATIO = 0.03
SHORTEST_S = 1.0
LIKE = 0.9  # autocorrelation from which a lag is looked at


def lap_samples(channels: Mapping[str, np.ndarray], rate_hz: float) -> int | None:
    """Samples after which every channel, (N,) each, returns; None where there are no laps. Constant
    channels do not count.

    A disturbance that runs beside a periodic motion makes laps differ: those are no repeats.
    """
    moving = [x - x.mean() for x in channels.values() if np.ptp(x) > 0.0]
    if not moving:
        return None
    for peak in _peaks(moving[0], rate_hz):
        found = _nearest(moving[0], peak, max(2, peak // 20))
        if all(_apart(x, found) < SAME_RATIO * float(np.std(x)) for x in moving):
            return found
    return None


def _peaks(x: np.ndarray, rate_hz: float) -> list[int]:
    """Lags at which a channel looks like itself."""
    count = len(x)
    spectrum = np.fft.rfft(x, 2 * count)
    likeness = (
        np.fft.irfft(np.abs(spectrum) ** 2)[:count]
        / float(x @ x)
        * (count / np.arange(count, 0, -1))
    )
    inner = np.arange(max(1, round(SHORTEST_S * rate_hz)), count // 2)
    top = (
        (likeness[inner] > LIKE)
        & (likeness[inner] >= likeness[inner - 1])
        & (likeness[inner] >= likeness[inner + 1])
    )
    return inner[top].tolist()


def _nearest(x: np.ndarray, around: int, reach: int) -> int:
    """The lag near ``around`` at which two laps differ least: coarse steps, then finer."""
    step, best = max(1, reach // 8), around
    while True:
        best = min(
            range(max(1, best - 8 * step), min(len(x) - 2, best + 8 * step) + 1, step),
            key=lambda lag: _apart(x, lag),
        )
        if step == 1:
            return best
        step = max(1, step // 4)


def _apart(x: np.ndarray, lag: int) -> float:
    return float(np.sqrt(np.mean((x[lag:] - x[:-lag]) ** 2)))


def lap_differences(residual: np.ndarray, lag: float) -> np.ndarray:
    """(n,) what one lap's residual differs from the next one's, over the square root of two; NaN in
    the last lap.

    ``lag``: of a lap in samples of the residual, whole or not (linear between samples).
    """
    whole, part = int(np.floor(lag)), lag - np.floor(lag)
    later = np.full(len(residual), np.nan)
    usable = len(residual) - whole - 1
    if usable > 0:
        later[:usable] = (1.0 - part) * residual[whole : whole + usable] + part * residual[
            whole + 1 : whole + 1 + usable
        ]
    return (later - residual) / np.sqrt(2.0)


def colourless(x: np.ndarray) -> np.ndarray:
    """The same sizes in another order and with other signs, NaN where they were: neither colour nor
    mean.
    """
    random = np.random.default_rng(0)
    found, good = x.copy(), np.isfinite(x)
    found[good] = random.permutation(x[good]) * random.choice([-1.0, 1.0], int(good.sum()))
    return found
