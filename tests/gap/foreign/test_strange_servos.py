"""Servos of somebody else's simulator: which row a reading stands in, a log's scale and a gear with
mass beyond it are no other law; limits are found where they bite.
"""

import math

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign import servo_model
from scripts import outsider_servo
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.made import one_trial

PERIOD_S, SUBSTEPS, GAIN_PER_S, LAG_S = 0.02, 40, 14.0, 0.05
RIG = """rig: joint
kind: servo
plant: plant.yaml
rate: 50 Hz
lowpass: 20 Hz
channels: {command: cmd_rad, position: angle_rad}
steps: {position: 0.0015 rad}
settings: {stroke: 1 rad}
"""
PLANT = "plant: joint\nkind: servo\njoint: {gain: 13 1/s, lag: 55 ms}\nsensor: {zero: 0 rad}\n"


def run(
    seed: int,
    reads_first: bool = False,
    scale: float = 1.0,
    beyond: float = 0.0,
    rise_s2: float = 0.0,
    forward: float = 0.0,
    backward: float = 0.0,
    smooth: bool = False,
    speed: float = np.inf,
    torque: float = np.inf,
    ignored: float = 0.0,
) -> Recording:
    """``beyond``: part of the mass behind a gear of compliance ``rise_s2``; the loop closes on the
    joint. ``forward``, ``backward``: dry friction by direction, ``speed``, ``torque``: limits,
    rad/s; ``ignored``: error that the servo does not answer, rad.
    """
    random, t = np.random.default_rng(seed), np.arange(0.0, 30.0, PERIOD_S)
    steps = (
        0.4 * np.sin(2 * np.pi * 0.13 * t)
        if smooth
        else np.repeat(random.uniform(-0.5, 0.5, 20), 75)
    )
    command = steps + sum(0.06 * np.sin(2 * np.pi * f * t + seed) for f in (0.3, 0.9, 2.2))
    before, after, step = np.empty(len(t)), np.empty(len(t)), PERIOD_S / SUBSTEPS
    motor = joint = motor_speed = joint_speed = 0.0
    for k, wanted in enumerate(command.tolist()):
        before[k] = joint
        for _ in range(SUBSTEPS):
            error = wanted - joint if abs(wanted - joint) > ignored else 0.0
            asked = min(max(GAIN_PER_S * error, -speed), speed)
            push = min(max(asked - motor_speed, -torque), torque)
            if beyond > 0.0:
                turning = (
                    (motor - joint) + 0.4 * np.sqrt(rise_s2) * (motor_speed - joint_speed)
                ) / rise_s2
                joint_speed += step * turning
                push -= beyond * LAG_S * turning
            free = motor_speed + step * push / ((1.0 - beyond) * LAG_S)
            held = step * (forward if free > 0.0 else backward) / LAG_S
            motor_speed = math.copysign(max(abs(free) - held, 0.0), free)
            motor += step * motor_speed
            joint = joint + step * joint_speed if beyond > 0.0 else motor
        after[k] = joint
    read = (
        np.round(
            (scale * (before if reads_first else after) + random.normal(0.0, 3e-4, len(t))) / 0.0015
        )
        * 0.0015
    )
    return one_trial(f"log{seed}", "joint", PERIOD_S, {"cmd_rad": command, "angle_rad": read})


@pytest.fixture
def joint(tmp_path):
    return opened(tmp_path, RIG, PLANT)


@pytest.mark.parametrize("reads_first", [pytest.param(False, marks=pytest.mark.slow), True])
def test_a_loop_that_reads_before_it_commands_has_no_delay(joint, reads_first):
    found = diagnose(joint, [run(1, reads_first), run(2, reads_first)], how_far=False)
    assert found.verdict == "no_gap", found.says
    assert found.refitted["clock.row_ratio"] == pytest.approx(float(reads_first), abs=0.1)


def test_a_scale_of_the_log_is_named_before_a_weight(joint):
    found = diagnose(joint, [run(1, scale=1.04), run(2, scale=1.04)], how_far=False)
    assert found.effects[0].name == "sensor_scale", found.says
    assert found.fitted["sensor.scale_ratio"] == pytest.approx(0.04, abs=0.005)


