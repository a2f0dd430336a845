"""What counts as one deviation where instruments' steps make gap-free runs differ."""

import numpy as np
import pytest

from epa_rt.gap.likelihood.significance import scatter, significance


def test_noise_is_not_significant_and_ten_percent_more_is():
    white = np.random.default_rng(1).standard_normal(20000)
    assert abs(significance(white)) < 3.0
    assert significance(white * np.sqrt(1.1)) == pytest.approx(10.0, abs=3.5)
    assert significance(np.zeros(0)) == 0.0


def twins(sizes):
    random = np.random.default_rng(2)
    return {"log": [size * random.standard_normal(5000) for size in sizes]}


def test_twins_that_differ_as_noise_does_count_as_they_are():
    assert scatter(lambda x: x, {}, twins([1.0] * 6)) == 1.0


def test_twins_that_differ_by_more_make_a_deviation_larger():
    loud = scatter(lambda x: x, {}, twins([0.8, 1.2, 0.8, 1.2, 0.8, 1.2]))
    assert loud == pytest.approx(0.4 * 50.0 / 3.0, rel=0.15)


def test_what_all_twins_share_is_taken_off_first_and_gaps_say_nothing():
    made = twins([1.0] * 6)
    made["log"] = [one + 3.0 for one in made["log"]]
    made["log"][2][:100] = np.nan
    assert scatter(lambda x: x, {"log": np.full(5000, 3.0)}, made) == 1.0


def test_one_twin_tells_no_scatter():
    assert scatter(lambda x: x, {}, twins([2.0])) == 1.0
