"""The low-pass that sums eight windows at once gives the bits of one that sums them one by one."""

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from epa_rt.gap.rig.house.decimate import BESIDE, decimated


def one_by_one(values: np.ndarray, taps: np.ndarray, every: int) -> np.ndarray:
    half, last = len(taps) // 2, len(values) - 1
    out = np.zeros(-(-len(values) // every))
    for j in range(len(out)):
        for i, tap in enumerate(taps):
            out[j] += tap * values[min(max(j * every - half + i, 0), last)]
    return out


@given(
    st.integers(1, 200),
    st.integers(1, 52),
    st.sampled_from([1, 2, 3, 10]),
    st.integers(0, 2**32 - 1),
)
@example(51 + BESIDE - 1, 51, 1, 0)  # one full block of windows
@example(51 + 10 * (BESIDE - 1), 51, 10, 0)
@settings(deadline=None, max_examples=200)
def test_bit_for_bit(count, width, every, seed):
    random = np.random.default_rng(seed)
    values, taps = (
        random.standard_normal(count) * 10.0 ** random.integers(-8, 8, count),
        random.standard_normal(width),
    )
    out = np.full(-(-count // every), np.nan)
    decimated(values, taps, every, out)
    assert out.tobytes() == one_by_one(values, taps, every).tobytes()


def test_nan_spreads_as_far_as_the_window():
    values, out = np.zeros(300), np.empty(300)
    values[150] = np.nan
    decimated(values, np.ones(51), 1, out)
    assert np.array_equal(np.flatnonzero(np.isnan(out)), np.arange(125, 176))
