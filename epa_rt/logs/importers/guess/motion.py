"""What motion tells of columns: which one is the slope of which, and which steps encoders make."""

import math
from typing import NamedTuple

import numpy as np

from epa_rt.config.units import unit

_MOST_ROWS = 20_000
_PIECE_ROWS = 400
_LEAST_EXPLAINED = 0.97  # of the variance of a position by the integral of its speed
_NEAR = 0.04  # relative: a factor between position and speed that is another unit's
_LEAST_ROWS = 200
_LEFT_OF_A_LAP = 0.002  # of the variance: one lap less the next


class Slope(NamedTuple):
    """``speed`` = ``factor`` x the slope of ``position`` per second of the clock."""

    position: str | int
    speed: str | int
    factor: float
    explained: float


def slopes(
    positions: dict[str | int, np.ndarray], speeds: dict[str | int, np.ndarray], t_s: np.ndarray
) -> list[Slope]:
    """The best position for each speed, where one explains it. (N,) columns, stamps in s.

    The speed is integrated, which noise hardly disturbs, and compared with the position in pieces
    from which straight lines are taken.
    """
    rows = slice(0, _MOST_ROWS)
    t_s = t_s[rows]
    found = []
    for name, speed in speeds.items():
        best: Slope | None = None
        summed = _integral(speed[rows].astype(float), t_s)
        for other, position in positions.items():
            if other == name:
                continue
            factor, explained = _fit(summed, position[rows].astype(float), t_s)
            if explained >= _LEAST_EXPLAINED and (best is None or explained > best.explained):
                best = Slope(other, name, factor, explained)
        if best is not None:
            found.append(best)
    return found


def _integral(speed: np.ndarray, t_s: np.ndarray) -> np.ndarray:
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(t_s)
    return np.concatenate(([0.0], np.cumsum(np.nan_to_num(steps))))


def _fit(summed: np.ndarray, position: np.ndarray, t_s: np.ndarray) -> tuple[float, float]:
    """Factor and explained share of position by the integral, straight lines taken off."""
    usual_s = float(np.median(np.diff(t_s)))
    cuts = [0, *(np.flatnonzero(np.diff(t_s) > 5 * usual_s) + 1).tolist(), len(t_s)]
    left, right = [], []
    for start, stop in zip(cuts, cuts[1:], strict=False):
        for a in range(start, stop, _PIECE_ROWS):
            b = min(a + _PIECE_ROWS, stop)
            piece = position[a:b]
            if b - a < 20 or np.isnan(piece).any():
                continue
            left.append(_without_line(summed[a:b], t_s[a:b]))
            right.append(_without_line(piece, t_s[a:b]))
    if not left:
        return 0.0, 0.0
    x, y = np.concatenate(left), np.concatenate(right)
    xx, xy, yy = float(x @ x), float(x @ y), float(y @ y)
    if xx <= 0.0 or yy <= 0.0 or xy == 0.0:
        return 0.0, 0.0
    return xx / xy, xy * xy / (xx * yy)


def _without_line(values: np.ndarray, t_s: np.ndarray) -> np.ndarray:
    t = t_s - t_s.mean()
    centred = values - values.mean()
    return centred - t * float(t @ centred) / max(float(t @ t), 1e-300)


_PAIRS = tuple(
    (position, speed, unit(speed)[0])
    for position, speeds in (
        ("rad", ("rad/s", "deg/s", "rpm", "rev/s", "mrad/s")),
        ("deg", ("deg/s", "rad/s", "rpm", "rev/s")),
        ("rev", ("rev/s", "rpm", "rad/s", "deg/s")),
        ("mrad", ("mrad/s", "rad/s")),
        ("m", ("m/s", "mm/s", "cm/s")),
        ("mm", ("mm/s", "m/s", "cm/s")),
        ("cm", ("cm/s", "m/s", "mm/s")),
        ("inch", ("inch/s", "mm/s", "m/s")),
    )
    for speed in speeds
)


