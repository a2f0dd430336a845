"""The same motion, read again: a twin of a recording in which given numbers hold, for rigs that cannot be run from their commands alone.

A balance takes its motion from readings. Their noise goes into speeds, accelerations and reversals, is no longer noise of the output there, and shifts what is fitted in all
blocks alike, which no scatter of blocks shows (errors in variables: with 0.05 mrad of noise at 500 Hz a pendulum's weight came out 0.1 % small, where the blocks' interval was 0.02 % wide).
A twin whose numbers are known, read with the same noise and steps and fitted the same way, shows by how much (gap/astray.py).
"""

from dataclasses import replace

import numpy as np

from epa_rt.gap.foreign.component import Component, Numbers
from epa_rt.gap.foreign.signals import Signals
from epa_rt.gap.hygiene_values import noise_of, smallest_step

LEAST_DITHER = 0.1   # of a step: noise before rounding, where the record does not show more
REACH = 512          # rows by which a record is continued at its ends, upside down, so that its ends are no jump to the transform
SEGMENT = 1024       # rows of a windowed spectrum
TWICE = 2.0          # times the noise, from which something stands out of it: its averages lie within a half of it


def read_again(component: Component, signals: Signals, numbers: Numbers, seed: int) -> dict[str, np.ndarray]:
    """(N,) by role: the motion without its noise and the outputs that ``numbers`` ask of it, all read as the recording's were."""
    random, outputs = np.random.default_rng(seed), {role: link.name for link, role in component.links}
    clean = {role: x if role in outputs else without_noise(x) for role, x in signals.columns.items()}
    work = component.prepare(replace(signals, columns=clean), numbers)
    clean |= {role: clean[role] - component.residual(work, numbers, link) for role, link in outputs.items()}
    return {role: _as_read(x, signals.columns[role], random) for role, x in clean.items()}


def without_noise(x: np.ndarray) -> np.ndarray:
    """(N,) what stands out of the white noise of a reading, frequency by frequency (Wiener's filter over the whole record).

    Not the low-pass of the residuals: noise that it let through would be motion to the twin. What stands out is seen in windowed stretches, into which a record's ends do not leak.
    """
    from scipy.signal import welch

    hertz, power = welch(x, nperseg=min(SEGMENT, len(x)), detrend="linear")
    share = np.clip(1.0 - TWICE * 2.0 * noise_of(x) ** 2 / np.maximum(power, np.finfo(float).tiny), 0.0, 1.0)
    reach = min(REACH, len(x) - 1)
    longer = np.concatenate([2.0 * x[0] - x[reach:0:-1], x, 2.0 * x[-1] - x[-2:-reach - 2:-1]])
    line = np.linspace(longer[0], longer[-1], len(longer))
    kept = np.interp(np.fft.rfftfreq(len(longer)), hertz, share) * np.fft.rfft(longer - line)
    return (np.fft.irfft(kept, len(longer)) + line)[reach:reach + len(x)]


def _as_read(clean: np.ndarray, like: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """(N,) with the white noise of a reading and, where that is not far below them, its steps."""
    step = smallest_step(like)
    noise = np.sqrt(max(noise_of(like) ** 2 - step**2 / 12.0, (LEAST_DITHER * step) ** 2))
    read = clean + noise * random.standard_normal(len(clean))
    return np.round(read / step) * step if step > LEAST_DITHER * noise else read
