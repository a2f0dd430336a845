"""Zero-phase filters on the bus's grid: the one low-pass of all residuals, held encoder readings,
clean derivatives.
"""

import numpy as np
from scipy.signal import lfilter

from epa_rt.gap.rig.house.decimate import decimated

EVERY = 10  # residuals keep every tenth cycle
HALF = 25  # half length of the residuals' low-pass (cycles)
CUT = 0.042  # its edge, per cycle
# deviation of the Gaussian below which the angle's slope is believed, above it the speed reading
FUSE_CYCLES = 19.0
# Gaussian (twice, flat) on a joint's or mass's position: a converter's steps would be jerks
PLACE_CYCLES = 6.0

# the same on a pressure before its slope takes the sensor's lag off: noise there would pull on the
# lag
SLOPE_CYCLES = 15.0


def _lowpass_taps() -> np.ndarray:
    k = np.arange(-HALF, HALF + 1)
    taps = np.sinc(2.0 * CUT * k) * np.kaiser(2 * HALF + 1, 3.5)
    return taps / taps.sum()


TAPS = _lowpass_taps()


def gaussian_taps(cycles: float) -> np.ndarray:
    """(2 int(3.5 cycles) + 1,) of a Gaussian with a deviation of so many cycles, cut off at 3.5 of
    it; their sum is 1.
    """
    k = np.arange(-int(3.5 * cycles), int(3.5 * cycles) + 1)
    taps = np.exp(-0.5 * (k / cycles) ** 2)
    return taps / taps.sum()


def at_rate(values: np.ndarray) -> np.ndarray:
    """(N,) to (ceil(N / EVERY),): zero-phase low-pass and decimation."""
    out = np.empty(-(-len(values) // EVERY))
    decimated(values, TAPS, EVERY, out)
    return out


def smoothed(values: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """(N,) zero-phase; the ends are mirrored about the end point, so that a ramp stays a ramp."""
    half = len(taps) // 2
    if len(values) <= half:
        return values.copy()
    padded = np.concatenate(
        [2 * values[0] - values[half:0:-1], values, 2 * values[-1] - values[-2 : -half - 2 : -1]]
    )
    out = np.empty(len(padded))
    decimated(padded, taps, 1, out)
    return out[half:-half]


def flat_smoothed(values: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """(N,) as ``smoothed``, its pass band made flat: what it takes off, smoothed once more, is
    given back.
    """
    once = smoothed(values, taps)
    return once + smoothed(values - once, taps)


def two_poles(values: np.ndarray, hertz: float, period_s: float) -> np.ndarray:
    """(N,) through two equal first-order low-passes, one after the other, from rest at the first
    value.
    """
    keep = np.exp(-2.0 * np.pi * hertz * period_s)
    once = [(1.0 - keep) ** 2], [1.0, -2.0 * keep, keep * keep]
    return values[0] + lfilter(*once, values - values[0])


def slope(values: np.ndarray, period_s: float) -> np.ndarray:
    """(N,) derivative by fourth-order central differences."""
    out = np.gradient(values, period_s)
    out[2:-2] = (8.0 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])) / (
        12.0 * period_s
    )
    return out


def any_near(bad: np.ndarray, reach: int = HALF) -> np.ndarray:
    """(ceil(N / EVERY),) bool: is any of ``bad`` (N,) within ``reach`` cycles of the sample."""
    total = np.concatenate([[0], np.cumsum(bad)])
    centre = np.arange(0, len(bad), EVERY)
    return total[np.minimum(centre + reach + 1, len(bad))] > total[np.maximum(centre - reach, 0)]


def any_before(flags: np.ndarray, cycles: int) -> np.ndarray:
    """(N,) bool: is any of ``flags`` (N,) True here or within some cycles before."""
    total = np.concatenate([[0], np.cumsum(flags)])
    k = np.arange(len(flags)) + 1
    return total[k] > total[np.maximum(k - 1 - cycles, 0)]


def bridged(values: np.ndarray) -> np.ndarray:
    """(N,) with NaN replaced by straight lines."""
    good = np.isfinite(values)
    if good.all():
        return values.astype(float)
    if not good.any():
        return np.zeros(len(values))
    return np.interp(np.arange(len(values)), np.flatnonzero(good), values[good])


def runs(flags: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and last + 1 cycle of every run of True in (N,) bool, (runs,) each."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def long_runs(bad: np.ndarray, longest: int) -> np.ndarray:
    """(N,) bool: where more than ``longest`` in a row are bad."""
    found = np.zeros(len(bad), bool)
    for start, stop in zip(*runs(bad), strict=True):
        found[start:stop] = stop - start > longest
    return found


def filled_by_hold(values: np.ndarray, hold: int, phase: int) -> np.ndarray:
    """A held reading (N,) whose gaps (NaN) have what another cycle of the same hold has shown."""
    gaps = np.flatnonzero(~np.isfinite(values))
    found = values.copy()
    for k in gaps if hold > 1 else ():
        first = k - (k - phase) % hold
        same = values[max(first, 0) : first + hold]
        found[k] = next((value for value in same if np.isfinite(value)), np.nan)
    return found


def hold_phase(values: np.ndarray, hold: int) -> int:
    """On which cycle of ``hold`` a held reading renews, from where it changes."""
    if hold <= 1:
        return 0
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    return int(np.bincount(changes % hold, minlength=hold).argmax()) if len(changes) else 0


def renewed(values: np.ndarray, hold: int, phase: int) -> np.ndarray:
    """A held reading (N,) drawn through its fresh samples alone, by cubics."""
    if hold <= 1:
        return values
    fresh = np.arange(phase, len(values), hold)
    if len(fresh) < 4:
        return values
    from scipy.interpolate import CubicSpline

    return CubicSpline(fresh, values[fresh])(np.clip(np.arange(len(values)), fresh[0], fresh[-1]))
