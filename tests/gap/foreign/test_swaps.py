"""Two channels that an import exchanged are found before any effect is named on rigs of others;
effects at any strength and real recordings do not look like it.
"""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.rig.foreign.swaps import check_swaps
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.made import one_trial, subject_of, with_output
from tests.gap.foreign.real import recording
from tests.gap.foreign.test_sizes import REAL

PAIRS = {
    "carriage": ("position", "force"),
    "servo": ("command", "position"),
    "shaft": ("angle", "torque"),
    "piston": ("position", "force"),
}
SCALE = {
    "carriage": 1e-3,
    "servo": 1.0,
    "shaft": 1.0,
    "piston": 1e-3,
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


@pytest.mark.parametrize("kind", [*PAIRS, "chamber"])
@pytest.mark.parametrize("times", [pytest.param(1.0, marks=pytest.mark.slow), 3.0])
def test_no_effect_of_the_catalogue_looks_like_it(kind, times):
    subject = subject_of(kind)
    for effect in subject.catalogue:
        strong = {
            key: min(max(times * value, subject.knobs[key].low), subject.knobs[key].high)
            for key, value in zip(effect.knobs, effect.starts[0], strict=True)
        }
        assert not check_swaps([with_output(kind, strong)], subject), effect.name


def test_an_output_without_a_value_is_no_channel_that_was_exchanged():
    made, name = with_output("piston", {}), subject_of("piston").rig.channels["force"]
    columns = {**made.columns, name: np.full(made.samples, np.nan)}
    assert not check_swaps([replace(made, columns=columns)], subject_of("piston"))


@pytest.mark.parametrize("kind", REAL)
def test_real_recordings_are_let_through(kind, tmp_path):
    mapping, *names = REAL[kind]
    assert not check_swaps([recording(tmp_path, mapping, *names)], subject_of(kind))


def test_strong_friction_of_a_piston_that_is_shut_does_not_look_like_it(tmp_path):
    """Its gas makes force and pressure follow the place, so that any of them may stand for it."""
    subject = opened(
        tmp_path,
        "rig: ram\nkind: piston\nplant: plant.yaml\nrate: 50 Hz\nlowpass: 10 Hz\n"
        "channels: {position: x_m, pressure: p_pa, force: f_n}\n"
        "settings: {typical_force: 60 N, typical_speed: 0.03 m/s, stroke: 80 mm, middle: 40 mm}\n",
        "plant: ram\nkind: piston\npiston: {area: 1200 mm^2}\nfriction: {viscous: 200 N*s/m}\n",
    )
    period_s, area_m2, outside_pa = 0.01, 1.256e-3, 101_325.0
    random, t = np.random.default_rng(5), np.arange(0.0, 60.0, period_s)
    x = 0.04 + 0.033 * np.sin(2 * np.pi * 0.11 * t) * np.cos(2 * np.pi * 0.017 * t)
    v = np.gradient(x, period_s)
    over_pa = 3.2e5 * 0.12 / (0.12 - x) - outside_pa
    friction_n = (8.0 + 0.35 * area_m2 * over_pa) * np.sign(v) + 300.0 * v
    columns = {
        "x_m": np.round(x / 1e-5) * 1e-5,
        "p_pa": over_pa + outside_pa + random.normal(0.0, 60.0, len(t)),
        "f_n": area_m2 * over_pa + friction_n + random.normal(0.0, 0.3, len(t)),
    }
    assert not check_swaps([one_trial("made", "ram", period_s, columns)], subject)
