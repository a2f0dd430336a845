"""The same motion, read again: a twin of a recording in which given numbers hold, for rigs that
cannot be run from their commands alone.

A balance takes its motion from readings. Their noise goes into speeds, accelerations and reversals,
is no longer noise of the output there, and shifts what is fitted in all blocks alike, which no
scatter of blocks shows (errors in variables: with 0.05 mrad of noise at 500 Hz a pendulum's weight
came out 0.1 % small, where the blocks' interval was 0.02 % wide). A twin whose numbers are known,
read with the same noise and steps and fitted the same way, shows by how much (astray.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from epa_rt.gap.hygiene.values import noise_of
from epa_rt.gap.rig.foreign.component import Component, Numbers
from epa_rt.gap.rig.foreign.readings import LEAST_DITHER, step_of
from epa_rt.gap.rig.foreign.signals import Signals

SEGMENT, LEAST = 1024, 64  # rows of a windowed spectrum, and at least
SPECTRA = 8  # that are averaged, where a record is long enough
TWICE = 2.0  # times the noise, from which something stands out of it


@dataclass(frozen=True)
class Readings:
    """A recording's channels by role, (N,): ``clean`` of their noise but for outputs; the ``steps``
    in which each is read, and the deviation of its ``noise`` before that.
    """

    signals: Signals
    clean: Mapping[str, np.ndarray]
    steps: Mapping[str, float]
    noise: Mapping[str, float]


def readings_of(component: Component, signals: Signals, steps: Mapping[str, float]) -> Readings:
    """What every twin of a recording is made of. ``steps``: of readings, where the rig file says
    them.
    """
    outputs = {role for _, role in component.links}
    steps = {
        role: steps.get(role) or step_of(x[signals.valid[role]])
        for role, x in signals.columns.items()
    }
    spectra = {role: _spectrum(x)[1] for role, x in signals.columns.items()}
    clean = {
        role: x if role in outputs else _stands_out(x, steps[role], spectra[role])
        for role, x in signals.columns.items()
    }
    noise = {role: _dither(x, steps[role], spectra[role]) for role, x in signals.columns.items()}
    return Readings(signals, clean, steps, noise)


def read_again(
    component: Component, readings: Readings, numbers: Numbers, random: np.random.Generator | None
) -> dict[str, np.ndarray]:
    """(N,) by role: the motion without its noise and the outputs that ``numbers`` ask of it, all
    read as the recording's were; without noise and steps where ``random`` is None.

    For kinds whose residual is what was measured less what the other channels foresee.
    """
    clean = dict(readings.clean)
    work = component.prepare(replace(readings.signals, columns=clean), numbers)
    clean |= {
        role: clean[role] - component.residual(work, numbers, link.name)
        for link, role in component.links
    }
    if random is None:
        return clean
    return {
        role: _as_read(x, readings.noise[role], readings.steps[role], random)
        for role, x in clean.items()
    }


def without_noise(x: np.ndarray, step: float = 0.0) -> np.ndarray:
    """(N,) what stands out of the white noise (and the ``step``) of a reading, frequency by
    frequency (Wiener's filter).

    Not the low-pass of the residuals: noise that it let through would be motion to the twin. What
    stands out is seen in windowed stretches, into which a record's ends do not leak.
    """
    return _stands_out(x, step, _spectrum(x)[1])


def _stands_out(x: np.ndarray, step: float, power: np.ndarray) -> np.ndarray:
    share = np.clip(
        1.0 - TWICE * 2.0 * _noise(x, step, power) ** 2 / np.maximum(power, np.finfo(float).tiny),
        0.0,
        1.0,
    )
    share[:2] = (
        1.0  # a line was taken off every stretch: its spectrum says nothing of what is slower
    )
    return _filtered(x, share)


def _filtered(x: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(N,) with ``share`` (at evenly spaced frequencies) of every frequency kept, by a filter no
    longer than a stretch: what a record's ends do to it stays near them.

    A record is continued at its ends upside down, so that they are no jump.
    """
    from scipy.signal import fftconvolve

    taps = np.roll(np.fft.irfft(share), len(share) - 1)
    taps = np.append(taps, taps[0]) * np.hanning(len(taps) + 1)
    reach = min(len(share) - 1, len(x) - 1)
    longer = np.concatenate([2.0 * x[0] - x[reach:0:-1], x, 2.0 * x[-1] - x[-2 : -reach - 2 : -1]])
    return fftconvolve(longer, taps / taps.sum(), "same")[reach : reach + len(x)]


def _spectrum(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies per row and power density (one-sided: white noise of deviation s has 2 s^2)."""
    from scipy.signal import welch

    return welch(x, nperseg=min(SEGMENT, max(len(x) // SPECTRA, LEAST), len(x)), detrend="linear")


def _noise(x: np.ndarray, step: float, power: np.ndarray) -> float:
    """Deviation of a reading's white noise, steps included: by fourth differences, or less where
    the upper half of its spectrum has less (at 100 Hz a quick motion shows in differences).
    """
    return max(
        min(noise_of(x), float(np.sqrt(0.5 * np.median(power[len(power) // 2 :])))),
        step / np.sqrt(12.0),
    )


def _dither(x: np.ndarray, step: float, power: np.ndarray) -> float:
    """Deviation of the white noise of a reading before it takes its steps."""
    square = max(_noise(x, step, power) ** 2 - step**2 / 12.0, (LEAST_DITHER * step) ** 2)
    return float(np.sqrt(square))


def _as_read(
    clean: np.ndarray, noise: float, step: float, random: np.random.Generator
) -> np.ndarray:
    """(N,) with the white noise of a reading and its steps."""
    read = clean + noise * random.standard_normal(len(clean))
    return np.round(read / step) * step if step > 0.0 else read
