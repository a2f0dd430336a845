"""The size and the colour of a link's noise, from stretches of it."""

from collections.abc import Sequence

import numpy as np

RIDGE = 0.01  # white part of the variance: no band is trusted to be much quieter than the rest
WINDOW = 64  # samples in which noise is looked at by itself
LOWPASS_ORDER = (
    4  # of the Butterworth filter, run forwards and backwards, that residuals may have passed
)
THIRD = np.array([1.0, -3.0, 3.0, -1.0])  # difference: a parabola does not pass at all


def white_size(residuals: Sequence[np.ndarray], rate_hz: float, lowpass_hz: float) -> float:
    """Deviation of the white noise in residuals (n,), by their third differences: what no smooth
    gap has. Their own colour is the difference's and none of the noise.

    ``lowpass_hz``: above which the residuals have passed a filter that takes noise as well (half
    their rate or more: none); then differences are taken over as many samples as two periods of it
    ask for, and count for what they see of such noise. The median over windows: a jolt, which is
    rough, is no noise.
    """
    apart = max(int(rate_hz / (2.0 * lowpass_hz)), 1)
    rough = _third_differences(residuals, apart)
    while apart > 1 and not any(map(len, rough)):
        apart //= 2  # stretches shorter than that say less, but something
        rough = _third_differences(residuals, apart)
    means = [
        np.mean(part**2)
        for good in rough
        for part in np.array_split(good, max(len(good) // WINDOW, 1))
        if len(part)
    ]
    seen = (
        THIRD
        @ _echo(np.subtract.outer(np.arange(4), np.arange(4)) * apart, rate_hz, lowpass_hz)
        @ THIRD
    )
    return float(np.sqrt(np.median(means) / seen)) if means else 0.0


def _third_differences(residuals: Sequence[np.ndarray], apart: int) -> list[np.ndarray]:
    """Those that are numbers, of each residual, over ``apart`` samples each."""
    found = [
        np.convolve(residual, _spread_out(THIRD, apart), "valid")
        for residual in residuals
        if len(residual) > 3 * apart
    ]
    return [one[np.isfinite(one)] for one in found]


def _spread_out(taps: np.ndarray, apart: int) -> np.ndarray:
    found = np.zeros((len(taps) - 1) * apart + 1)
    found[::apart] = taps
    return found


def _echo(lags: np.ndarray, rate_hz: float, lowpass_hz: float) -> np.ndarray:
    """Autocorrelation at ``lags`` (samples) of white noise behind a low-pass of fourth order that
    is run forwards and backwards.
    """
    if lowpass_hz >= 0.5 * rate_hz:
        return (lags == 0).astype(float)
    hertz = np.linspace(0.0, 0.5 * rate_hz, 400)
    power = (1.0 + (hertz / lowpass_hz) ** (2 * LOWPASS_ORDER)) ** -2.0
    return np.cos(2.0 * np.pi * lags[..., None] * hertz / rate_hz) @ power / power.sum()


def autocovariance(noise: Sequence[np.ndarray], order: int) -> np.ndarray:
    """(order + 1,) of stretches with NaN gaps, without taking off a mean; gaps count as zeros, so
    that it stays positive.
    """
    total, count = np.zeros(order + 1), 0
    for x in noise:
        good = np.isfinite(x)
        filled = np.where(good, x, 0.0)
        count += int(good.sum())
        total += [filled[lag:] @ filled[: len(filled) - lag] for lag in range(order + 1)]
    return total / max(count, 1)


def levinson(covariance: np.ndarray) -> tuple[np.ndarray, float]:
    """Predictor (order,) and the deviation of what it cannot predict, from autocovariances (order +
    1,).
    """
    from scipy.linalg import solve_toeplitz, toeplitz

    steady = covariance.copy()
    steady[0] *= 1.0 + RIDGE
    ar = solve_toeplitz(steady[:-1], steady[1:])
    left = covariance[0] - 2.0 * ar @ covariance[1:] + ar @ toeplitz(covariance[:-1]) @ ar
    return ar, float(np.sqrt(max(left, 1e-9 * covariance[0])))
