"""A unit that is wrong by a thousand is found on rigs of others, too, and real recordings are let
through.
"""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.rig.foreign.sizes import check_sizes
from tests.gap.foreign.made import subject_of, with_output
from tests.gap.foreign.real import recording

KINDS = {
    "carriage": ("position", "force"),
    "chamber": ("pressure",),
    "servo": ("command", "position"),
    "piston": ("position", "pressure"),
}
REAL = {
    "carriage": ("emps", "emps/DATA_EMPS.mat"),
    "chamber": ("zillen_chamber", "zillen_pneumatic/chambers/Aluminium.csv"),
    "servo": (
        "sage_so101",
        "sage_so101/step_response/control.csv",
        "sage_so101/step_response/state_motor.csv",
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_rig_as_it_is_has_the_sizes_of_its_file(kind):
    subject = subject_of(kind)
    assert not check_sizes([with_output(kind, {})], subject.rig)


@pytest.mark.parametrize(
    ("kind", "role"), [(kind, role) for kind, roles in KINDS.items() for role in roles]
)
@pytest.mark.parametrize(("factor", "like"), [(1e3, "large"), (1e-3, "small")])
def test_a_channel_wrong_by_a_thousand_is_refused(kind, role, factor, like):
    subject, made = subject_of(kind), with_output(kind, {})
    name = subject.rig.channels[role]
    wrong = replace(made, columns={**made.columns, name: made.columns[name] * factor})
    (finding,) = check_sizes([wrong], subject.rig)
    assert (finding.severity, finding.channel) == ("refuse", name)
    assert like in finding.says and "in the rig file" in finding.says


def test_a_channel_that_stands_at_zero_or_says_nothing_has_no_size():
    subject, made = subject_of("chamber"), with_output("chamber", {})
    name = subject.rig.channels["pressure"]
    for value in (0.0, np.nan):
        assert not check_sizes(
            [replace(made, columns={**made.columns, name: np.full(made.samples, value)})],
            subject.rig,
        )


@pytest.mark.parametrize("kind", REAL)
def test_real_recordings_are_let_through(kind, tmp_path):
    mapping, *names = REAL[kind]
    assert not check_sizes([recording(tmp_path, mapping, *names)], subject_of(kind).rig)


@pytest.mark.parametrize(
    ("kind", "role", "factor"), [("servo", "position", 57.3), ("chamber", "pressure", 14.5)]
)
def test_units_that_are_often_mistaken_for_one_another_are_refused(kind, role, factor):
    """Degrees for radians, pounds per square inch for bar."""
    subject, made = subject_of(kind), with_output(kind, {})
    name = subject.rig.channels[role]
    supply = (
        {name: np.full(made.samples, 0.9 * subject.rig.settings["supply"])}
        if kind == "chamber"
        else {
            name: (
                0.8
                * made.columns[name]
                * subject.rig.settings["stroke"]
                / np.ptp(made.columns[name])
            )
        }
    )
    assert not check_sizes([replace(made, columns={**made.columns, **supply})], subject.rig)
    wrong = replace(made, columns={**made.columns, name: supply[name] * factor})
    assert [one.severity for one in check_sizes([wrong], subject.rig)] == ["refuse"]


@pytest.mark.parametrize(
    ("kind", "role"), [("carriage", "position"), ("shaft", "angle"), ("piston", "position")]
)
@pytest.mark.parametrize(("factor", "like"), [(1.0, None), (1e3, "large"), (1e-3, "small")])
def test_a_place_that_counts_from_far_away_is_held_against_the_stroke_about_its_middle(
    kind, role, factor, like
):
    subject, made = subject_of(kind), with_output(kind, {})
    name, stroke = subject.rig.channels[role], subject.rig.settings["stroke"]
    rig = replace(subject.rig, settings={**subject.rig.settings, "middle": 24.0 * stroke})
    far = replace(
        made,
        columns={
            **made.columns,
            name: (
                factor
                * (24.0 * stroke + 0.5 * stroke * np.sin(np.linspace(0.0, 40.0, made.samples)))
            ),
        },
    )
    found = check_sizes([far], rig)
    assert [one.severity for one in found] == ["refuse"] * (like is not None)
    assert all(f"too {like}" in one.says and "about its middle" in one.says for one in found)


@pytest.mark.parametrize(
    ("strokes", "like"), [(500.0, "too small"), (-500.0, "too small"), (40.0, "too far from it")]
)
def test_a_middle_that_the_place_never_comes_near_is_suspected_beside_the_import(strokes, like):
    subject, made = subject_of("carriage"), with_output("carriage", {})
    settings = subject.rig.settings
    middle = strokes * settings["stroke"]
    (finding,) = check_sizes([made], replace(subject.rig, settings={**settings, "middle": middle}))
    assert f"about its middle of {middle:.3g} m" in finding.says and like in finding.says
    assert finding.says.endswith("scale of the import may be wrong, or the setting 'middle'")
    name = subject.rig.channels["position"]
    (far,) = check_sizes(
        [replace(made, columns={**made.columns, name: 1e3 * made.columns[name]})],
        replace(subject.rig, settings={**settings, "middle": 0.0}),
    )
    assert far.says.endswith("scale of the import may be wrong")
