"""A carriage of somebody else's simulator: its controller holds the force from row to row, and one
of its logs begins in the middle of a motion.
"""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from tests.gap.foreign.carriages import STRANGER, opened

PERIOD_S = 1e-3
RIG = """rig: stranger
kind: carriage
plant: plant.yaml
rate: 100 Hz
lowpass: 40 Hz
channels: {position: place_m, force: cmd_force_n}
settings: {typical_force: 40 N, typical_speed: 0.15 m/s, stroke: 0.25 m, middle: 0.15 m, pitch: 20 mm}
"""  # noqa: E501
PLANT = (
    "plant: stranger\nkind: carriage\ncarriage: {inertia: 41 kg}\nfriction: {viscous: 165 N*s/m}\n"
)


@pytest.fixture
def stranger(tmp_path):
    return opened(tmp_path, RIG, PLANT)


def answer(subject, late_rows: int, **stray):
    t = np.arange(0.0, 14.0, PERIOD_S)
    waves = 0.15 + 0.10 * np.sin(2 * np.pi * 0.3 * t) + 0.03 * np.sin(2 * np.pi * 0.9 * t + 1.0)
    smooth = np.ones(1000) / 1000.0
    ramps = 0.05 + 0.2 * np.convolve(
        np.convolve(0.5 * (1.0 + np.sign(np.sin(2 * np.pi * 0.2 * t))), smooth, "same"),
        smooth,
        "same",
    )
    logs = [
        STRANGER.driven(name, wanted, np.random.default_rng(seed), late_rows, **stray)
        for name, wanted, seed in (("waves", waves, 1), ("ramps", ramps, 2))
    ]
    return diagnose(subject, logs, how_far=False)


def test_a_force_that_is_held_from_row_to_row_is_no_late_drive(stranger):
    found = answer(stranger, 0)
    assert found.verdict == "no_gap", found.says
    assert 0.3 < found.refitted["clock.row_ratio"] < 0.7


def test_a_drive_that_is_late_by_four_rows_is_named(stranger):
    found = answer(stranger, 4)
    assert [one.name for one in found.effects] == ["drive_delay"], found.says
    delay = found.effects[0].parameters[0].value + found.fitted["clock.row_ratio"] * PERIOD_S
    assert delay == pytest.approx(4.5e-3, abs=3e-4)


def test_a_force_that_returns_at_a_pitch_that_the_rig_file_does_not_say_is_found(stranger):
    found = answer(stranger, 0, wave_n=4.0, wave_m=0.033)
    assert [one.name for one in found.effects] == ["cogging"], found.says
    assert found.fitted["drive.cogging_periods"] == pytest.approx(20.0 / 33.0, abs=0.003)
    assert abs(found.fitted["drive.cogging_n"]) == pytest.approx(4.0, rel=0.05)
