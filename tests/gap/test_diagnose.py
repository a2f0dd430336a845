"""The attribution on a made-up rig, where the truth is known."""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.diagnose import _unnamed, _without_gap, diagnose
from epa_rt.gap.diagnosis import Could, Posterior
from epa_rt.gap.likelihood.problem import Stopped
from tests.gap import toy

OFF = {
    "drive.gain_a": 1.02,
    "spring.stiffness_n_m": 915.0,
    "gas.flow_pa_s": 4.1e5,
    "spring.area_m2": 5.03e-4,
}


NOTHING = "not_in_catalogue"
DELAY = {"drive_lag": "delay"}


def logs(values=None, extra=None, count=2, **more):
    return [
        toy.recording(f"log{i}", 10 + i, OFF | (values or {}), extra=extra, **more)
        for i in range(count)
    ]


def told(values=None, extra=None, without=(), floors=toy.floors, **more):
    return diagnose(
        toy.Toy(), logs(values, extra, **more), without=without, floors=floors, how_far=False
    )


def test_nothing_hidden_is_no_gap_although_nominal_parameters_are_off():
    answer = told()
    assert answer.verdict == "no_gap"
    assert not answer.effects and not answer.nominal_moved


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ({"drive.coulomb_a": 0.02}, "motor_friction"),
        ({"drive.cogging_a": 0.03, "drive.cogging_per_m": 150.0}, "cogging"),
        ({"sensors.pressure_offset_pa": -1000.0}, "pressure_offset"),
        ({"gas.delay_s": 0.005}, "valve_delay"),
        ({"spring.cubic_n_m3": -2e5}, "hardening"),
        ({"spring.dahl_n": 1.0, "spring.dahl_m": 3e-3}, "dahl"),
    ],
)
def test_single_effect_is_named_with_its_size(values, name):
    answer = told(values)
    assert answer.verdict == "explained"
    assert [one.name for one in answer.effects] == [name]
    assert answer.effects[0].confidence > 0.9
    for number in answer.effects[0].parameters:
        half = 0.5 * (number.high - number.low)
        assert abs(number.value - values[number.name]) < 2.0 * half < 0.1 * values[
            number.name
        ] or half < abs(0.1 * values[number.name])


def test_an_effect_of_the_plant_file_at_its_typical_strength_may_be_what_the_rig_lacks(monkeypatch):
    knob = toy.KNOBS["drive.coulomb_a"]
    (start,) = toy.Toy().catalogue[0].starts
    monkeypatch.setitem(toy.KNOBS, knob.key, knob._replace(value=start[0], absent=0.0))
    answer = told({knob.key: 0.0})
    assert [(one.name, one.who) for one in answer.effects] == [("motor_friction", "plant_file")]


def test_the_law_that_comes_nearest_is_told_with_its_own_family():
    sets = {("a",): 0.22, ("b", "c"): 0.14, ("b", "d"): 0.14}
    models = tuple(Could(effects, share, 0.1) for effects, share in sets.items())
    could = Posterior(models, {"of b": 0.28, "of a": 0.22}, 0.5, "blocks", NOTHING, {}, (), 1)
    _, nearest = _unnamed(could, {name: f"of {name}" for name in "abcd"})
    assert nearest.endswith("it is a (of a 0.22).")


def test_logs_are_in_the_order_of_the_numbers_in_their_names():
    made = [replace(one, found=("a note",)) for one in logs(count=2)]
    named = [replace(one, name=name) for one, name in zip(made, ("run_10", "run_2"), strict=True)]
    found = diagnose(toy.Toy(), named, floors=toy.floors, how_far=False)
    assert found.found_first == ("run_2: a note", "run_10: a note")


def test_intervals_hold_the_truth_about_as_often_as_they_say():
    held = []
    for seed in range(12):
        data = [toy.recording("log", 100 + seed, OFF | {"drive.coulomb_a": 0.02}, seconds=20.0)]
        number = (
            diagnose(toy.Toy(), data, floors=toy.floors, how_far=False).effects[0].parameters[0]
        )
        held.append(number.low <= 0.02 <= number.high)
    assert 9 <= sum(held) <= 12


def test_friction_by_another_formula_comes_nearest_by_its_family():
    """Its nearest law leaves 15 % of the gap: more than right laws do."""
    answer = told(extra=lambda c: {"spring": 1.0 * np.sign(c["speed_m_s"])})
    assert next(iter(answer.posterior.families)) == "friction"
    assert answer.posterior.families["friction"] > 0.4
    assert "oulomb" in answer.says and "something besides" in answer.says


def test_effect_taken_out_of_the_catalogue_is_said_to_be_in_none():
    answer = told({"spring.dahl_n": 1.0, "spring.dahl_m": 3e-3}, without=("dahl", "coulomb"))
    assert answer.verdict == "not_in_catalogue" and not answer.effects
    assert answer.remainder[0].link == "spring"


