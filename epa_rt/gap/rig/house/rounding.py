"""What a converter's steps do to the mean of a still reading, and how its own noise lets that be
taken back.

A still value x with noise s before rounding to steps of q reads x + b(x) on average, b = -(q/pi)
exp(-2 pi^2 s^2/q^2) sin(2 pi x/q) and higher terms (Widrow and Kollar, Quantization Noise, 2008).
What moves by a step within the window is smeared and keeps its mean.
"""

import numpy as np

from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.channels import Channel
from epa_rt.gap.rig.house.noise import noise_level

WINDOW_CYCLES = 40.0  # deviation of the Gaussian that makes the mean
LEAST, MOST = (
    0.2,
    0.5,
)  # noise in steps: below, the mean says too little; above, nothing is to be done
ROUNDS = 12


def unrounded(readings: np.ndarray, channel: Channel) -> np.ndarray:
    """(N,) readings of a converter, shifted so that their local mean is that of the value before
    rounding.
    """
    if channel.step == 0.0:
        return readings
    spread = noise_level(readings, channel.step) / channel.step
    if not LEAST <= spread <= MOST:
        return readings
    mean = smooth.smoothed(
        (readings - channel.anchor) / channel.step, smooth.gaussian_taps(WINDOW_CYCLES)
    )
    moved = np.gradient(mean) * WINDOW_CYCLES
    share = np.exp(-2.0 * np.pi**2 * (spread**2 + moved**2))
    value = mean.copy()
    for _ in range(ROUNDS):
        value = mean - _added(value, share)
    return readings + channel.step * (value - mean)


def _added(value: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Mean rounding error in steps of values in steps; ``share``: of the first harmonic that noise
    leaves.
    """
    return (
        0.5 * share**4 * np.sin(4.0 * np.pi * value) - share * np.sin(2.0 * np.pi * value)
    ) / np.pi
