"""Cycles that a log lacks: what is made up for them is not judged, and shows in nothing that is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.gap.held_out.aside import Part
from epa_rt.gap.hygiene.check import check, clean
from epa_rt.gap.likelihood.floor import floors
from epa_rt.gap.likelihood.ground import ground_of, judged
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.posterior.views import HeldOut
from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.commands import commands_of, lost_rows
from epa_rt.gap.rig.house.prepared import unsteady
from tests.gap.house.runs import recorded, rms, subject
from tests.gap.recorded import rows_left

FLAGS = st.lists(st.booleans(), min_size=1, max_size=60).map(np.array)


def some_lost(log):
    return np.random.default_rng(1).random(log.samples) >= 0.01


def bursts(log):
    kept = np.ones(log.samples, bool)
    for first in range(4000, log.samples - 2000, 5000):
        kept[first : first + 50] = False
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
        jitter = (
            rig == "bench" and link.name == "drive" and lose is some_lost
        )  # its targets leap with the loop's noise: what a lost one was nobody knows
        assert both.sum() > (0.01 if jitter else 0.5) * np.isfinite(was).sum(), link.name


@pytest.mark.parametrize(
    "port",
    ["motor_angle_rad", "motor_speed_rad_s", "motor_current_a", "muscle0_gauge_pa", "force_n"],
)
@pytest.mark.parametrize("cycles", [1, 5, 100])
def test_a_channel_s_silence_shows_in_no_link(cycles, port):
    house, log = subject("bench"), recorded("bench", 1)
    name = house.channels[port].column
    values = log.columns[name].copy()
    for first in range(4000, log.samples - 2000, 3000):
        values[first : first + cycles] = np.nan
    whole, holed = (
        house.prepare(log),
        house.prepare(replace(log, columns={**log.columns, name: values})),
    )
    for link in house.links:
        was, found = house.residual(whole, {}, link.name), house.residual(holed, {}, link.name)
        both = np.isfinite(was) & np.isfinite(found)
        both[np.flatnonzero(both)[-2:]] = False  # power goes there, and no hole is near
        assert rms((found - was)[both]) < 0.3 * rms(was[both]), link.name


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_the_floors_of_a_log_with_gaps_know_them_too(rig):
    house, log = subject(rig), recorded(rig, 1)
    gappy = rows_left(log, bursts(log))
    cleaned = clean([gappy], check([gappy], house.rig))[0]
    level, prepared = floors(house, [cleaned], {})["drive"], house.prepare(cleaned)
    bias = level.bias.get(cleaned.name, np.zeros(1))  # none where the twins agree on nothing
    assert rms(bias) < 0.5 * level.rms
    white = level.whiten(house.residual(prepared, {}, "drive") - bias)
    assert rms(white) < 1.2


def test_what_was_sent_in_a_cycle_without_process_data_is_taken_at_its_word():
    house, log = subject("knee"), recorded("knee", 1)
    names, silent = {row.name for row in house.rig.inputs}, slice(9000, 9003)
    columns = {name: values.astype(float) for name, values in log.columns.items()}
    for name in names & columns.keys():
        columns[name][silent] = np.nan
    assert lost_rows(house.rig, columns)[silent].all() and lost_rows(house.rig, columns).sum() == 3
    sent = commands_of(house.rig, columns)["target_angle_rad"]
    assert np.array_equal(
        sent[9002:9005], commands_of(house.rig, log.columns)["target_angle_rad"][9002:9005]
    )
    columns["cmd_motor_travel_m"][silent] = columns["cmd_motor_travel_m"][
        8999
    ]  # as a lost row is filled in
    line = commands_of(house.rig, columns)["target_angle_rad"][9001:9006]
    assert np.abs(np.diff(line, 2)).max() < 2.1 * np.min(
        np.abs(np.diff(sent))[np.abs(np.diff(sent)) > 0.0]
    )


def test_free_run_follows_no_log_of_which_nobody_knows_what_the_rig_was_told():
    for rig, told in (("bench", False), ("knee", True)):
        house, log = subject(rig), recorded(rig, 1)
        gappy = rows_left(log, some_lost(log))
        cleaned = clean([gappy], check([gappy], house.rig))[0]
        assert house.told(log) and house.told(gappy) == house.told(cleaned) == told
        part = Part(house, {cleaned.name: [(0, cleaned.samples)]})
        assert len(judged(house, [log, cleaned])) == len(judged(part, [cleaned])) + 1 == 1 + told
        problem = Problem(house, [log], floors(house, [log], {}))
        held_out = HeldOut(problem, ground_of(problem, {}), [cleaned], {})
        assert (held_out.free_run({}) is not None) == told


def test_one_step_of_a_target_is_no_leaping():
    commands = subject("knee").prepare(recorded("knee", 1)).commands.copy()
    commands["target_angle_rad"][len(commands) // 2 :] += 1.0
    assert not unsteady(commands)


def test_the_motor_s_silence_leaves_a_muscle_alone_that_does_not_hang_on_it():
    house, log = subject("knee"), recorded("knee", 1)
    name = house.channels["motor_speed_rad_s"].column
    values = log.columns[name].copy()
    values[9000:10500] = np.nan
    silent = house.prepare(replace(log, columns={**log.columns, name: values}))
    assert (
        np.array_equal(silent.judged["gas1"], house.prepare(log).judged["gas1"])
        and not silent.judged["muscle0"][950:1000].any()
    )


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
    assert smooth.any_before(flags, cycles).tolist() == [
        bool(flags[max(k - cycles, 0) : k + 1].any()) for k in range(len(flags))
    ]


@given(
    st.lists(st.integers(-5, 5), min_size=1, max_size=20),
    st.integers(1, 4),
    st.integers(0, 3),
    st.data(),
)
def test_a_held_reading_s_gaps_are_filled_from_its_own_hold(fresh, hold, phase, data):
    phase %= hold
    values = np.repeat(np.array(fresh, float), hold)[hold - phase if phase else 0 :]
    gone = np.array(
        data.draw(st.lists(st.booleans(), min_size=len(values), max_size=len(values))), bool
    )
    found = smooth.filled_by_hold(np.where(gone, np.nan, values), hold, phase)
    known = np.isfinite(found)
    assert np.array_equal(found[known], values[known]) and (hold == 1 or known[~gone].all())
    groups = (np.arange(len(values)) - phase) // hold
    assert hold == 1 or all(
        known[groups == g].all() == (~gone[groups == g]).any() for g in np.unique(groups)
    )
