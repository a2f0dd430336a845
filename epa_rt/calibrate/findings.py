"""What the points say of a sensor beside its line: bend, hysteresis, repeatability, zero."""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.calibrate.line import Line
from epa_rt.calibrate.point import Point, directions

SIGNIFICANT = 0.01  # probability by chance below which a bend or a hysteresis is called real
SAME = 1e-3  # of the span of references: two references that count as one


@dataclass(frozen=True)
class Findings:
    """All in the signal's unit. ``deviation``: largest distance of a point from the line.
    ``bend``: of a parabola, in the middle of the span; ``hysteresis``: largest of up against down,
    ``hysteresis_mean`` their mean difference; ``repeatability``: standard deviation of repeated
    references; ``zero_drift``: last against first reading of the lowest reference. None: no points
    for it.
    """

    residuals: np.ndarray
    directions: tuple[str, ...]
    span: float
    scatter: float
    deviation: float
    bend: float | None
    bend_p: float | None
    hysteresis: float | None
    hysteresis_mean: float | None
    hysteresis_p: float | None
    repeatability: float | None
    zero_drift: float | None

    @property
    def is_bent(self) -> bool:
        return self.bend_p is not None and self.bend_p < SIGNIFICANT

    @property
    def has_hysteresis(self) -> bool:
        return self.hysteresis_p is not None and self.hysteresis_p < SIGNIFICANT


def findings_of(points: Sequence[Point], line: Line) -> Findings:
    """From the points in their order and the line through them."""
    x = np.array([p.reading for p in points])
    y = np.array([p.reference for p in points])
    ux = np.array([p.reading_u for p in points])
    uy = np.array([p.reference_u for p in points])
    span, residuals = float(np.ptp(y)), line.value(x) - y
    ways = directions([p.reference for p in points])
    u = np.hypot(uy, line.gain * ux)
    bend, bend_p = _bend(x, y, u)
    largest, mean, hysteresis_p = _hysteresis(y, residuals, ways, u * line.scale)
    free = max(len(x) - 2, 1)
    return Findings(
        residuals,
        ways,
        span,
        math.sqrt(float((residuals**2).sum()) / free) if len(x) > 2 else 0.0,
        float(np.abs(residuals).max()),
        bend,
        bend_p,
        largest,
        mean,
        hysteresis_p,
        _repeatability(y, residuals, ways, span),
        _zero_drift(y, residuals, span),
    )


def _bend(x: np.ndarray, y: np.ndarray, u: np.ndarray) -> tuple[float | None, float | None]:
    """Of a parabola through the points: its height in the middle over its ends' chord, and the
    probability of so much by chance (t test of the quadratic term).
    """
    from scipy.special import stdtr

    if len(np.unique(x)) < 4:
        return None, None
    half = 0.5 * float(np.ptp(x))
    t = (x - 0.5 * float(x.max() + x.min())) / half
    design = np.vander(t, 3) / u[:, None]
    coefficients, *_ = np.linalg.lstsq(design, y / u, rcond=None)
    left = y / u - design @ coefficients
    free = len(x) - 3
    scale2 = max(1.0, float(left @ left) / free)  # not below what was stated
    u2 = math.sqrt(scale2 * float(np.linalg.inv(design.T @ design)[0, 0]))
    p = 2.0 * float(stdtr(free, -abs(float(coefficients[0])) / u2))
    return -float(coefficients[0]), p


def _hysteresis(
    y: np.ndarray, residuals: np.ndarray, ways: Sequence[str], u: np.ndarray
) -> tuple[float | None, float | None, float | None]:
    """Up against down where both were read: largest and mean difference, and the probability of
    such a mean by chance. The turning point belongs to both.
    """
    from scipy.special import ndtr

    is_up = np.array([way == "up" for way in ways])
    if is_up.all() or not is_up.any():
        return None, None, None
    up_y, up_r = _by_reference(y[is_up], residuals[is_up])
    down_y, down_r = _by_reference(y[~is_up], residuals[~is_up])
    inside = (down_y >= up_y[0]) & (down_y <= up_y[-1])
    # what was read at an end of both is not different by where it was come from
    inside &= down_y > min(float(y.min()), float(up_y[0])) + SAME * np.ptp(y)
    if not inside.any():
        return None, None, None
    differences = down_r[inside] - np.interp(down_y[inside], up_y, up_r)
    mean = float(differences.mean())
    of_mean = math.sqrt(2.0) * float(np.sqrt((u**2).mean())) / math.sqrt(int(inside.sum()))
    p = 2.0 * float(ndtr(-abs(mean) / of_mean))
    return float(np.abs(differences).max()), mean, p


def _by_reference(y: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean value per reference, in the order of the references."""
    found: dict[float, list[float]] = defaultdict(list)
    for at, value in zip(y, values, strict=True):
        found[float(at)].append(float(value))
    order = sorted(found)
    return np.array(order), np.array([np.mean(found[at]) for at in order])


def _repeatability(
    y: np.ndarray, residuals: np.ndarray, ways: Sequence[str], span: float
) -> float | None:
    """Pooled standard deviation of points at one reference, come to from one side."""
    left, free = 0.0, 0
    for way in ("up", "down"):
        chosen = [i for i, w in enumerate(ways) if w == way]
        while chosen:
            group = [i for i in chosen if abs(y[i] - y[chosen[0]]) <= SAME * span]
            chosen = [i for i in chosen if i not in group]
            values = residuals[group]
            left += float(((values - values.mean()) ** 2).sum())
            free += len(group) - 1
    return math.sqrt(left / free) if free else None


def _zero_drift(y: np.ndarray, residuals: np.ndarray, span: float) -> float | None:
    """Last against first reading of the lowest reference; None where it was read once."""
    at_zero = np.flatnonzero(y <= y.min() + SAME * span)
    if len(at_zero) < 2:
        return None
    return float(residuals[at_zero[-1]] - residuals[at_zero[0]])
