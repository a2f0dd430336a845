"""A turned sign is found on rigs of others before any effect is named, and no rig is taken for turned that has an effect."""

from dataclasses import replace

import pytest

from epa_rt.gap.foreign.signs import check_signs
from tests.gap.foreign.made import subject_of, with_output
from tests.gap.foreign.real import recording
from tests.gap.foreign.test_sizes import REAL

TURNED = {"carriage": ("position", "force"), "servo": ("command", "position"), "piston": ("force",)}


@pytest.mark.parametrize(("kind", "role"), [(kind, role) for kind, roles in TURNED.items() for role in roles])
def test_a_turned_channel_is_refused(kind, role):
    subject, made = subject_of(kind), with_output(kind, {})
    assert not check_signs([made], subject)
    name = subject.rig.channels[role]
    (finding,) = check_signs([replace(made, columns={**made.columns, name: -made.columns[name]})], subject)
    assert finding.severity == "refuse" and "sign of one of them looks turned" in finding.says


@pytest.mark.parametrize("kind", TURNED)
def test_no_effect_of_the_catalogue_looks_like_a_turned_sign(kind):
    subject = subject_of(kind)
    for effect in subject.catalogue:
        for start in effect.starts:
            strong = {key: min(max(3.0 * value, subject.knobs[key].low), subject.knobs[key].high) for key, value in zip(effect.knobs, start, strict=True)}
            assert not check_signs([with_output(kind, strong)], subject), effect.name


@pytest.mark.parametrize("kind", REAL)
def test_real_recordings_are_let_through(kind, tmp_path):
    mapping, *names = REAL[kind]
    assert not check_signs([recording(tmp_path, mapping, *names)], subject_of(kind))
