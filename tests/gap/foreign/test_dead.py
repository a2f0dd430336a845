"""A drive's channel that says one thing while the rig moves is said, and nothing is refused for
it.
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


@pytest.mark.parametrize(("kind", "role"), [("shaft", "torque"), ("servo", "command")])
def test_what_is_asked_of_a_drive_and_never_changes_is_said(kind, role):
    rig, name, recording = made(kind, role, lambda values: np.full(len(values), 0.0))
    (finding,) = check_dead([recording], rig)
    assert (finding.severity, finding.channel) == ("note", name)
    assert "found 0 on every row while" in finding.says and "expected" in finding.says


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