@pytest.mark.parametrize(
    ("unknown", "open_whether"), [(0.33, True), (0.6, False)], ids=["less than", "more than"]
)
def test_what_is_not_named_beside_a_law_that_is_more_probable_is_left_open(unknown, open_whether):
    models = (Could(("drive_lag",), 0.9 - unknown, 0.1), Could((), 0.1, 1.0))
    could = Posterior(models, {"delay": 0.9 - unknown}, unknown, "blocks", NOTHING, {}, (), 1)
    said, nearest = _unnamed(could, DELAY)
    assert ("leave open whether it is drive lag" in said) is open_whether
    assert bool(nearest) is not open_whether and f"({unknown:.2f})" in said


@pytest.mark.parametrize(
    ("none", "unknown", "gaps"),
    [
        (0.55, 0.1, None),
        (0.4, 0.1, "drive lag (delay 0.50)"),
        (0.4, 0.5, "one that no law of the catalogue describes (0.50)"),
        (0.45, 0.25, "drive lag (delay 0.30), one that no law of the catalogue describes (0.25)"),
    ],
)
def test_where_something_is_more_probably_missing_than_not_no_gap_is_left_open(none, unknown, gaps):
    law = 1.0 - none - unknown
    models = (Could((), none, 1.0), Could(("drive_lag",), law, 0.1))
    could = Posterior(models, {"delay": law}, unknown, "blocks", "no_gap", {}, (), 1)
    said, nearest = _without_gap(could, DELAY, " to 1.4 times their noise in free run")
    assert said.startswith(
        "The plant file, refitted, describes these logs to 1.4 times their noise"
    )
    assert f"({none:.2f})" in said
    assert ("leave open whether there is a gap" in said) is (gaps is not None)
    assert bool(nearest) is (gaps is None)
    if gaps:
        assert f"whether there is a gap: {gaps} or none ({none:.2f})" in said


def test_what_is_not_named_closes_nothing():
    answer = diagnose(
        toy.Toy(),
        logs({"spring.dahl_n": 1.0, "spring.dahl_m": 3e-3}),
        floors=toy.floors,
        without=("dahl", "coulomb"),
    )
    rows = [row for row in answer.shrinkage if row.baseline == "refitted"]
    assert not answer.effects and rows and all(row.after == row.before for row in rows)


def test_both_of_a_pair_are_found():
    answer = told({"sensors.pressure_offset_pa": -1000.0, "spring.coulomb_n": 0.5})
    assert {one.name for one in answer.effects} == {"pressure_offset", "coulomb"}


def test_what_the_data_cannot_tell_apart_is_a_set_and_no_name():
    def no_gas(*given, **more):
        return {link: floor for link, floor in toy.floors(*given, **more).items() if link != "gas"}

    answer = told({"sensors.pressure_offset_pa": -1000.0}, floors=no_gas)
    assert answer.verdict == "not_separable"
    first = answer.effects[0]
    assert {first.name, *first.not_separable_from} == {"pressure_offset", "force_offset"}


def test_effect_that_a_nominal_parameter_imitates_is_left_to_it_and_reported():
    answer = told({"gas.leak_ratio": 0.3})
    assert not answer.effects
    assert "gas.loss_per_s" in [one.name for one in answer.nominal_moved]


def test_logs_that_stand_still_say_which_effects_they_could_not_show():
    answer = told(still=True)
    assert answer.verdict in ("no_gap", "not_excited")
    assert {"coulomb", "dahl", "hardening", "cogging", "leak"} <= set(answer.not_tested)
    assert "valve_delay" not in answer.not_tested


def test_shrinkage_is_judged_on_trials_set_aside():
    answer = diagnose(toy.Toy(), logs({"spring.cubic_n_m3": -2e5}), floors=toy.floors)
    force = next(
        row
        for row in answer.shrinkage
        if row.channel == "force_n" and row.log == "all" and row.baseline == "refitted"
    )
    assert force.closed_share > 0.98


def test_progress_goes_up_and_a_stop_stops():
    seen = []
    diagnose(
        toy.Toy(),
        logs(count=1),
        floors=toy.floors,
        how_far=False,
        progress=lambda stage, share: seen.append(share),
    )
    assert seen == sorted(seen) and seen[-1] == 1.0
    with pytest.raises(Stopped):
        diagnose(toy.Toy(), logs(count=1), floors=toy.floors, stop=lambda: True)


def test_same_logs_give_the_same_answer():
    data = logs({"drive.coulomb_a": 0.02}, count=1)
    first, second = (
        diagnose(toy.Toy(), data, floors=toy.floors, how_far=False).as_json() | {"seconds": 0.0}
        for _ in range(2)
    )
    assert first == second
