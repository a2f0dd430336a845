"""A recorded trial tells what other gains make of it, and which feedforward it asks for."""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.tune.controller import Gains, Loop
from epa_rt.tune.followed import followed_from, trial_of
from tests.tune.plants import DT_S, closed_loop, resonant

HIGHEST_HZ = 14.0
PRESENT = Gains(kp=0.03, ki=0.3, feedforward=0.12)
LOOP = Loop("joint", "joint_angle", "y", "r", "v", "u", "rad", 1.0, DT_S, PRESENT)


def chirp(seconds=12.0) -> np.ndarray:
    """0.5 to 2 Hz, faded in and out over 2 s."""
    t_s = np.arange(0.0, seconds, DT_S)
    phase = 2.0 * np.pi * (0.5 * t_s + 1.5 * t_s**2 / (2.0 * seconds))
    fade = np.clip(np.minimum(t_s, seconds - t_s) / 2.0, 0.0, 1.0)
    return 0.1 * np.sin(0.5 * np.pi * fade) ** 2 * np.sin(phase)


def ran(gains: Gains):
    reference = chirp()
    noise = 1e-5 * np.random.default_rng(1).standard_normal(len(reference))
    return closed_loop(reference, noise, gains.kp, gains.ki, gains.feedforward)


def rms(trial) -> float:
    return float(np.std(trial.reference - trial.output))


@pytest.fixture(scope="module")
def followed():
    """The trial with the present gains; the shape between its frequencies is a tenth too large."""
    return followed_from(LOOP, ran(PRESENT), lambda hz: 1.1 * resonant(hz), HIGHEST_HZ)


@pytest.mark.parametrize(
    "gains",
    [PRESENT, Gains(0.015, 0.2, feedforward=0.12), Gains(0.03, 0.5, feedforward=0.06)],
    ids=["present", "softer", "less feedforward"],
)
def test_what_other_gains_make_of_the_trial_is_told_before_it_is_run(followed, gains):
    assert followed.tracking(gains) == pytest.approx(rms(ran(gains)), rel=0.05)
    assert followed.trace(gains).rms_error == pytest.approx(followed.tracking(gains), rel=1e-6)


def test_the_feedforward_found_tracks_better_than_any_near_it(followed):
    found = followed.with_feedforward(PRESENT)
    best = followed.tracking(found)
    assert best < 0.5 * followed.tracking(PRESENT)
    for name in ("feedforward", "feedforward_speed_s", "feedforward_acceleration_s2"):
        for factor in (0.9, 1.1):
            other = replace(found, **{name: factor * getattr(found, name)})
            assert followed.tracking(other) > best


def test_a_motion_of_one_frequency_leaves_what_it_does_not_tell_apart():
    t_s = np.arange(0.0, 12.0, DT_S)
    trial = closed_loop(0.1 * np.sin(2.0 * np.pi * t_s), np.zeros(len(t_s)))
    one = followed_from(LOOP, trial, resonant, HIGHEST_HZ)
    found = one.with_feedforward(PRESENT)
    assert one.tracking(found) < 0.5 * one.tracking(PRESENT)
    assert abs(found.feedforward) < 1.0 and abs(found.feedforward_acceleration_s2) < 0.01


def test_only_a_trial_of_that_motion_counts():
    trial = ran(PRESENT)
    motion = chirp()
    assert trial_of([trial], motion) is trial
    assert trial_of([trial], motion[:6000]) is trial
    assert trial_of([trial], 1.1 * motion) is None
    assert trial_of([replace(trial, reference=motion[:6000])], motion) is None


def test_the_command_is_the_recorded_one_and_what_other_gains_change_of_it(followed):
    assert np.array_equal(followed.trace(PRESENT).command, followed.trial.command)
    softer = Gains(0.015, 0.2, feedforward=0.12)
    changed = followed.trace(softer).command - ran(softer).command
    assert np.std(changed) < 0.05 * np.std(followed.trial.command)
