"""Counter-based Gaussian noise: any program with the seed gets the same numbers, in any order."""

import math

import numpy as np

from epa_rt.models.compiled import compiled

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
_MIX1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX2 = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_CHANNELS = np.uint64(64)


@compiled
def splitmix(counter):
    """64 mixed bits of a counter (splitmix64's output function after one step)."""
    z = counter + _GAMMA
    z = (z ^ (z >> _S30)) * _MIX1
    z = (z ^ (z >> _S27)) * _MIX2
    return z ^ (z >> _S31)


@compiled
def uniform(bits):
    """A number in (0, 1] from the upper 53 bits."""
    return (np.float64(bits >> _S11) + 1.0) * (1.0 / 9007199254740992.0)


@compiled
def gaussian(seed, cycle, channel):
    """Standard normal number of (seed, cycle, channel): Box-Muller on two splitmix64 outputs."""
    start = splitmix(splitmix(np.uint64(seed)) + np.uint64(cycle) * _CHANNELS + np.uint64(2 * channel))
    other = splitmix(start)
    return math.sqrt(-2.0 * math.log(uniform(start))) * math.cos(2.0 * math.pi * uniform(other))
