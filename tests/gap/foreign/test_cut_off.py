"""A channel of a stranger's rig that is cut off at its ends for most of the time is said, with both
ends, and not taken for a calm one.
"""

import numpy as np
import pytest

from epa_rt.gap.hygiene.values import check_values
from epa_rt.gap.recording import Recording
from tests.gap.foreign.made import one_trial


def recording(force_n: np.ndarray) -> Recording:
    return one_trial("log0", "cart", 2e-3, {"force_n": force_n})


def force(size_n: float) -> np.ndarray:
    t = np.arange(6000) * 2e-3
    return size_n * np.sin(2 * np.pi * 0.4 * t) + np.random.default_rng(1).normal(0.0, 0.3, len(t))


@pytest.mark.parametrize("size_n", [25.0, 60.0])
def test_both_ends_of_a_range_are_said_however_long_the_channel_lies_there(size_n):
    cut = np.clip(force(size_n), -20.0, 20.0)
    (finding,) = check_values(recording(cut), None)
    assert finding.severity == "exclude" and finding.kind == "saturated"
    assert "-20, its lowest value and 20, its highest value" in finding.says
    share = np.mean(np.abs(cut) == 20.0)
    assert sum(b - a for a, b in finding.rows) == pytest.approx(share * len(cut), rel=0.05)


def test_one_that_is_not_cut_off_is_let_through():
    assert check_values(recording(force(25.0)), None) == []


def test_a_log_that_begins_at_the_end_of_a_range_is_no_calm_one():
    """Its first hundred rows lie on the rail: what noise it has shows later."""
    fall = np.minimum(
        30.0 * np.exp(-np.arange(6000) / 4000.0) + np.random.default_rng(1).normal(0.0, 0.05, 6000),
        28.0,
    )
    (finding,) = check_values(recording(fall), None)
    assert finding.kind == "saturated" and finding.rows[0][0] == 0
