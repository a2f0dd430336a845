"""Errors that no law makes: they move what they are said to move, as the numbers of the plant do
that mean the same, and tell where an effect sits.
"""

import numpy as np
import pytest

from epa_rt.gap.likelihood.floor import floors
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.rig.house.doubt.bench import Doubted, doubted_residual
from epa_rt.gap.rig.house.doubt.places import OFF, SIGN
from epa_rt.gap.rig.house.residuals import at_rate
from epa_rt.gap.where.origin import origins
from tests.gap.house.runs import plant_with, recorded, subject


def moved(rig, errors):
    """Link to the change of its residual (n,) by errors that are the same in every cycle, or
    (N,).
    """
    house, log = subject(rig), recorded(rig, 1)
    prepared = house.prepare(log)
    whole = {
        name: np.broadcast_to(
            error,
            (2, prepared.count) if name in ("pull", "stretch", "volume") else (prepared.count,),
        )
        for name, error in errors.items()
    }
    return {
        link.name: (
            at_rate(
                doubted_residual(Doubted(prepared, house.plant.params, whole), link.name),
                prepared.judged[link.name],
            )
            - house.residual(prepared, {}, link.name)
        )
        for link in house.links
    }


SAME = (  # an error that is the same in every cycle, and the number of the plant that means it
    ("bench", {"force": 2.0}, {"sensors.force_offset_n": 2.0}),
    ("bench", {"gauge0": 800.0}, {"sensors.muscle0_gauge_offset_pa": 800.0}),
    ("knee", {"gauge1": 800.0}, {"sensors.muscle1_gauge_offset_pa": 800.0}),
    ("bench", {"current": 0.03}, {"sensors.motor_current_offset_a": 0.03}),
    ("bench", {"angle": 0.02}, {"sensors.motor_angle_offset_rad": 0.02}),
    ("knee", {"place": 0.01}, {"sensors.joint_angle_offset_rad": 0.01}),
    ("bench", {"volume": 2e-7}, {"gas.dead_volume_m3": 2e-7}),
    ("bench", {"stretch": -1e-4}, {"load.rest0_m": 1e-4}),
)


@pytest.mark.parametrize(
    ("rig", "errors", "numbers"), SAME, ids=lambda x: "+".join(x) if isinstance(x, dict) else x
)
def test_a_constant_error_does_what_the_plant_s_own_number_does(rig, errors, numbers):
    from epa_rt.models.knobs import read_knob

    house = subject(rig)
    prepared = house.prepare(recorded(rig, 1))
    values = {key: read_knob(house.plant.params, key) + by for key, by in numbers.items()}
    for link, change in moved(rig, errors).items():
        wanted = house.residual(prepared, values, link) - house.residual(prepared, {}, link)
        assert np.nanmax(np.abs(change - wanted)) < 0.02 * max(
            float(np.nanmax(np.abs(wanted))), 1e-9
        ), link


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_an_error_shows_in_the_links_that_it_is_said_to_move_and_in_no_other(rig):
    house = subject(rig)
    prepared = house.prepare(recorded(rig, 1))
    doubted = house.doubted({prepared.name: prepared})
    before = {link.name: house.residual(prepared, {}, link.name) for link in house.links}
    seen = set()
    for key, knob in doubted.knobs.items():
        if SIGN not in key:
            continue
        after = {name: doubted.residual(prepared, {key: knob.spread}, name) for name in before}
        moves = {
            name for name in before if not np.array_equal(before[name], after[name], equal_nan=True)
        }
        assert moves <= set(doubted.touched(key)), key
        assert all(
            np.array_equal(np.isnan(before[name]), np.isnan(after[name])) for name in before
        ), key
        seen |= {(key.split(SIGN)[0], name) for name in moves}
    said = {
        (name, link)
        for name in {name for name, _ in seen}
        for link in OFF[name].links
        if link in before
    }
    assert said - seen == (
        {("travel", "gas1"), ("angle", "gas1")} if rig == "knee" else set()
    )  # of a knee's muscles one alone hangs on the spool


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_on_a_strapped_plant_with_a_late_cell_errors_move_what_they_are_said_to_and_leave_nothing_behind(  # noqa: E501
    rig,
):
    from epa_rt.gap.rig.house import open_house
    from tests.gap.house.runs import ROOT

    plant = plant_with(
        rig,
        f"strapped_{rig}",
        muscle__strap_compliance_m_n=1e-5,
        sensors__force_lag_s=5e-3,
        sensors__gauge_crosstalk_pa_n=3.0,
    )
    house = open_house(ROOT / "config/rigs" / f"{rig}.yaml", plant)
    prepared = house.prepare(recorded(rig, 1))
    doubted = house.doubted({prepared.name: prepared})
    before = {link.name: house.residual(prepared, {}, link.name) for link in house.links}
    for key in [f"{name}{SIGN}0" for name in OFF if f"{name}{SIGN}0" in doubted.knobs]:
        moves = {
            name
            for name in before
            if not np.array_equal(
                before[name],
                doubted.residual(prepared, {key: doubted.knobs[key].spread}, name),
                equal_nan=True,
            )
        }
        assert moves <= set(doubted.touched(key)), key
    assert all(
        np.array_equal(before[name], house.residual(prepared, {}, name), equal_nan=True)
        for name in before
    )


