"""A drive's channel that says one thing while the rig moves is said; an output that does is left
out, and refused where no log has another.
"""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.rig.foreign.dead import check_dead
from tests.gap.foreign.made import subject_of, with_output


def made(kind: str, role: str, values):
    subject, recording = subject_of(kind), with_output(kind, {})
    name = subject.rig.channels[role]
    return (
        subject.rig,
        name,
        replace(recording, columns={**recording.columns, name: values(recording.columns[name])}),
    )


def dead(kind: str, role: str, value: float, name: str = "dead"):
    rig, column, recording = made(kind, role, lambda values: np.full(len(values), value))
    return rig, column, replace(recording, name=name)


@pytest.mark.parametrize(
    ("kind", "role", "value"), [("shaft", "torque", 0.5), ("servo", "command", 0.0)]
)
def test_what_is_asked_of_a_drive_and_never_changes_is_said(kind, role, value):
    rig, name, recording = dead(kind, role, value)
    (finding,) = check_dead([recording], rig, scaled=True)
    assert (finding.severity, finding.channel) == ("note", name)
    assert f"found {value:g} on every row while" in finding.says and "expected" in finding.says


OUTPUTS = [
    ("carriage", "force", 0.0, "carriage_position_m"),
    ("carriage", "force", 7.0, "carriage_position_m"),
    ("piston", "force", 0.0, "piston_position_m"),
    ("servo", "position", 0.1, "cmd_"),
    ("chamber", "pressure", 8e5, None),
]


@pytest.mark.parametrize(("kind", "role", "value", "beside"), OUTPUTS)
def test_an_output_of_one_value_beside_moving_inputs_is_refused(kind, role, value, beside):
    rig, name, recording = dead(kind, role, value)
    refused = [one for one in check_dead([recording], rig) if one.severity == "refuse"]
    assert [one.channel for one in refused] == [name]
    says = refused[0].says
    assert f"found {value:g} on every row" in says and "nothing can be judged" in says
    assert (" while " in says) == (beside is not None) and (beside or "") in says


@pytest.mark.parametrize(("kind", "role", "value", "beside"), OUTPUTS)
def test_beside_a_log_in_which_it_moves_it_is_left_out_but_a_place_may_be_held(
    kind, role, value, beside
):
    rig, name, recording = dead(kind, role, value)
    other = replace(with_output(kind, {}), name="alive")
    found = [one for one in check_dead([other, recording], rig) if one.channel == name]
    (one,) = found
    assert one.log == "dead" and "on every row" in one.says
    if kind == "servo":
        assert (one.severity, one.rows) == ("note", ())
    else:
        assert (one.severity, one.rows) == ("exclude", ((0, recording.samples),))


def test_a_drive_that_is_asked_for_nothing_in_any_log_leaves_the_scale_open():
    rig, name, recording = dead("shaft", "torque", 0.0)
    severities = [one.severity for one in check_dead([recording], rig)]
    assert sorted(severities) == ["note", "refuse"]
    driven = replace(with_output("shaft", {}), name="driven")
    for logs, scaled in (([recording, driven], False), ([recording], True)):
        (finding,) = check_dead(logs, rig, scaled)
        assert (finding.severity, finding.channel, finding.log) == ("note", name, "dead")


def test_an_output_that_stands_while_its_inputs_rest_is_no_dead_one():
    rig, name, recording = dead("carriage", "force", 20.0)
    place = rig.channels["position"]
    resting = {**recording.columns, place: np.full(recording.samples, 0.1)}
    assert not check_dead([replace(recording, columns=resting)], rig)


@pytest.mark.parametrize("kind", ["shaft", "carriage", "chamber", "servo", "piston"])
def test_a_rig_as_it_is_has_no_dead_drive(kind):
    assert not check_dead(
        [
            with_output(
                kind,
                (
                    {"friction.coulomb_n": 3.0}
                    if kind == "carriage"
                    else {"friction.coulomb_nm": 0.1}
                    if kind == "shaft"
                    else {}
                ),
            )
        ],
        subject_of(kind).rig,
    )


def test_a_rig_that_stands_still_altogether_is_no_dead_drive():
    rig, _, recording = made("shaft", "torque", np.zeros_like)
    still = replace(
        recording, columns={name: np.zeros(recording.samples) for name in recording.columns}
    )
    assert not check_dead([still], rig)