def unit_pairs(factor: float) -> list[tuple[str, str]]:
    """Units of position and speed between which a factor like this one stands."""
    return [
        (position, speed)
        for position, speed, per_speed in _PAIRS
        if abs(factor * per_speed / unit(position)[0] - 1.0) < _NEAR
    ]


def follows(command: np.ndarray, measured: np.ndarray) -> bool:
    """Whether a measured column goes where a command of the same unit asks it to."""
    both = ~(np.isnan(command) | np.isnan(measured))
    if both.sum() < 20:
        return False
    a, b = command[both][:_MOST_ROWS].astype(float), measured[both][:_MOST_ROWS].astype(float)
    if np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        return False
    size = np.ptp(b) / np.ptp(a)
    middle = abs(np.median(a) - np.median(b)) < 0.5 * max(np.ptp(a), np.ptp(b))
    rough = len(a) // 400 + 1
    lags = [round(k * len(a) / 400) for k in range(0, 20)]
    best = max(
        float(
            np.corrcoef(a[: len(a) - lag : rough], b[lag::rough][: len(a[: len(a) - lag : rough])])[
                0, 1
            ]
        )
        for lag in lags
    )
    return bool(0.5 < size < 1.6 and middle and best > 0.85)


def repeats_after(values: np.ndarray) -> int | None:
    """Rows after which a motion comes again, twice at least in the recording; None where it does
    not.
    """
    if len(values) < _LEAST_ROWS or np.isnan(values).any() or np.ptp(values) == 0.0:
        return None
    thin = len(values) // _MOST_ROWS + 1
    x = values[::thin].astype(float)
    rows = len(x)
    found = []
    for lag in _lags(x - x.mean()):
        a, b = x[: rows - lag], x[lag:]
        left = float(np.mean((a - b) ** 2)) / max(float(np.var(x)), 1e-300)
        found.append((left, lag))
    left, lag = min(found, default=(1.0, 0))
    return lag * thin if left < _LEFT_OF_A_LAP else None


def _lags(x: np.ndarray) -> list[int]:
    """The highest tops of the autocorrelation up to half of the recording."""
    power = np.abs(np.fft.rfft(x, 2 * len(x))) ** 2
    same = np.fft.irfft(power)[: len(x) // 2] / np.arange(len(x), len(x) - len(x) // 2, -1)
    below = np.flatnonzero(same < 0.0)
    if not len(below):
        return []
    same[: below[0]] = -1.0  # within a lap all is alike
    inner = same[1:-1]
    tops = np.flatnonzero((inner > same[:-2]) & (inner >= same[2:])) + 1
    return [int(top) for top in tops[np.argsort(same[tops])[-5:]]]


def encoder_unit(values: np.ndarray) -> str:
    """'rad' or 'deg' where all values lie on the steps of a turn in 2^8 to 2^16 parts; else ''."""
    distinct = np.unique(values[~np.isnan(values)].astype(float)[:_MOST_ROWS])
    if len(distinct) < 8:
        return ""
    steps = np.diff(distinct)
    step = float(steps[steps > 1e-9 * np.ptp(distinct)].min(initial=math.inf))
    for name, turn in (("rad", 2.0 * math.pi), ("deg", 360.0)):
        for bits in range(8, 17):
            one = turn / 2**bits
            if step < 0.9 * one:
                continue
            counts = (distinct - distinct[0]) / one
            off = np.abs(counts - np.rint(counts))
            rounding = 0.51 * 10.0 ** -_decimals(distinct) * 2 / one
            if off.max() < max(0.02, min(rounding, 0.12)) and counts.max() >= 8:
                return name
    return ""


def _decimals(values: np.ndarray) -> int:
    for digits in range(0, 12):
        if np.allclose(values, np.round(values, digits), rtol=0, atol=1e-13):
            return digits
    return 12
