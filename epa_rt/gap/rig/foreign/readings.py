"""How a simulated channel would have been read: with the recording's own sample noise, slow noise
and steps.
"""

import numpy as np

from epa_rt.gap.hygiene.values import smallest_step
from epa_rt.gap.rig.foreign.rig_file import ForeignRig
from epa_rt.gap.rig.foreign.signals import Signals

# of a recording; the middle one by its scatter shows the noise, wilder ones the signal itself
BLOCKS = 15
LEAST_DITHER = 0.1  # noise before rounding, in steps, where the record does not show more
OFF_GRID = 0.05  # of a step, to which readings that have one lie on its grid


def as_read(
    made: np.ndarray, signals: Signals, role: str, rig: ForeignRig, rng: np.random.Generator
) -> np.ndarray:
    """(N,) with sample noise as the record's scatter about smooth curves has it, the rig's slow
    noise, rounded to the steps that the rig file says, or that the record lies on.
    """
    step = rig.steps.get(role) or step_of(signals.columns[role][signals.valid[role]])
    noise = np.sqrt(max(_scatter(signals, role) ** 2 - step**2 / 12.0, (LEAST_DITHER * step) ** 2))
    read = (
        made
        + noise * rng.standard_normal(len(made))
        + _slow(len(made), signals.rate_hz, *rig.slow_noise.get(role, (0.0, 1.0)), rng)
    )
    return np.round(read / step) * step if step > 0.0 else read


def step_of(read: np.ndarray) -> float:
    """The step on whose grid all values of a reading lie; 0 where there is none: two of many values
    without steps may lie close by chance.
    """
    step = smallest_step(read)
    places = (read - read[0]) / step if step > 0.0 else np.zeros(0)
    return (
        step if len(places) and float(np.max(np.abs(places - np.round(places)))) < OFF_GRID else 0.0
    )


def _scatter(signals: Signals, role: str) -> float:
    """Deviation of a channel's samples from smooth curves, as far apart as the low-pass lets
    through: what was read on another clock and interpolated has too little of it from one sample to
    the next.
    """
    apart = max(1, round(0.5 * signals.rate_hz / signals.lowpass_hz))
    x = np.where(signals.valid[role], signals.columns[role], np.nan)
    square = (x[2 * apart :] - 2.0 * x[apart:-apart] + x[: -2 * apart]) ** 2
    means = [
        float(np.nanmean(part))
        for part in np.array_split(square, BLOCKS)
        if np.isfinite(part).any()
    ]
    return float(np.sqrt(np.median(means) / 6.0)) if means else 0.0


def _slow(
    count: int, rate_hz: float, rms: float, time_s: float, rng: np.random.Generator
) -> np.ndarray:
    from scipy.signal import lfilter, lfiltic

    kept = np.exp(-1.0 / (rate_hz * time_s))
    taps = ([rms * np.sqrt(1.0 - kept**2)], [1.0, -kept])
    return lfilter(
        *taps, rng.standard_normal(count), zi=lfiltic(*taps, [rms * rng.standard_normal()])
    )[0]
