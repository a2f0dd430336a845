"""A pendulum on a motor, of somebody else's simulator: weight and friction are told in newton metres."""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Recording
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.made import one_trial

PERIOD_S, SUBSTEPS = 2e-3, 10
INERTIA, DRAG, WEIGHT_NM = 0.052, 0.19, 0.9
RIG = """rig: arm
kind: shaft
plant: plant.yaml
rate: 100 Hz
lowpass: 40 Hz
channels: {angle: arm_rad, torque: motor_nm}
settings: {typical_torque: 1 N*m, typical_speed: 2 rad/s, stroke: 2 rad}
"""
PLANT = "plant: arm\nkind: shaft\nshaft: {inertia: 0.05 kg*m^2}\nfriction: {viscous: 0.2 N*m*s/rad}\n"
HANGS = PLANT + "effects: {gravity: {gravity_sine: 0.9 N*m}}\n"


def swing(seed: int, coulomb_nm: float = 0.0) -> Recording:
    random, t = np.random.default_rng(seed), np.arange(0.0, 16.0, PERIOD_S)
    wanted = 0.7 * np.sin(2 * np.pi * 0.31 * t) + 0.3 * np.sin(2 * np.pi * 0.83 * t + seed)
    speed, angle, torque = np.gradient(wanted, PERIOD_S), np.empty(len(t)), np.empty(len(t))
    q, v, step = wanted[0], speed[0], PERIOD_S / SUBSTEPS
    for k in range(len(t)):
        angle[k] = q + random.normal(0.0, 2e-6)
        held = 30.0 * (wanted[k] - q) + 2.0 * (speed[k] - v)
        torque[k] = held + random.normal(0.0, 5e-3)
        for _ in range(SUBSTEPS):
            free = v + step * (held - DRAG * v - WEIGHT_NM * np.sin(q)) / INERTIA
            v = free - np.sign(free) * min(abs(free), step * coulomb_nm / INERTIA)
            q += step * v
    return one_trial(f"log{seed}", "arm", PERIOD_S, {"arm_rad": angle, "motor_nm": torque})


def test_the_weight_of_an_arm_is_named_and_weighed(tmp_path):
    found = diagnose(opened(tmp_path, RIG, PLANT), [swing(1), swing(2)], how_far=False)
    assert [one.name for one in found.effects] == ["gravity"], found.says
    assert found.fitted["load.gravity_sine_nm"] == pytest.approx(WEIGHT_NM, rel=0.02)
    assert found.fitted["shaft.inertia_kg_m2"] == pytest.approx(INERTIA, rel=0.02)


def test_with_its_weight_in_the_plant_file_there_is_no_gap(tmp_path):
    found = diagnose(opened(tmp_path, RIG, HANGS), [swing(1), swing(2)], how_far=False)
    assert found.verdict == "no_gap", found.says


def test_dry_friction_beside_the_weight_is_named(tmp_path):
    found = diagnose(opened(tmp_path, RIG, HANGS), [swing(1, 0.15), swing(2, 0.15)], how_far=False)
    assert found.effects[0].family == "friction", found.says
    assert found.effects[0].parameters[0].value == pytest.approx(0.15, rel=0.1)
