"""A turned sign is said before any effect is named on rigs of others; effects at typical strength
and real recordings do not look like one.
"""

from dataclasses import replace

import pytest

from epa_rt.gap.rig.foreign.signs import check_signs
from tests.gap.foreign.made import subject_of, with_output
from tests.gap.foreign.real import recording
from tests.gap.foreign.test_sizes import REAL

TURNED = {"carriage": ("position", "force"), "servo": ("command", "position"), "piston": ("force",)}


@pytest.mark.parametrize(
    ("kind", "role"), [(kind, role) for kind, roles in TURNED.items() for role in roles]
)
def test_a_turned_channel_is_said(kind, role):
    subject, made = subject_of(kind), with_output(kind, {})
    assert not check_signs([made], subject)
    name = subject.rig.channels[role]
    (finding,) = check_signs(
        [replace(made, columns={**made.columns, name: -made.columns[name]})], subject
    )
    assert finding.severity == "note" and "sign of one of them may be turned" in finding.says


def test_a_mirrored_encoder_is_said_although_its_mean_is_right():
    subject, made = subject_of("servo"), with_output("servo", {})
    name = subject.rig.channels["position"]
    (finding,) = check_signs(
        [replace(made, columns={**made.columns, name: 6.0 - made.columns[name]})], subject
    )
    assert finding.channel == name


@pytest.mark.parametrize("kind", TURNED)
@pytest.mark.parametrize("times", [0.3, 1.0, 3.0])
def test_no_effect_of_the_catalogue_looks_like_a_turned_sign(kind, times):
    subject = subject_of(kind)
    for effect in subject.catalogue:
        for start in effect.starts:
            strong = {
                key: min(max(times * value, subject.knobs[key].low), subject.knobs[key].high)
                for key, value in zip(effect.knobs, start, strict=True)
            }
            assert not check_signs([with_output(kind, strong)], subject), effect.name


@pytest.mark.parametrize("kind", [kind for kind in REAL if kind in TURNED])
def test_real_recordings_are_let_through(kind, tmp_path):
    mapping, *names = REAL[kind]
    assert not check_signs([recording(tmp_path, mapping, *names)], subject_of(kind))
