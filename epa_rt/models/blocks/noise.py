"""Counter-based noise, Gaussian to the eye: any program with the seed gets the same numbers, in any
order.
"""

import numpy as np

from epa_rt.models.compiled import compiled

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX2 = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31 = np.uint64(30), np.uint64(27), np.uint64(31)
_S16, _S32, _S48, _LOW = np.uint64(16), np.uint64(32), np.uint64(48), np.uint64(0xFFFF)
_CHANNELS = np.uint64(64)


@compiled
def splitmix(counter):
    """64 mixed bits of a counter (splitmix64's output function after one step)."""
    z = counter + _GAMMA
    z = (z ^ (z >> _S30)) * _MIX1
    z = (z ^ (z >> _S27)) * _MIX2
    return z ^ (z >> _S31)


@compiled
def quarters(bits):
    """Sum of the four 16-bit quarters of 64 bits."""
    return (
        np.int64(bits & _LOW)
        + np.int64((bits >> _S16) & _LOW)
        + np.int64((bits >> _S32) & _LOW)
        + np.int64(bits >> _S48)
    )


@compiled
def gaussian(seed, cycle, channel):
    """Nearly normal number of (seed, cycle, channel), mean 0, deviation 1, never beyond 6: the sum
    of twelve uniforms.

    Whole numbers up to the last division, so that every program and every mathematics library gets
    the same bits.
    """
    first = splitmix(
        splitmix(np.uint64(seed)) + np.uint64(cycle) * _CHANNELS + np.uint64(2 * channel)
    )
    second = splitmix(first)
    total = quarters(first) + quarters(second) + quarters(splitmix(second))
    return (
        total - 393210
    ) / 65536.0  # twelve times the mean of 0..65535; the variance of the sum is 65536^2 - 1