def test_a_gear_that_winds_up_with_mass_beyond_it_is_no_delay(joint):
    found = diagnose(
        joint, [run(1, beyond=0.4, rise_s2=6e-4), run(2, beyond=0.4, rise_s2=6e-4)], how_far=False
    )
    assert found.effects[0].name == "gear_compliance", found.says
    assert "delay" not in {one.name for one in found.effects}
    assert found.fitted["gear.compliance_s2"] == pytest.approx(6e-4, rel=0.3)


def test_friction_that_differs_by_direction_is_friction(joint):
    found = diagnose(
        joint, [run(1, forward=0.5, backward=0.1), run(2, forward=0.5, backward=0.1)], how_far=False
    )
    assert found.effects[0].family == "friction" and found.verdict in (
        "explained",
        "not_separable",
    ), found.says


@pytest.mark.parametrize(
    ("law", "limit"),
    [
        ("torque", 0.4),
        pytest.param("torque", 2.5, marks=pytest.mark.slow),
        pytest.param("speed", 0.8, marks=pytest.mark.slow),
        ("speed", 2.5),
    ],
)
def test_a_limit_is_found_wherever_the_logs_begin_to_reach_it(joint, law, limit):
    smooth = limit < 1.0
    found = diagnose(
        joint,
        [run(1, smooth=smooth, **{law: limit}), run(2, smooth=smooth, **{law: limit})],
        how_far=False,
    )
    assert found.effects[0].name == f"{law}_limit", found.says
    assert found.posterior.models[0].left_share < 0.05, found.says
    assert found.fitted[f"drive.{law}_limit_s_rad"] == pytest.approx(1.0 / limit, rel=0.03)


@pytest.mark.parametrize("ignored", [0.028, pytest.param(0.035, marks=pytest.mark.slow)])
def test_a_servo_that_answers_larger_errors_in_full_has_a_dead_zone_of_that_kind(joint, ignored):
    found = diagnose(
        joint,
        [run(1, smooth=True, ignored=ignored), run(2, smooth=True, ignored=ignored)],
        how_far=False,
    )
    assert found.effects[0].name == "deadband_whole", found.says
    assert found.fitted["drive.ignored_rad"] == pytest.approx(ignored, rel=0.02)


def test_a_break_away_beside_a_dead_zone_and_a_load_is_found(tmp_path):
    """Its slope leads only a little way: fits of it begin near where it is."""
    machine, random = outsider_servo.made(np.random.default_rng(5), 1), np.random.default_rng(5)
    numbers = np.array([0.0, 0.0, 0.25, 0.0, 0.0085, 0.0, 0.0, 0.16, 0.0, 1.0, 0.0])
    logs = [outsider_servo.recorded(numbers, 0.0, f"log{i}", random) for i in range(2)]
    found = diagnose(opened(tmp_path, machine.rig, machine.plant), logs, how_far=False)
    assert {one.family for one in found.effects} == {"stiction", "offset", "deadband"}, found.says
    assert found.verdict == "explained" and found.posterior.models[0].left_share < 0.01
    assert found.fitted["friction.stiction_rad_s"] == pytest.approx(0.25, rel=0.06)


@pytest.mark.parametrize(
    "law",
    [
        {},
        {"BACKLASH": 0.03},
        {"COULOMB": 0.4},
        {"DEADBAND": 0.02},
        {"TORQUE_LIMIT": 0.8},
        {"SPEED_LIMIT": 0.5},
        {"GRAVITY_COSINE": 1.2, "COULOMB": 0.15},
        {"COMPLIANCE": 6e-4, "BEYOND": 0.4},
        {"COMPLIANCE": 5e-5, "BEYOND": 0.3},
        {"COMPLIANCE": 1e-3, "BEYOND": 0.3, "COULOMB": 0.3},
    ],
)
def test_the_model_steps_finely_enough(law):
    command, finer = run(1).columns["cmd_rad"], 16
    numbers = np.zeros(servo_model.PLACES)
    for name, value in {"GAIN": GAIN_PER_S, "LAG": LAG_S, **law}.items():
        numbers[getattr(servo_model, name)] = value

    def angle(times: int) -> np.ndarray:
        asked = np.repeat(command, times)
        return servo_model.run(
            asked, np.ones(len(asked)), np.zeros(len(asked)), numbers, 0.0, PERIOD_S / times
        )[times - 1 :: times]

    assert (
        np.sqrt(np.mean((angle(1) - angle(finer)) ** 2)) < 2e-4
    )  # rad: an eighth of the encoder's step
