"""Two channels that an import exchanged are found before any effect is named on rigs of others;
effects at any strength and real recordings do not look like it.
"""

from dataclasses import replace

import pytest

from epa_rt.gap.rig.foreign.swaps import check_swaps
from tests.gap.foreign.made import subject_of, with_output
from tests.gap.foreign.real import recording
from tests.gap.foreign.test_sizes import REAL

PAIRS = {
    "carriage": ("position", "force"),
    "servo": ("command", "position"),
    "shaft": ("angle", "torque"),
}
SCALE = {
    "carriage": 1e-3,
    "servo": 1.0,
    "shaft": 1.0,
}  # with which the first one's column had been read: millimetres


@pytest.mark.parametrize("kind", PAIRS)
def test_exchanged_channels_are_refused(kind):
    subject, made = subject_of(kind), with_output(kind, {})
    assert not check_swaps([made], subject)
    one, other = (subject.rig.channels[role] for role in PAIRS[kind])
    turned = replace(
        made,
        columns={
            **made.columns,
            one: made.columns[other] * SCALE[kind],
            other: made.columns[one] / SCALE[kind],
        },
    )
    (finding,) = check_swaps([turned], subject)
    assert (
        finding.severity == "refuse"
        and finding.kind == "swapped"
        and {one, other} <= set(finding.says.replace(":", "").split())
    )


@pytest.mark.parametrize("kind", [*PAIRS, "piston", "chamber"])
@pytest.mark.parametrize("times", [pytest.param(1.0, marks=pytest.mark.slow), 3.0])
def test_no_effect_of_the_catalogue_looks_like_it(kind, times):
    subject = subject_of(kind)
    for effect in subject.catalogue:
        strong = {
            key: min(max(times * value, subject.knobs[key].low), subject.knobs[key].high)
            for key, value in zip(effect.knobs, effect.starts[0], strict=True)
        }
        assert not check_swaps([with_output(kind, strong)], subject), effect.name


@pytest.mark.parametrize("kind", REAL)
def test_real_recordings_are_let_through(kind, tmp_path):
    mapping, *names = REAL[kind]
    assert not check_swaps([recording(tmp_path, mapping, *names)], subject_of(kind))
