"""Trials left out: the fit to the others is held a little to where all of them want it."""

import numpy as np
import pytest

from epa_rt.gap.likelihood.point import HELD, Normal

FOLDS = np.arange(4)


def normal(matrix, vector, square=1.0, prior=0.0, z=0.0) -> Normal:
    """One key, one link, four blocks that are a fold each: what every block knows of the key and
    where it pulls.
    """
    per_block = np.asarray(matrix, float)
    return Normal(
        ("key",),
        per_block[None, :, None, None],
        np.asarray(vector, float)[None, :, None],
        np.full((1, 4), square),
        np.array([z]),
        np.array([prior]),
        np.array([False]),
    )


def test_a_key_that_one_trial_alone_shows_is_not_thrown_away_by_the_others():
    """The others know a thousandth of it and would put it 1 spread off, at 1000 of chi-square."""
    lone = normal([1000.0, 0.4, 0.3, 0.3], [0.0, -0.4, -0.3, -0.3])
    free = float(lone.loss(lone.solved(np.array([0.0, 1.0, 1.0, 1.0])))[0, 0])
    assert free == pytest.approx(1001.0, rel=1e-3)
    step = 1.0 / (1.0 + HELD * 1001.0)  # the others' pull against what they know and what holds it
    assert lone.left_out(FOLDS)[0, 0] == pytest.approx(1.0 + 1000.0 * step**2, rel=1e-6)
    assert lone.left_out(FOLDS)[0, 0] < 5.0


def test_a_nominal_parameter_that_one_trial_alone_shows_does_not_go_back_to_the_plant_file():
    lone = normal(
        [1e4, 0.0, 0.0, 0.0], [-5.0, 0.0, 0.0, 0.0], prior=1.0, z=5.0
    )  # all trials together are content: pull and prior cancel
    assert lone.solved(np.ones(4)) == pytest.approx(0.0, abs=1e-9)
    back = -5.0 / (1.0 + HELD * 1e4)
    assert lone.left_out(FOLDS)[0, 0] == pytest.approx(
        1.0 - 2.0 * 5.0 * back + 1e4 * back**2, rel=1e-6
    )
    assert lone.left_out(FOLDS)[0, 0] < 0.01 * float(lone.loss(np.array([-5.0]))[0, 0])


def test_holding_takes_little_where_all_trials_show_the_key():
    alike = normal([100.0] * 4, [-30.0, 10.0, 10.0, 10.0])
    step = np.array([-30.0 / 300.0])  # block 0 under the three others, free
    assert alike.left_out(FOLDS)[0, 0] == pytest.approx(float(alike.loss(step)[0, 0]), rel=0.05)
    assert alike.left_out(FOLDS)[0, 0] > 1.0 + alike.square[0, 0]


def test_what_a_trial_wants_itself_has_no_part_in_how_it_is_judged():
    quiet, loud = normal([100.0] * 4, [0.0] * 4), normal([100.0] * 4, [-500.0, 0.0, 0.0, 0.0])
    assert loud.left_out(FOLDS)[0, 0] == quiet.left_out(FOLDS)[0, 0] == 1.0
    assert np.all(loud.left_out(FOLDS)[0, 1:] > 1.0)
