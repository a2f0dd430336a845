"""Noise by the recipe of docs/plant.md, in plain Python integers."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.models.blocks import noise

MASK = 2**64 - 1


def splitmix(counter: int) -> int:
    z = (counter + 0x9E3779B97F4A7C15) & MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def test_splitmix_against_the_published_sequence():
    """First outputs of splitmix64 seeded with 1234567."""
    state, wanted = 1234567, (6457827717110365317, 3203168211198807973, 9817491932198370423)
    for value in wanted:
        assert splitmix(state) == value == int(noise.splitmix(np.uint64(state)))
        state = (state + 0x9E3779B97F4A7C15) & MASK


@given(st.integers(0, 2**53 - 1), st.integers(0, 10**9), st.integers(0, 10))
def test_the_recipe_in_plain_python(seed, cycle, channel):
    start = splitmix((splitmix(seed) + 64 * cycle + 2 * channel) & MASK)
    words = [start, splitmix(start), splitmix(splitmix(start))]
    total = sum((word >> shift) & 0xFFFF for word in words for shift in (0, 16, 32, 48))
    assert noise.gaussian(float(seed), cycle, channel) == (total - 12 * 65535 // 2) / 65536


def test_it_is_standard_normal_and_independent():
    a = np.array([noise.gaussian(1.0, k, 4) for k in range(20000)])
    b = np.array([noise.gaussian(1.0, k, 5) for k in range(20000)])
    assert abs(a.mean()) < 0.03 and abs(a.std() - 1) < 0.02
    assert abs(np.mean(a * b)) < 0.03 and abs(np.mean(a[1:] * a[:-1])) < 0.03
