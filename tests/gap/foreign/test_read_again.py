"""Twins of a motion that was measured: what stands out of a reading's noise, and the same motion
read again.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.gap.hygiene.values import noise_of
from epa_rt.gap.rig.foreign.read_again import without_noise
from epa_rt.gap.rig.foreign.readings import step_of
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.test_strange_shafts import HANGS, RIG, swing

PERIOD_S = 2e-3


@settings(max_examples=20, deadline=None)
@given(
    noise=st.floats(3e-6, 1e-3),
    slow_hz=st.floats(0.1, 1.0),
    fast_hz=st.floats(1.0, 4.0),
    drift=st.floats(-1.0, 1.0),
    seed=st.integers(0, 99),
)
def test_what_stands_out_of_the_noise_is_the_motion(noise, slow_hz, fast_hz, drift, seed):
    t = np.arange(0.0, 16.0, PERIOD_S)
    truth = (
        np.sin(2 * np.pi * slow_hz * t) + 0.2 * np.sin(2 * np.pi * fast_hz * t + 1.0) + drift * t
    )
    clean = without_noise(truth + noise * np.random.default_rng(seed).standard_normal(len(t)))
    inner = slice(1000, -1000)  # both ends are judged nowhere
    assert np.std((clean - truth)[inner]) < 0.5 * noise
    assert noise_of(clean) < 0.1 * noise


def test_a_reading_without_noise_stays_as_it_is():
    x = np.sin(np.arange(0.0, 16.0, PERIOD_S))
    assert without_noise(x) == pytest.approx(x, abs=1e-9)


@given(step=st.floats(1e-6, 1e-2), zero=st.floats(-1.0, 1.0), seed=st.integers(0, 99))
def test_a_step_is_what_all_readings_lie_on(step, zero, seed):
    counts = np.random.default_rng(seed).integers(-200, 200, 2000)
    assert step_of(zero + step * counts) == pytest.approx(step, rel=1e-3)
    assert (
        step_of(zero + step * (counts + 0.3 * np.random.default_rng(seed).standard_normal(2000)))
        == 0.0
    )


def test_a_staircase_is_no_motion():
    """A coarse encoder that is read slowly shows no noise from row to row; its steps are reading
    all the same.
    """
    t = np.arange(0.0, 16.0, PERIOD_S)
    truth, step = 0.02 * np.sin(2.0 * np.pi * 0.2 * t), 1e-4
    read = np.round(truth / step) * step
    assert np.std((without_noise(read, step) - truth)[1000:-1000]) < 0.6 * np.std(
        (read - truth)[1000:-1000]
    )


@pytest.fixture
def twin(tmp_path):
    """The subject, a recording of a shaft with 0.04 mrad of noise, and its twin in which the plant
    file's numbers hold.
    """
    subject, log = opened(tmp_path, RIG, HANGS), swing(1, noise_rad=4e-5)
    return subject, log, subject.read_again(log, {}, 3)


def test_the_twin_moves_as_the_recording_and_is_as_noisy(twin):
    _, log, again = twin
    assert np.std(again.columns["arm_rad"] - log.columns["arm_rad"]) < 2.0 * 5e-5
    for name in log.columns:
        assert noise_of(again.columns[name]) == pytest.approx(
            noise_of(log.columns[name]), rel=0.15
        ), name


def test_its_output_is_what_its_numbers_ask_of_that_motion(twin):
    """The log is of another inertia than the plant file's, the twin is not: it leaves what
    readings' noise makes alone.
    """
    subject, log, again = twin
    left, left_again = (
        np.nanstd(subject.residual(subject.prepare(one), {}, "torque")) for one in (log, again)
    )
    noise_alone = np.nanstd(
        subject.residual(
            subject.prepare(again),
            {"shaft.inertia_kg_m2": 0.052, "friction.viscous_nm_s_rad": 0.19},
            "torque",
        )
    )
    assert left_again < 0.8 * noise_alone and left_again < 0.8 * left


def test_another_seed_is_another_noise_and_the_same_one_the_same(twin):
    subject, log, again = twin
    assert np.array_equal(
        subject.read_again(log, {}, 3).columns["arm_rad"], again.columns["arm_rad"]
    )
    assert not np.array_equal(
        subject.read_again(log, {}, 4).columns["arm_rad"], again.columns["arm_rad"]
    )


def test_two_logs_are_read_with_two_noises(tmp_path):
    subject, logs = opened(tmp_path, RIG, HANGS), [swing(seed, noise_rad=4e-5) for seed in (1, 2)]
    off = [
        subject.read_again(log, {}, 3).columns["arm_rad"] - without_noise(log.columns["arm_rad"])
        for log in logs
    ]
    assert abs(np.corrcoef(*off)[0, 1]) < 0.1


def test_lost_rows_stay_lost(tmp_path):
    subject, log = opened(tmp_path, RIG, HANGS), swing(1, noise_rad=4e-5)
    kept = np.flatnonzero(np.arange(log.samples) % 100 != 7)
    columns = {name: x[kept].copy() for name, x in log.columns.items()}
    columns["arm_rad"][50] = np.nan
    again = subject.read_again(
        replace(log, cycle=log.cycle[kept], columns=columns, spans=()), {}, 3
    )
    assert (
        np.isnan(again.columns["arm_rad"][50])
        and np.isfinite(np.delete(again.columns["arm_rad"], 50)).all()
    )
    assert np.nanstd(again.columns["arm_rad"] - columns["arm_rad"]) < 2.0 * 5e-5


def test_what_is_held_against_a_repeat_has_no_such_twin(tmp_path):
    log = swing(1)
    assert opened(tmp_path, RIG, HANGS).against(log).read_again(log, {}, 3) is None
