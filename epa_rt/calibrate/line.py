"""The straight line through points with errors in both: York's least squares, and its certainty."""

import math
from dataclasses import dataclass

import numpy as np

LEVEL = 0.95  # of the expanded uncertainty
# Stated uncertainties are believed to 25 %: as if from 8 degrees of freedom (GUM G.4.2)
STATED_DOF = 8.0
# probability of a scatter this large by chance: below, the stated uncertainties are not believed
UNBELIEVED = 1e-3


@dataclass(frozen=True)
class Line:
    """value = gain x native + offset. ``covariance``: of (gain, offset), scaled. ``scale``: what
    the stated uncertainties were multiplied by; ``dof`` behind it. ``k``: coverage factor, 95 %.
    """

    gain: float
    offset: float
    covariance: np.ndarray
    chi2: float
    points: int
    scale: float
    dof: float
    k: float
    believed: bool  # the points scatter as their stated uncertainties say

    def value(self, native: np.ndarray) -> np.ndarray:
        return np.asarray(self.gain * native + self.offset)

    def std(self, native: np.ndarray) -> np.ndarray:
        """Standard uncertainty of the line at native values."""
        c = self.covariance
        x = np.asarray(native, float)
        return np.sqrt(np.maximum(c[0, 0] * x * x + 2.0 * c[0, 1] * x + c[1, 1], 0.0))

    @property
    def gain_u(self) -> float:
        return math.sqrt(self.covariance[0, 0])

    @property
    def offset_u(self) -> float:
        return math.sqrt(self.covariance[1, 1])

    @property
    def correlation(self) -> float:
        product = self.gain_u * self.offset_u
        return float(self.covariance[0, 1] / product) if product > 0.0 else 0.0


def york(
    x: np.ndarray, y: np.ndarray, ux: np.ndarray, uy: np.ndarray
) -> tuple[float, float, np.ndarray, float]:
    """Gain, offset, their covariance by the stated uncertainties, and chi-squared.

    All (n,), n at least 2, two different x; uy above zero. Source: York et al., Am. J. Phys. 72
    (2004) 367, with uncorrelated errors.
    """
    gain = float(np.polyfit(x, y, 1, w=1.0 / uy)[0])
    wx, wy = 1.0 / np.maximum(ux, 1e-12 * (np.ptp(x) or 1.0)) ** 2, 1.0 / uy**2
    w = beta = x
    x_mean = y_mean = 0.0
    for _ in range(100):
        w = wx * wy / (wx + gain * gain * wy)
        x_mean, y_mean = float(np.average(x, weights=w)), float(np.average(y, weights=w))
        u, v = x - x_mean, y - y_mean
        beta = w * (u / wy + gain * v / wx)
        new = float((w * beta * v).sum() / (w * beta * u).sum())
        done = abs(new - gain) <= 1e-14 * abs(gain)
        gain = new
        if done:
            break
    offset = y_mean - gain * x_mean
    adjusted = x_mean + beta
    centre = float(np.average(adjusted, weights=w))
    var_gain = 1.0 / float((w * (adjusted - centre) ** 2).sum())
    cov = -centre * var_gain
    var_offset = 1.0 / float(w.sum()) + centre * centre * var_gain
    chi2 = float((w * (y - gain * x - offset) ** 2).sum())
    return gain, offset, np.array([[var_gain, cov], [cov, var_offset]]), chi2


def fit_line(
    x: np.ndarray,
    y: np.ndarray,
    ux: np.ndarray,
    uy: np.ndarray,
    common_scale: float = 0.0,
    common_zero: float = 0.0,
) -> Line:
    """The line with its expanded uncertainty.

    The points' own scatter scales what was stated, as far as there are points to tell.
    ``common_scale`` (relative) and ``common_zero`` (the signal's unit): standard uncertainties that
    all references share, so that no scatter shows them.
    """
    from scipy.special import chdtrc, stdtrit

    gain, offset, covariance, chi2 = york(x, y, ux, uy)
    free = len(x) - 2
    believed = free == 0 or float(chdtrc(free, chi2)) > UNBELIEVED
    dof = free + STATED_DOF if believed else float(free)
    scale2 = (chi2 + STATED_DOF) / dof if believed else chi2 / dof
    k = float(stdtrit(dof, 0.5 + LEVEL / 2.0))
    v = np.array([gain, offset])
    covariance = covariance * scale2 + common_scale**2 * np.outer(v, v)
    covariance[1, 1] += common_zero**2
    return Line(gain, offset, covariance, chi2, len(x), math.sqrt(scale2), dof, k, bool(believed))