def test_no_error_is_no_difference():
    house = subject("bench")
    prepared = house.prepare(recorded("bench", 1))
    doubted = house.doubted({prepared.name: prepared})
    errors = {
        name: np.zeros(
            (2, prepared.count) if name in ("pull", "stretch", "volume") else prepared.count
        )
        for name in {key.split(SIGN)[0] for key in doubted.knobs if SIGN in key}
    }
    for link in house.links:
        found = at_rate(
            doubted_residual(Doubted(prepared, house.plant.params, errors), link.name),
            prepared.judged[link.name],
        )
        assert np.array_equal(house.residual(prepared, {}, link.name), found, equal_nan=True)


def test_a_slack_muscle_has_no_force_to_be_wrong():
    house = subject("bench")
    prepared = house.prepare(recorded("bench", 1))
    slack = Doubted(prepared, house.plant.params, {}).predicted_force(0) == 0.0
    off = Doubted(
        prepared, house.plant.params, {"pull": np.ones((2, prepared.count))}
    ).predicted_force(0)
    assert slack.any() and not off[slack].any()


HIDDEN = (
    ("bench", "spool", {"transmission__backlash_rad": 0.15}),
    ("knee", "load", {"load__knee_coulomb_nm": 0.15}),
)
MORE = (
    ("bench", "gas", {"gas__leak_per_s": 0.01}),
    ("bench", "gauge", {"sensors__gauge_skew_s": 0.01}),
    # by the command line: tests/cli/test_gap.py, test_localise_says_where_without_a_cause
    ("bench", "muscle", {"muscle__slip_ratio": 0.05}),
    ("bench", "force_cell", {"sensors__force_crosstalk_n_pa": 3e-5}),
    ("bench", "drive", {"drive__cogging_nm": 2e-3}),
    ("bench", "spool", {"transmission__eccentricity_ratio": 0.05}),
    ("bench", "gas", {"gas__fill_heating_ratio": 1.2, "gas__heat_exchange_per_s": 1.0}),
    ("knee", "gas", {"gas__adiabatic_ratio": 1.0, "gas__wall_exchange_per_s": 1.0}),
)


@pytest.mark.parametrize(
    ("rig", "where", "numbers"),
    (*HIDDEN, *(pytest.param(*one, marks=pytest.mark.slow) for one in MORE)),
    ids=lambda x: "+".join(x) if isinstance(x, dict) else x,
)
def test_the_place_of_an_effect_is_told_without_its_law(rig, where, numbers):
    house, log = (
        subject(rig),
        recorded(rig, 3, plant_with(rig, f"hidden_{'_'.join(numbers)}", **numbers)),
    )
    problem = Problem(house, [log], floors(house, [log], {}))
    said = origins(problem, settled(problem).values)
    assert said[0].place == where and said[0].explained_share > 0.5, said[:3]


@pytest.mark.parametrize(
    ("rig", "dropped"),
    (
        ("knee", ("muscle1_gauge_pa",)),
        ("knee", ("muscle0_gauge_pa",)),
        ("bench", ("muscle0_gauge_pa",)),
        ("bench", ("force_n",)),
        ("bench", ("muscle0_gauge_pa", "force_n")),
        ("knee", ("muscle0_gauge_pa", "muscle1_gauge_pa", "force_n")),
    ),
    ids=str,
)
def test_a_rig_that_measures_less_has_fewer_places_and_none_that_cannot_be_asked(
    rig, dropped, monkeypatch
):
    from epa_rt.gap.rig.house import open_house
    from epa_rt.gap.rig.house.channels import channels_of
    from tests.gap.house.runs import ROOT, plant_of

    monkeypatch.setattr(
        "epa_rt.gap.rig.house.subject.channels_of",
        lambda of: {
            port: channel for port, channel in channels_of(of).items() if port not in dropped
        },
    )
    house = open_house(ROOT / "config/rigs" / f"{rig}.yaml", plant_of(rig))
    prepared = house.prepare(recorded(rig, 1))
    doubted = house.doubted({prepared.name: prepared})
    for effect in doubted.catalogue:
        for link in {link for key in effect.knobs for link in doubted.touched(key)}:
            found = doubted.residual(
                prepared, {key: doubted.knobs[key].spread for key in effect.knobs}, link
            )
            assert np.array_equal(np.isnan(found), ~prepared.judged[link])
