"""A joint that lacks two effects of which each hides the other: dry friction makes drag seem to
fall with speed, and drag that grows with its square makes friction seem to rise towards standstill.
And a servo of which no two of its three effects explain much.
"""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Recording
from scripts import outsider_servo
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.made import one_trial

PERIOD_S, STEP_RAD, REST_RAD = 4e-3, 2.0 * np.pi / 2**12, -2.4
INERTIA_KG_M2, DRAG_NM_S_RAD, LEVEL_NM, SQUARE_NM_S2_RAD2 = 0.05, 0.12, 0.6, 0.17
RIG = """rig: joint
kind: shaft
plant: plant.yaml
rate: 50 Hz
lowpass: 20 Hz
channels: {angle: place, torque: drive}
settings: {typical_torque: 1.5 N*m, typical_speed: 1.5 rad/s, stroke: 3 rad}
steps: {angle: 0.001534 rad}
"""
PLANT = """plant: joint
kind: shaft
shaft: {inertia: 0.0485 kg*m^2}
friction: {viscous: 0.135 N*m*s/rad}
"""


def driven(seed: int, spring_nm_rad: float) -> Recording:
    """What moves it, read by an encoder whose steps are all the noise there is."""
    random, t = np.random.default_rng(seed), np.arange(0.0, 24.0, PERIOD_S)
    q, v, a = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
    for hz, size in zip((0.21, 0.57, 1.3, 2.7), (0.8, 0.35, 0.12, 0.04), strict=True):
        w = 2.0 * np.pi * hz * random.uniform(0.9, 1.1)
        angle = w * t + random.uniform(0.0, 2.0 * np.pi)
        q += size * np.sin(angle)
        v += size * w * np.cos(angle)
        a -= size * w**2 * np.sin(angle)
    torque = INERTIA_KG_M2 * a + DRAG_NM_S_RAD * v + SQUARE_NM_S2_RAD2 * v * np.abs(v)
    torque += LEVEL_NM * np.tanh(v / 5e-3) + spring_nm_rad * (q - REST_RAD)
    columns = {
        "place": np.round(q / STEP_RAD) * STEP_RAD,
        "drive": torque + random.normal(0.0, 0.01, len(t)),
    }
    return one_trial(f"log{seed}", "joint", PERIOD_S, columns)


@pytest.mark.parametrize("spring_nm_rad", [0.0, 0.14])
def test_friction_and_drag_that_hide_each_other_are_both_named(spring_nm_rad, tmp_path):
    logs = [driven(seed, spring_nm_rad) for seed in (1, 2)]
    found = diagnose(opened(tmp_path, RIG, PLANT), logs, how_far=False)
    missing = {"coulomb", "viscous_quadratic"} | ({"spring"} if spring_nm_rad else set())
    assert {one.name for one in found.effects} == missing, found.says
    assert min(one.confidence for one in found.effects) > 0.9, found.says
    assert found.fitted["friction.coulomb_nm"] == pytest.approx(LEVEL_NM, rel=0.1)
    assert found.fitted["friction.viscous_nm_s_rad"] == pytest.approx(DRAG_NM_S_RAD, abs=0.05)


def test_three_effects_are_named_of_which_two_are_no_more_probable_than_none(tmp_path):
    servo = outsider_servo.made(np.random.default_rng(26), 3)
    found = diagnose(opened(tmp_path, servo.rig, servo.plant), servo.logs, how_far=False)
    assert servo.has == ("constant", "dead", "weight")
    assert {one.name for one in found.effects} == {"constant_load", "deadband", "gravity"}
    assert min(one.confidence for one in found.effects) > 0.9, found.says
