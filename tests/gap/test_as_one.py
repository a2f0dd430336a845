"""The rig as one block: what it is held against, and what free run tells that blocks do not."""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.likelihood.as_one import (
    ABSURD,
    LINK,
    NOISY,
    AsOne,
    Meter,
    _judged_to,
    apart,
    fitted,
    floor,
    held,
    meters_of,
    quiet,
    twins_of,
)
from epa_rt.gap.likelihood.ground import judged
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import moved, settled
from epa_rt.gap.recording import Span
from epa_rt.gap.subject import Plain
from tests.gap import toy

CHANNEL = {"drive": "current_a", "gas": "pressure_pa", "spring": "force_n"}

OFF = {"spring.stiffness_n_m": 915.0, "gas.flow_pa_s": 4.1e5}


class Chained(toy.Toy):
    """The toy from its commands alone: its spring is fed with the pressure that its gas makes."""

    def free_run(self, recording, values, seed):
        columns = dict(recording.columns)
        for link in ("gas", "drive", "spring"):
            columns[CHANNEL[link]] = toy.predicted(columns, values, link)
        rng = np.random.default_rng(seed)
        noisy = {
            CHANNEL[link]: columns[CHANNEL[link]] + size * rng.standard_normal(recording.samples)
            for link, size in toy.NOISE.items()
        }
        return replace(recording, columns=columns | (noisy if seed is not None else {}))


def without_gas(*arguments, **more):
    """Floors that leave the gas' link unjudged, so that only free run sees its reading."""
    found = toy.floors(*arguments, **more)
    return {name: one for name, one in found.items() if name != "gas"}


def logs(values):
    return [toy.recording(f"log{i}", 10 + i, OFF | values) for i in range(2)]


def told(values, without=()):
    return diagnose(Chained(), logs(values), without=without, floors=without_gas, how_far=False)


def test_what_one_block_cannot_tell_apart_free_run_does():
    answer = told({"sensors.pressure_offset_pa": -1000.0})
    assert [one.name for one in answer.effects] == ["pressure_offset"]
    assert not answer.effects[0].not_separable_from
    assert answer.free_run.explained_share > 0.95


def test_a_name_that_does_not_carry_the_whole_comes_nearest_and_is_not_named():
    answer = told({"sensors.pressure_offset_pa": -1000.0}, without=("pressure_offset",))
    assert answer.verdict == "not_in_catalogue" and "it is force offset" in answer.says
    assert answer.free_run.explained_share < 0.1


def test_an_effect_that_no_judged_link_shows_is_found_in_free_run():
    answer = told({"gas.delay_s": 0.02})
    assert [one.name for one in answer.effects] == ["valve_delay"]
    assert answer.effects[0].parameters[0].low < 0.02 < answer.effects[0].parameters[0].high
    assert "free run" in answer.says


def test_nothing_hidden_shows_no_gap_in_free_run():
    answer = told({})
    assert answer.verdict == "no_gap"
    assert answer.free_run.explained_share is None
    assert answer.free_run.gap < 50.0


def test_a_rig_without_a_model_of_the_whole_is_not_heard():
    assert diagnose(toy.Toy(), logs({}), floors=toy.floors, how_far=False).free_run is None


def test_lost_readings_say_nothing_and_a_run_that_is_no_number_says_much():
    real = toy.recording("log", 1)
    other = Chained().free_run(real, {}, None)
    meters = {"force_n": Meter(0.1, 0.0)}
    clean = apart(held(other, meters), other, meters)
    assert np.nansum(np.abs(clean)) == 0.0
    lost = dict(
        other.columns,
        force_n=np.where(np.arange(real.samples) == 500, np.nan, other.columns["force_n"]),
    )
    assert (
        np.nansum(np.abs(apart(held(replace(other, columns=lost), meters), other, meters))) == 0.0
    )
    broken = dict(other.columns, force_n=np.full(real.samples, np.nan))
    assert np.nanmin(apart(held(other, meters), replace(other, columns=broken), meters)) == ABSURD


