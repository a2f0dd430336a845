"""Position and speed of others against each other: which one is off is told by what the position
was asked to be; where that is not known, the one that is used is refused.
"""

import numpy as np
import pytest

from epa_rt.cli.gap.inputs import _of_used
from epa_rt.gap.hygiene.check import check
from tests.gap.foreign.made import blank, one_trial, subject_of
from tests.gap.recorded import recording_of, rig_of_name, scaled

NAME, SPEED = "carriage_position_m", "carriage_speed_m_s"


def findings(position=1.0, speed=1.0, asked=None, used=True):
    """What is found on a carriage with a column of its speed, each of them times a factor;
    ``asked``: the name of the column that it follows a little late and weakly.
    """
    made = blank("carriage")
    place = made.columns[NAME]
    columns = {
        **made.columns,
        "motor_force_n": np.gradient(np.gradient(place)),
        NAME: position * place,
        SPEED: speed * np.gradient(place) / made.period_s,
    }
    if asked is not None:
        columns[asked] = np.concatenate([place[5:], np.full(5, place[-1])]) * 1.03
    found = check([one_trial("made", made.rig, made.period_s, columns)], None)
    return _of_used(found, subject_of("carriage")) if used else found


@pytest.mark.parametrize("asked", ["ref_" + NAME, "cmd_" + NAME])
@pytest.mark.parametrize(
    ("factor", "kind"), [(10.0, "units"), (0.1, "units"), (1e3, "units"), (-1.0, "sign")]
)
def test_with_a_target_it_is_known_which_one_is_off(asked, factor, kind):
    off = [one for one in findings(position=factor, asked=asked) if one.kind == kind]
    assert {(one.severity, one.channel) for one in off} == {("refuse", NAME)}, [
        one.says for one in off
    ]
    assert f"{NAME} does not fit {asked}: {NAME} looks " in off[0].says
    (off,) = [one for one in findings(speed=factor, asked=asked) if one.kind == kind]
    assert (off.severity, off.channel) == (
        "note",
        SPEED,
    ) and f"{NAME} fits {asked}: {SPEED} looks " in off.says


@pytest.mark.parametrize(
    ("factors", "words"),
    [
        ({"position": 10.0}, f"{SPEED} looks off by a tenth, or {NAME} by ten"),
        ({"speed": 10.0}, f"{SPEED} looks off by ten, or {NAME} by a tenth"),
        ({"position": -1.0}, "one of the two looks turned round"),
    ],
)
def test_without_a_target_the_position_is_refused_and_how_to_go_on_is_said(factors, words):
    (off,) = [one for one in findings(**factors) if one.kind in ("units", "sign")]
    assert (off.severity, off.channel) == ("refuse", NAME) and "target" not in off.says
    assert (
        f"{words} (where it is {SPEED}: no kind of rig reads it, import the log without that"
        " column)" in off.says
    )


@pytest.mark.parametrize("gain", [9.7, 9.99, 0.099, 0.0975])
def test_a_position_ten_times_off_is_found_though_the_loop_follows_with_a_little_less(gain):
    """Against its target alone, without a speed."""
    made = blank("carriage")
    columns = {NAME: gain * made.columns[NAME], "ref_" + NAME: made.columns[NAME]}
    (off,) = [
        one
        for one in check([one_trial("made", made.rig, made.period_s, columns)], None)
        if one.severity == "refuse"
    ]
    assert (off.kind, off.channel) == ("units", NAME) and (
        "looks off by ten" if gain > 1.0 else "looks off by a tenth"
    ) in off.says


def test_a_loop_of_others_that_follows_badly_and_a_speed_made_otherwise_are_let_alone():
    assert not [
        one
        for one in findings(position=0.4, speed=0.4, asked="ref_" + NAME)
        if one.severity == "refuse"
    ]
    assert not [one for one in findings(speed=2.0) if one.severity == "refuse"]


@pytest.mark.parametrize(
    ("name", "words"), [("motor_travel_m", "does not fit"), ("motor_speed_m_s", "fits")]
)
def test_of_a_rig_of_ours_it_is_said_what_was_looked_at(name, words):
    found = [
        one
        for one in check(
            [scaled(name, 0.5)(recording_of("bench", "identification_short"))], rig_of_name("bench")
        )
        if one.kind == "units"
    ]
    assert [one.channel for one in found] == [
        name
    ] and f"motor_travel_m {words} cmd_motor_travel_m: {name} looks off by 0.5" in found[0].says
