"""Free run as a second witness: a law that explains one block and not the whole plant is not the
rig's.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from epa_rt.gap.as_one import (
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
from epa_rt.gap.attribution import _found_there, attributed
from epa_rt.gap.coverage import Coverage
from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.forms import all_read_or_command, exact, of_one_form
from epa_rt.gap.further import most_of_one
from epa_rt.gap.ground import Ground, ground_of, judged
from epa_rt.gap.heard import Beside, Heard
from epa_rt.gap.in_free_run import _of_named, heard
from epa_rt.gap.one_alone import one_alone
from epa_rt.gap.problem import Problem
from epa_rt.gap.recording import Span
from epa_rt.gap.refit import moved, settled
from epa_rt.gap.rules import Rules
from epa_rt.gap.verdict import Evidence, decided
from epa_rt.gap.wording import Wording
from epa_rt.models.catalogue import CATALOGUE
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
    assert answer.effects[0].came_near[0].behind_in_free_run > 25.0
    assert "force_offset" in answer.free_run.told_apart
    assert answer.free_run.explained_share > 0.95


def test_a_name_that_does_not_carry_the_whole_is_not_given():
    answer = told({"sensors.pressure_offset_pa": -1000.0}, without=("pressure_offset",))
    assert answer.verdict == "not_in_catalogue"
    assert not answer.effects
    assert answer.free_run.explained_share < 0.7


def test_a_name_that_another_one_found_in_free_run_makes_needless_is_dropped():
    recordings = logs({"sensors.pressure_offset_pa": -1000.0})
    blind = attributed(Chained(), recordings, without=("pressure_offset",), floors=without_gas)
    assert blind.selection.roles and not blind.heard.carried
    problem = Problem(
        Chained(),
        recordings,
        blind.problem.floors,
        {link: scale**2 for link, scale in blind.problem.scale.items()},
    )
    found, said = heard(
        problem,
        replace(blind.selection, problem=problem),
        ground_of(problem, blind.selection.base.values),
    )
    assert (
        [role.best.effect for role in found.roles]
        == list(found.final.effects)
        == ["pressure_offset"]
    )
    assert said.to_noise and said.carried
    assert said.refitted is not None
    assert "pressure_offset" not in said.told_apart
    judged_alone(found)


def judged_alone(found):
    """The one role of a selection was played at the base, and gains there what the plant's fit
    says.
    """
    (role,) = found.roles
    assert role.point.effects == ()
    assert role.gains[0].sum() == pytest.approx(
        found.base.normal.chi - found.final.normal.chi, rel=0.2
    )  # on trials left out


def test_names_that_do_not_carry_the_plant_give_way_to_one_law_alone(monkeypatch):
    monkeypatch.setattr("epa_rt.gap.completed.further", lambda *arguments: None)
    recordings = logs({"sensors.pressure_offset_pa": -1000.0})
    blind = attributed(Chained(), recordings, without=("pressure_offset",), floors=without_gas)
    problem = Problem(
        Chained(),
        recordings,
        blind.problem.floors,
        {link: scale**2 for link, scale in blind.problem.scale.items()},
    )
    found, said = heard(
        problem,
        replace(blind.selection, problem=problem),
        ground_of(problem, blind.selection.base.values),
    )
    assert list(found.final.effects) == ["pressure_offset"] and found.refused is None
    assert said.to_noise and said.refitted is not None
    judged_alone(found)


def test_one_law_that_takes_the_plant_to_the_noise_stands_instead_of_two_that_do_not():
    recordings = logs({"sensors.pressure_offset_pa": -1000.0})
    found = attributed(Chained(), recordings, floors=without_gas)
    problem, base = found.problem, found.selection.base
    twins = twins_of(problem.subject, recordings, base.values)
    meters = meters_of(recordings, twins)
    whole = problem.on(recordings, AsOne(problem.subject, meters), floor())
    none = fitted(whole, (), base.values)
    noise = quiet(none, meters, twins)
    two = replace(found.selection, roles=2 * found.selection.roles)
    assert {"pressure_offset", "force_offset"} <= {fit.effect for fit in two.roles[0].fits}
    selection, best, _ = one_alone(problem, Ground(whole, none, noise), two, Rules())
    assert (
        [role.best.effect for role in selection.roles] == list(best.effects) == ["pressure_offset"]
    )
    half = logs(
        {"sensors.pressure_offset_pa": -1000.0, "gas.delay_s": 0.02}
    )  # two effects: none of them does alone
    whole = problem.on(half, AsOne(problem.subject, meters), floor())
    assert (
        one_alone(problem, Ground(whole, fitted(whole, (), base.values), noise), two, Rules())
        is None
    )


def test_where_nothing_is_named_one_law_alone_is_looked_for_from_the_plant_file_on(monkeypatch):
    """A gap that shows whatever the blocks say, and less than what is large."""
    monkeypatch.setattr("epa_rt.gap.completed.further", lambda *arguments: None)
    answer = told({"gas.delay_s": 0.003})
    assert 100.0 < answer.free_run.gap < 250.0
    assert [one.name for one in answer.effects] == ["valve_delay"] and answer.verdict == "explained"
    assert (
        told({"gas.delay_s": 0.0015}).verdict != "explained"
    )  # of forty nothing but a fit beside what is named is asked


def test_an_effect_that_no_judged_link_shows_is_found_in_free_run():
    answer = told({"gas.delay_s": 0.02})
    assert [one.name for one in answer.effects] == ["valve_delay"]
    assert answer.effects[0].parameters[0].low < 0.02 < answer.effects[0].parameters[0].high
    assert "free run" in answer.says


@pytest.mark.parametrize(("delay_s", "verdict"), [(0.0008, "no_gap"), (0.0015, "explained")])
def test_a_gap_of_forty_is_looked_into_and_one_of_a_rig_without_any_is_not(delay_s, verdict):
    answer = told({"gas.delay_s": delay_s})
    assert answer.verdict == verdict
    assert 10.0 < answer.free_run.gap < 60.0
    assert verdict == "no_gap" or (
        "gap in free run" in answer.says and answer.free_run.explained_share > 0.9
    )


def test_free_run_vouches_for_what_it_found_and_for_one_that_explains_a_large_gap_by_itself():
    chosen = SimpleNamespace(final=SimpleNamespace(effects=("a", "b")))
    alone = SimpleNamespace(final=SimpleNamespace(effects=("a",)))
    large = Heard(2725.0, 28.0, 5.0, {}, {}, alone=True)
    assert _found_there(alone, large) == {"a"}
    assert _found_there(chosen, large) == frozenset()
    for other in (
        replace(large, left=900.0),
        replace(large, left=56.0),
        replace(large, strain=400.0),
        replace(large, gap=200.0, left=5.0),
    ):
        assert _found_there(alone, other) == frozenset()
    assert _found_there(chosen, Heard(200.0, 5.0, 5.0, {}, {"b": ()})) == {"b"}
    assert _found_there(alone, None) == frozenset()


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


@pytest.mark.parametrize(
    ("gap", "left", "part"),
    [
        (39.0, 39.0, None),
        (1000.0, 125.0, 0.9),
        (200.0, 0.0, 1.0),
        (70.0, 24.0, 1.0),
        (40.0, 24.0, None),
        (60.0, 59.0, 1.0 - 34.0 / 60.0),
        (70.0, 26.0, 1.0 - 1.0 / 70.0),
        (84.0, 39.0, 1.0 - 14.0 / 84.0),
        (93.0, 52.0, 1.0 - 27.0 / 93.0),
        (300.0, 175.0, 0.5),
    ],
)
def test_part_is_none_where_free_run_shows_no_gap(gap, left, part):
    """39 left of 84 is no explanation, nor 52 of 93, however small the gap (a held-back flow named
    for a gauge's scale, twice).
    """
    assert Heard(gap, left, 5.0, {}, {}).part == part


@pytest.mark.parametrize(
    ("best", "other", "told"),
    [
        (14.0, 85.0, True),
        (14.0, 45.0, False),
        (60.0, 140.0, False),
        (60.0, 3000.0, True),
        (0.0, 51.0, True),
    ],
)
def test_a_law_that_reaches_the_noise_is_told_from_one_that_does_not_however_large_the_gap(
    best, other, told
):
    """A spring of the knee and a leaning frame over both ends of its range: 14 and 85 of 57 088
    above a noise of 300.
    """
    assert (
        Rules().told(leaving(57_388.0), leaving(300.0 + best), 300.0 + other, 300.0, plain=True)
        is told
    )
    assert Rules().told(
        leaving(57_388.0), leaving(300.0 + best), 300.0 + other, 300.0, plain=False
    ) is (other > 2000.0)


def test_what_was_tried_in_one_named_ones_place_says_nothing_of_another():
    """One that is named itself by now is told from nothing, and what was tried in the place of one
    that is gone is forgotten.
    """
    tried = {
        "a": {"x": Beside(3000.0, True), "y": Beside(2.0, False), "z": Beside(90.0, True)},
        "b": {"y": Beside(400.0, True)},
        "gone": {"w": Beside(500.0, True)},
    }
    said = Heard(9000.0, 10.0, 5.0, _of_named(tried, ("a", "b", "x")), {})
    assert said.apart_from("a") == {"z"}
    assert said.apart_from("b") == {"y"}
    assert said.apart_from("x") == frozenset()
    assert said.told_apart == ("z",)


def leaving(chi: float):
    return SimpleNamespace(normal=SimpleNamespace(chi=chi))


def test_what_is_too_little_to_be_missing_counts_as_explained():
    assert Heard(180.0, 28.0, 5.0, {}, {}).counted == 1.0
    assert Heard(300.0, 175.0, 5.0, {}, {}).counted == 0.5
    assert Heard(40.0, 24.0, 5.0, {}, {}).counted is None
    assert Heard(84.0, 39.0, 5.0, {}, {}).counted == pytest.approx(1.0 - 14.0 / 84.0)


@pytest.mark.parametrize(("gap", "left"), [(84.0, 31.0), (592.0, 41.0), (999.0, 31.0)])
def test_a_small_gap_of_which_more_than_noise_stays_is_another_laws(gap, left):
    said = Heard(gap, left, 5.0, {}, {})
    assert said.too_much_left and not said.carried and not said.proves


@pytest.mark.parametrize(
    ("gap", "left"), [(84.0, 28.0), (999.0, 30.0), (1001.0, 31.0), (4654.0, 57.0)]
)
def test_of_a_large_gap_a_formulas_shape_may_stay(gap, left):
    said = Heard(gap, left, 5.0, {}, {})
    assert not said.too_much_left and said.carried


@pytest.mark.parametrize(
    ("gap", "left", "over"),
    [
        (6205.0, 62.0, True),
        (3894.0, 41.0, True),
        (14_908.0, 552.0, True),
        (1180.0, 29.0, False),
        (12_768.0, 60.0, False),
        (15_001.0, 900.0, False),
        (6461.0, 40.6, False),
        (3824.0, 39.9, True),
        (6213.0, 59.9, True),
    ],
)
def test_one_law_by_itself_leaves_little_of_a_gap_that_is_not_many_times_its_limit(gap, left, over):
    """A bladder's spring for a soft braid, a leaning frame for a knee's spring, heat of filling for
    a leak; creep in other words is not refused.
    """
    said = Heard(gap, left, 5.0, {}, {}, alone=True)
    assert said.too_much_left is over and not replace(said, alone=False).too_much_left


@pytest.mark.parametrize(
    ("gap", "left", "over"),
    [
        (13_644_571.0, 24.0, False),
        (858_677.0, 49.0, False),
        (136_717.0, 549.0, True),
        (15_001.0, 51.0, True),
    ],
)
def test_a_single_number_of_a_reading_or_a_command_leaves_nothing_of_any_gap(gap, left, over):
    """An encoder's age named for a command's."""
    said = Heard(gap, left, 5.0, {}, {}, one_form=True)
    assert (
        said.too_much_left is over
        and said.carried is not over
        and not replace(said, one_form=False).too_much_left
    )


def test_only_single_numbers_of_readings_and_commands_have_one_form():
    effects = {e.name: e for e in CATALOGUE}

    def asked(question, names):
        return question(
            SimpleNamespace(effects=effects),
            SimpleNamespace(
                roles=[SimpleNamespace(best=SimpleNamespace(effect=name)) for name in names]
            ),
        )

    def named(*names):
        return asked(of_one_form, names)

    assert (
        asked(all_read_or_command, ["encoder_eccentricity", "force_drift"])
        and not asked(all_read_or_command, ["force_drift", "gas_energy"])
        and not asked(all_read_or_command, [])
    )
    assert named("encoder_skew") and named("transport_delay", "force_offset")
    assert asked(exact, ["encoder_skew", "force_offset", "transport_delay", "joint_angle_gain"])
    assert not any(
        asked(exact, [name])
        for name in ("force_bow", "gauge_lag", "gauge_crosstalk", "force_drift", "braid_coulomb")
    )
    assert (
        not named()
        and not named("transport_delay", "braid_coulomb")
        and not named("force_drift")
        and not named("threshold_pressure")
    )


def test_a_small_gap_of_which_too_much_stays_is_said_to_be_no_law_of_the_catalogue():
    found = Coverage(0.9, 0.9, 0.1)
    assert decided(Evidence(True, ("a",), found, whole=0.97)) != "not_in_catalogue"
    assert (
        decided(Evidence(True, ("a",), found, whole=0.97, too_much_left=True)) == "not_in_catalogue"
    )
    text = Wording(
        "not_in_catalogue", ("a",), ((),), ("spring",), 0.9, 0, 5, whole=0.97, over=(592.0, 41.0)
    ).said()
    assert "chi-square of 41 of 592" in text


def test_what_explains_the_whole_as_well_stands_beside_it():
    """Two families of one law: free run cannot choose, and says so."""
    twin = next(effect for effect in toy.CATALOGUE if effect.name == "valve_delay")
    subject = Chained()
    subject.catalogue = (*subject.catalogue, twin._replace(name="slow_valve", family="slow valve"))
    answer = diagnose(subject, logs({"gas.delay_s": 0.02}), floors=without_gas, how_far=False)
    assert answer.verdict == "not_separable"
    assert {answer.effects[0].name, *answer.effects[0].not_separable_from} == {
        "valve_delay",
        "slow_valve",
    }


class Parted:
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


@pytest.mark.parametrize(
    ("gap", "left", "alone", "asks"),
    [
        (5508.0, 449.0, False, True),
        (5508.0, 8.0, False, False),
        (5508.0, 2000.0, False, True),
        (5508.0, 5508.0, False, True),
        (90.0, 90.0, False, False),
        (11000.0, 60.0, True, False),
        (11000.0, 900.0, True, True),
    ],
)
def test_one_law_by_itself_is_looked_for_where_nothing_carries_the_plant_or_two_leave_much(
    gap, left, alone, asks
):
    assert Heard(gap, left, 0.0, {}, {}, alone=alone).asks_for_one == asks


@pytest.mark.parametrize(
    ("gap", "left", "supports"), [(10.0, 9.0, False), (13.0, 14.0, False), (9.0, 0.0, True)]
)
def test_a_name_that_gains_nothing_in_free_run_has_no_support_there(gap, left, supports):
    assert Heard(gap, left, 5.0, {}, {}).supports is supports


@pytest.mark.parametrize(
    ("gap", "left", "helps"),
    [
        (28.0, 9.0, True),
        (40.0, 9.0, True),
        (84.0, 19.0, True),
        (16.0, 2.0, False),
        (40.0, 26.0, False),
        (300.0, 200.0, False),
    ],
)
def test_a_faint_effect_helps_where_it_takes_more_than_chance_off_and_most_of_the_gap(
    gap, left, helps
):
    assert Heard(gap, left, 5.0, {}, {}).helps is helps


@pytest.mark.parametrize(
    ("left", "strain", "borne"), [(31.0, 19.0, True), (31.0, 95.0, False), (90.0, 19.0, False)]
)
def test_effects_carry_the_plant_only_with_parameters_that_a_plant_file_may_have(
    left, strain, borne
):
    assert Heard(5423.0, left, strain, {}, {}).borne is borne


@pytest.mark.parametrize(
    ("gap", "left", "borne"),
    [(84_053.0, 367.0, True), (30_927.0, 522.0, False), (62_199.0, 1432.0, False)],
)
def test_of_a_large_gap_a_right_law_in_other_words_leaves_something(gap, left, borne):
    """A knee's friction; a leaking exhaust that passes for heat of filling; a lossy gear with a
    force cell's scale beside it.
    """
    assert Heard(gap, left, 8.0, {}, {}).borne is borne


@pytest.mark.parametrize(("left", "more"), [(21.0, False), (31.0, True)])
def test_what_rigs_without_a_gap_leave_is_nothing_to_doubt_a_name_for(left, more):
    assert Heard(1800.0, left, 5.0, {}, {}).leaves_more is more


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

    monkeypatch.setattr("epa_rt.gap.as_one.searched", shortened)  # as on a way that bends

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


def test_two_effects_that_no_block_shows_are_found_one_after_the_other_though_the_first_leaves_much():  # noqa: E501
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


@pytest.mark.parametrize(
    ("gap", "most"), [(500.0, 30.0), (6000.0, 30.0), (7217.0, 36.085), (14_000.0, 70.0)]
)
def test_what_one_law_may_leave_is_what_a_second_one_is_looked_for_from(gap, most):
    assert most_of_one(gap) == pytest.approx(most)
    assert not Heard(gap, most - 1.0, 0.0, {}, {}, alone=True).too_much_left
    assert Heard(gap, 1.5 * most + 1.0, 0.0, {}, {}, alone=True).too_much_left


def test_of_a_large_gap_one_law_may_leave_what_the_other_bars_let_it():
    assert (
        most_of_one(16_000.0) == np.inf
        and not Heard(16_000.0, 400.0, 0.0, {}, {}, alone=True).too_much_left
    )