def test_a_reading_that_stands_still_says_only_that_the_value_lies_within_its_step():
    real = toy.recording("log", 1)
    still = replace(
        real, columns=dict(real.columns, force_n=np.repeat([20.0, 20.5], real.samples // 2))
    )
    meters = {"force_n": Meter(0.1, 0.5)}
    for off, told in ((0.2, False), (-0.25, False), (0.4, True)):
        run = replace(still, columns=dict(still.columns, force_n=still.columns["force_n"] + off))
        assert bool(np.nansum(np.abs(apart(held(still, meters), run, meters))) > 0.0) is told
    moving = replace(
        real, columns=dict(real.columns, force_n=20.0 + 0.5 * (np.arange(real.samples) % 2))
    )
    run = replace(moving, columns=dict(moving.columns, force_n=moving.columns["force_n"] + 0.2))
    assert np.nansum(np.abs(apart(held(moving, meters), run, meters))) > 0.0


def test_steps_that_stand_still_make_a_channel_count_for_less():
    real = toy.recording("log", 1)
    clean = Chained().free_run(real, {}, None)
    swift = 0.1 * (-1.0) ** np.arange(
        real.samples
    )  # averages out in every sample that is compared, but for one of five
    white = [
        replace(clean, columns=dict(clean.columns, force_n=clean.columns["force_n"] + sign * swift))
        for sign in (1.0, -1.0)
    ]
    standing = [
        replace(clean, columns=dict(clean.columns, force_n=clean.columns["force_n"] + shift))
        for shift in (0.1, -0.1)
    ]
    assert meters_of([real], [(clean, white)])["force_n"].deviation == pytest.approx(0.1, rel=1e-6)
    inflated = {"force_n": meters_of([real], [(clean, standing)])["force_n"]}
    assert np.nansum(apart(held(standing[0], inflated), clean, inflated) ** 2) == pytest.approx(
        NOISY, rel=1e-6
    )


def test_quiet_is_what_noise_alone_leaves():
    subject, recordings = Chained(), logs({})
    twins = twins_of(subject, recordings, {})
    meters = meters_of(recordings, twins)
    whole = Problem(AsOne(subject, meters), recordings, floor())
    point = settled(whole, rounds=4)
    assert whole.links == (LINK,)
    assert point.normal.chi < 4.0 * quiet(point, meters, twins)


class Parted(Plain):
    """A subject that has set the second trial aside."""

    def __init__(self, without_stop: bool) -> None:
        self.without_stop = without_stop

    def only(self, recordings):
        return tuple(
            replace(one, spans=(one.spans[0], replace(one.spans[1], trial=False)))
            for one in recordings
        )


@pytest.mark.parametrize(
    ("without_stop", "spans"), [(False, [(100, 400)]), (True, [(0, 500), (700, 1000)])]
)
def test_valves_act_before_a_trial_so_all_counts_that_no_stop_spoils_and_nobody_set_aside(
    without_stop, spans
):
    real = replace(
        toy.recording("log", 1),
        spans=(Span("first", 100, 400, True), Span("second", 500, 700, True)),
    )
    real = replace(
        real,
        columns={name: values[:1000] for name, values in real.columns.items()},
        cycle=real.cycle[:1000],
    )
    (found,) = judged(Parted(without_stop), [real])
    assert [(span.start, span.stop) for span in found.spans if span.trial] == spans


class Curved(Chained):
    """Its force grows with the square of an offset as well: from afar a step falls as promised, and
    is far from there.
    """

    def free_run(self, recording, values, seed):
        off = values.get("sensors.force_offset_n", 0.0)
        return super().free_run(
            recording, {**values, "sensors.force_offset_n": off + 0.02 * off**2}, seed
        )


def test_a_fit_has_arrived_only_where_what_is_left_agrees_with_its_derivatives():
    subject, recordings = Curved(), logs({})
    whole = Problem(
        AsOne(subject, meters_of(recordings, twins_of(subject, recordings, {}))),
        recordings,
        floor(),
    )
    near, far = (
        fitted(whole, ("force_offset",), {"sensors.force_offset_n": at}) for at in (0.1, 10.0)
    )
    assert far.normal.chi == pytest.approx(near.normal.chi, abs=3.0)


def test_a_fit_that_is_of_no_use_ends_where_its_derivatives_say_so_and_any_other_goes_on(
    monkeypatch,
):
    subject, recordings = Chained(), logs({"sensors.pressure_offset_pa": -1000.0})
    whole = Problem(
        AsOne(subject, meters_of(recordings, twins_of(subject, recordings, {}))),
        recordings,
        floor(),
    )

    def shortened(problem, point, light):
        return moved(
            problem,
            point.normal.keys,
            point.values,
            0.4 * point.normal.solved(np.ones(problem.blocks)),
        )

    monkeypatch.setattr(
        "epa_rt.gap.likelihood.as_one.searched", shortened
    )  # as on a way that bends

    def evaluations(name, start, **more):
        before = whole.evaluations
        return fitted(whole, (name,), start, **more), whole.evaluations - before

    wrong, right = (
        ("force_offset", {"sensors.force_offset_n": 2.0}),
        ("pressure_offset", {"sensors.pressure_offset_pa": -100.0}),
    )
    (through, all_of_it), (ended, few) = evaluations(*wrong), evaluations(*wrong, worth=100.0)
    assert (
        100.0 < through.normal.chi < ended.normal.chi < 1.6 * through.normal.chi and few < all_of_it
    )
    assert evaluations(*wrong, worth=1.01 * through.normal.chi)[0].values == through.values
    assert evaluations(*right, worth=100.0)[0].values == evaluations(*right)[0].values


def test_a_fit_goes_on_from_one_with_fewer_effects_at_less_cost_and_ends_at_the_same():
    subject = Chained()
    recordings = logs({"sensors.pressure_offset_pa": -1000.0})
    meters = meters_of(recordings, twins_of(subject, recordings, {}))
    whole = Problem(AsOne(subject, meters), recordings, floor())
    blocks = {"sensors.pressure_offset_pa": -800.0}
    one = fitted(whole, ("pressure_offset",), blocks)
    both, start = ("pressure_offset", "force_offset"), {**blocks, "sensors.force_offset_n": 0.01}

    def evaluations(**more):
        before = whole.evaluations
        return fitted(whole, both, start, **more), whole.evaluations - before

    (alone, all_of_it), (near, few) = evaluations(), evaluations(near=one)
    assert near.normal.chi == pytest.approx(alone.normal.chi, abs=3.0)
    assert few < all_of_it and near.normal.keys == alone.normal.keys
    for key, value in alone.values.items():
        assert near.values[key] == pytest.approx(value, abs=0.02 * whole.spread(key))


@pytest.mark.parametrize("period_s", [0.7e-3, 1e-3, 1.5e-3, 4e-3, 8e-3, 10e-3])
def test_a_recording_that_is_cut_behind_its_last_trial_keeps_all_that_is_judged(period_s):
    whole = replace(toy.recording("log", 1, {}), period_s=period_s)
    last = Span("trial", 137, whole.samples - 700, True)
    whole = replace(whole, spans=(last,))
    end = _judged_to(whole)
    cut = replace(
        whole,
        cycle=whole.cycle[:end],
        columns={name: values[:end] for name, values in whole.columns.items()},
    )
    meters = {"force_n": Meter(1.0, 0.0)}
    run = replace(whole, columns=whole.columns | {"force_n": whole.columns["force_n"] + 1.0})
    entire, part = (apart(held(one, meters), run, meters) for one in (whole, cut))
    assert end < whole.samples and np.array_equal(
        entire[np.isfinite(entire)], part[np.isfinite(part)]
    )


def test_two_effects_that_no_block_shows_are_found_though_the_first_leaves_much():
    def without_spring(*arguments, **more):
        return {
            name: one for name, one in toy.floors(*arguments, **more).items() if name != "spring"
        }

    answer = diagnose(
        Chained(),
        logs({"spring.coulomb_n": 0.5, "sensors.force_offset_n": 0.4}),
        floors=without_spring,
        how_far=False,
    )
    assert sorted(one.name for one in answer.effects) == ["coulomb", "force_offset"]
