"""The share of a gap that is closed: right, unclipped, with an interval that holds the truth as
often as it says.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.gap.held_out.share import Squares, share, squares

MILLI = st.floats(0.1, 10.0)


@given(before=MILLI, after=MILLI, floor=MILLI)
@settings(deadline=None, max_examples=50)
def test_constant_misfits_give_the_formula(before, after, floor):
    one = share([squares(np.full(300, before), np.full(300, after), floor, 100)])
    assert (one.before, one.after, one.floor) == pytest.approx((before, after, floor))
    assert one.times_floor == pytest.approx(after / floor)
    if before > 1.06 * floor:
        assert one.closed == pytest.approx(1.0 - (after**2 - floor**2) / (before**2 - floor**2))
        assert one.interval == pytest.approx((one.closed, one.closed))
    elif before < 1.04 * floor:
        assert one.closed is None and one.interval is None


def test_a_patch_that_makes_it_worse_has_a_negative_share_and_one_below_the_floor_more_than_one():
    worse = share([squares(np.full(300, 2.0), np.full(300, 3.0), 1.0, 100)])
    below = share([squares(np.full(300, 2.0), np.full(300, 0.5), 1.0, 100)])
    assert worse.closed < 0.0 and below.closed > 1.0


def test_samples_that_are_not_judged_count_nowhere():
    before, after = np.full(300, 2.0), np.full(300, 1.5)
    before[:100], after[150:160] = np.nan, np.nan
    one = squares(before, after, 1.0, 100)
    assert one.samples.tolist() == [0.0, 90.0, 100.0]
    assert share([one]).before == pytest.approx(2.0)


def test_nothing_judged_is_no_share():
    assert share([squares(np.full(10, np.nan), np.ones(10), 1.0, 5)]) is None
    assert share([]) is None


def test_the_interval_holds_the_truth_about_as_often_as_it_says():
    """Misfits of known size: before 2, after 1.2, floor 1, white noise; 95 % asked of 300 draws."""
    rng, truth, held = np.random.default_rng(3), 1.0 - (1.44 - 1.0) / (4.0 - 1.0), 0
    for k in range(300):
        noise = rng.normal(size=4000)
        low, high = share(
            [squares(2.0 * noise, 1.2 * rng.normal(size=4000), 1.0, 100)], seed=k
        ).interval
        held += low <= truth <= high
    assert 0.90 <= held / 300 <= 0.99


def test_logs_that_differ_widen_the_interval():
    rng = np.random.default_rng(0)

    def log(after: float) -> Squares:
        return squares(3.0 * rng.normal(size=3000), after * rng.normal(size=3000), 1.0, 100)

    alike, apart = share([log(1.5), log(1.5), log(1.5)]), share([log(1.1), log(1.5), log(1.9)])
    assert apart.interval[1] - apart.interval[0] > 2.0 * (alike.interval[1] - alike.interval[0])
