"""Cycles that a log lacks: what is made up for them is not judged, and shows in nothing that is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.gap.house import smooth
from epa_rt.gap.house.prepared import unsteady
from epa_rt.gap.hygiene import check, clean
from tests.gap.house.runs import recorded, rms, subject
from tests.gap.recorded import rows_left

FLAGS = st.lists(st.booleans(), min_size=1, max_size=60).map(np.array)


def some_lost(log):
    return np.random.default_rng(1).random(log.samples) >= 0.01


def bursts(log):
    kept = np.ones(log.samples, bool)
    for first in range(4000, log.samples - 2000, 5000):
        kept[first:first + 50] = False
    return kept


@pytest.mark.parametrize("lose", [some_lost, bursts])
@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_lost_cycles_leave_every_link_as_quiet_as_it_was_and_most_of_it_judged(rig, lose):
    house, log = subject(rig), recorded(rig, 1)
    gappy = rows_left(log, lose(log))
    cleaned = clean([gappy], check([gappy], house.rig))[0]
    whole, holed = house.prepare(log), house.prepare(cleaned)
    for link in house.links:
        was, found = house.residual(whole, {}, link.name), house.residual(holed, {}, link.name)
        both = np.isfinite(was) & np.isfinite(found)
        assert rms(found[both]) < 1.1 * rms(was[both]), link.name
        jitter = rig == "bench" and link.name == "drive" and lose is some_lost  # its targets leap with the loop's noise: what a lost one was nobody knows
        assert both.sum() > (0.01 if jitter else 0.5) * np.isfinite(was).sum(), link.name


@pytest.mark.parametrize("port", ["motor_angle_rad", "motor_speed_rad_s", "motor_current_a", "muscle0_gauge_pa", "force_n"])
@pytest.mark.parametrize("cycles", [1, 5, 100])
def test_a_channel_s_silence_shows_in_no_link(cycles, port):
    house, log = subject("bench"), recorded("bench", 1)
    name = house.channels[port].column
    values = log.columns[name].copy()
    for first in range(4000, log.samples - 2000, 3000):
        values[first:first + cycles] = np.nan
    whole, holed = house.prepare(log), house.prepare(replace(log, columns={**log.columns, name: values}))
    for link in house.links:
        was, found = house.residual(whole, {}, link.name), house.residual(holed, {}, link.name)
        both = np.isfinite(was) & np.isfinite(found)
        assert rms((found - was)[both]) < 0.3 * rms(was[both]), link.name


def test_a_bench_s_loop_speaks_in_leaps_and_a_chirp_does_not():
    assert unsteady(subject("bench").prepare(recorded("bench", 1)).commands)
    assert not unsteady(subject("knee").prepare(recorded("knee", 1)).commands)


@given(FLAGS, st.integers(0, 10))
def test_long_runs_are_the_runs_that_are_longer(flags, longest):
    found = smooth.long_runs(flags, longest)
    assert not (found & ~flags).any()
    runs = "".join("x" if flag else " " for flag in flags).split()
    assert found.sum() == sum(len(run) for run in runs if len(run) > longest)


@given(FLAGS, st.integers(0, 70))
def test_any_before_looks_back_and_here(flags, cycles):
    assert smooth.any_before(flags, cycles).tolist() == [bool(flags[max(k - cycles, 0):k + 1].any()) for k in range(len(flags))]


@given(st.lists(st.integers(-5, 5), min_size=1, max_size=20), st.integers(1, 4), st.integers(0, 3), st.data())
def test_a_held_reading_s_gaps_are_filled_from_its_own_hold(fresh, hold, phase, data):
    phase %= hold
    values = np.repeat(np.array(fresh, float), hold)[hold - phase if phase else 0:]
    gone = np.array(data.draw(st.lists(st.booleans(), min_size=len(values), max_size=len(values))), bool)
    found = smooth.filled_by_hold(np.where(gone, np.nan, values), hold, phase)
    known = np.isfinite(found)
    assert np.array_equal(found[known], values[known]) and (hold == 1 or known[~gone].all())
    groups = (np.arange(len(values)) - phase) // hold
    assert hold == 1 or all(known[groups == g].all() == (~gone[groups == g]).any() for g in np.unique(groups))
