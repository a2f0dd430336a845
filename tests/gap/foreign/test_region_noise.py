"""Noise by region: what is weighed has one size, and a run's levels are the best that their bounds
allow.
"""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.gap.rig.foreign.region_noise import region_noise
from epa_rt.gap.rig.foreign.since import BOUND, _within


def run(seed: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Ten times the noise near standstill, three times while it turns."""
    random = np.random.default_rng(seed)
    speed, turning = random.uniform(-1.0, 1.0, 4000), random.uniform(-1.0, 1.0, 4000)
    size = 0.2 * np.where(np.abs(speed) < 0.1, 10.0, 1.0) * np.where(np.abs(turning) > 0.8, 3.0, 1)
    left = size * random.standard_normal(4000)
    left[:100] = np.nan
    return left, {"speed_m_s": speed, "acceleration_m_s2": turning}


def test_what_is_weighed_has_one_size_in_every_region():
    left, features = zip(*(run(seed) for seed in range(4)), strict=True)
    found = region_noise(left, features)
    own, states = run(9)
    even = found.weights(states) * own
    slow, turns = np.abs(states["speed_m_s"]) < 0.08, np.abs(states["acceleration_m_s2"]) > 0.82
    for rows in (slow & turns, slow & ~turns, ~slow & turns, ~slow & ~turns):
        assert 0.7 < np.sqrt(np.nanmean(even[rows] ** 2)) / found.rms < 1.3


def test_slower_than_the_runs_say_anything_of_nothing_is_weighed():
    left, features = zip(*(run(seed) for seed in range(4)), strict=True)
    found = region_noise(left, features)
    speeds = np.array([0.0, 0.5 * found.slowest["speed_m_s"], 0.05])
    assert 0.0 < found.slowest["speed_m_s"] < 0.01
    weights = found.weights({"speed_m_s": speeds, "acceleration_m_s2": np.zeros(3)})
    assert list(np.isnan(weights)) == [True, True, False]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 8), st.floats(0.1, 10.0))
def test_no_levels_within_the_bounds_suit_a_run_better(seed, count, far):
    random = np.random.default_rng(seed)
    shapes = random.standard_normal((200, count)) @ (
        np.eye(count) + 0.6 * random.standard_normal((count, count))
    )
    spread, noise = np.exp(random.standard_normal(count)), random.standard_normal(300)
    left = shapes @ (far * spread * random.standard_normal(count)) + random.standard_normal(200)

    def cost(z: np.ndarray) -> float:
        rest = left - shapes @ (z * spread)
        return float(rest @ rest / np.nanvar(noise) + z @ z)

    found = _within(left, shapes, spread, noise) / spread
    assert np.all(np.abs(found) <= BOUND * (1.0 + 1e-9))
    for _ in range(50):
        other = np.clip(found + 0.1 * random.standard_normal(count), -BOUND, BOUND)
        assert cost(found) <= cost(other) * (1.0 + 1e-9)
