"""A pendulum on a motor, of somebody else's simulator: weight and friction are told in newton
metres.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Recording
from scripts.outsider_machines import MACHINES, Fault, drawn, recorded
from scripts.outsider_machines import PERIOD_S as ROW_S
from scripts.seeded_faults import PLANT as PLANTS
from scripts.seeded_faults import RIG as RIGS
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
PLANT = (
    "plant: arm\nkind: shaft\nshaft: {inertia: 0.05 kg*m^2}\nfriction: {viscous: 0.2 N*m*s/rad}\n"
)
HANGS = PLANT + "effects: {gravity: {gravity_sine: 0.9 N*m}}\n"


def swing(
    seed: int,
    coulomb_nm: float = 0.0,
    weight_nm: float = WEIGHT_NM,
    hangs_rad: float = 0.0,
    noise_rad: float = 2e-6,
    late_rows: int = 0,
    breakaway_nm: float = 0.0,
    wave_nm: float = 0.0,
    spot_nm: float = 0.0,
    lag_s: float = 0.0,
    step_rad: float = 0.0,
) -> Recording:
    """``hangs_rad``: where the arm would come to rest; ``breakaway_nm``: what dry friction rises by
    towards standstill, over 0.15 rad/s; ``wave_nm``: by which it swings, once to a turn;
    ``spot_nm``: what it has more about 0.35 rad, a raised cosine that is half as high 0.1 rad away;
    ``late_rows``: after which a torque acts; ``lag_s``: by which it follows what was asked;
    ``step_rad``: of the encoder.
    """
    random, t = np.random.default_rng(seed), np.arange(0.0, 16.0, PERIOD_S)
    wanted = 0.7 * np.sin(2 * np.pi * 0.31 * t) + 0.3 * np.sin(2 * np.pi * 0.83 * t + seed)
    speed, angle, torque = np.gradient(wanted, PERIOD_S), np.empty(len(t)), np.empty(len(t))
    q, v, step, sent = (
        float(wanted[0]),
        float(speed[0]),
        PERIOD_S / SUBSTEPS,
        [0.0] * (late_rows + 1),
    )
    drive = 0.0
    for k, (place, rate) in enumerate(zip(wanted.tolist(), speed.tolist(), strict=True)):
        read = q + random.normal(0.0, noise_rad)
        angle[k] = round(read / step_rad) * step_rad if step_rad else read
        held = 30.0 * (place - q) + 2.0 * (rate - v)
        torque[k] = held + random.normal(0.0, 5e-3)
        sent.append(held)
        for _ in range(SUBSTEPS):
            asked = sent[-1 - late_rows]
            drive = drive + (asked - drive) * step / lag_s if lag_s else asked
            free = v + step * (drive - DRAG * v - weight_nm * math.sin(q - hangs_rad)) / INERTIA
            off = min(abs(q - 0.35), 0.2) / 0.2
            dry_nm = coulomb_nm + breakaway_nm * math.exp(-((v / 0.15) ** 2))
            dry_nm += wave_nm * math.sin(q + 0.4) + 0.5 * spot_nm * (1.0 + math.cos(math.pi * off))
            v = free - math.copysign(min(abs(free), step * dry_nm / INERTIA), free)
            q += step * v
    return one_trial(f"log{seed}", "arm", PERIOD_S, {"arm_rad": angle, "motor_nm": torque})


def sure(found):
    """Effects that are named with confidence."""
    return [one.name for one in found.effects if one.confidence >= 0.8]


def test_the_weight_of_an_arm_is_named_and_weighed(tmp_path):
    found = diagnose(opened(tmp_path, RIG, PLANT), [swing(1), swing(2)], how_far=False)
    assert sure(found) == ["gravity"], found.says
    assert found.fitted["load.gravity_sine_nm"] == pytest.approx(WEIGHT_NM, rel=0.02)
    assert found.fitted["shaft.inertia_kg_m2"] == pytest.approx(INERTIA, rel=0.02)


def test_with_its_weight_in_the_plant_file_there_is_no_gap(tmp_path):
    found = diagnose(opened(tmp_path, RIG, HANGS), [swing(1), swing(2)], how_far=False)
    assert found.verdict == "no_gap", found.says


def test_dry_friction_that_varies_with_the_angle_is_named_beside_its_level_and_the_weight(tmp_path):
    logs = [swing(seed, 0.15, wave_nm=0.1) for seed in (1, 2)]
    found = diagnose(opened(tmp_path, RIG, HANGS), logs, how_far=False)
    assert {one.name for one in found.effects} == {"coulomb", "friction_over_turn"}, found.says
    assert found.fitted["friction.coulomb_nm"] == pytest.approx(0.15, rel=0.1)
    assert found.fitted["friction.turn_nm"] == pytest.approx(0.1, rel=0.1)


def test_a_rough_spot_is_named_with_its_place(tmp_path):
    plant = HANGS.replace("effects: {", "effects: {coulomb: {coulomb: 0.15 N*m}, ")
    logs = [swing(seed, 0.15, spot_nm=0.15) for seed in (1, 2)]
    found = diagnose(opened(tmp_path, RIG, plant), logs, how_far=False)
    assert [one.name for one in found.effects] == ["rough_spot"], found.says
    assert found.fitted["friction.spot_at_ratio"] == pytest.approx(0.35, abs=0.02)
    assert found.fitted["friction.spot_nm"] == pytest.approx(0.15, rel=0.1)


@pytest.mark.slow
def test_a_noisy_encoder_widens_the_intervals_of_what_it_shifts(tmp_path):
    found = diagnose(
        opened(tmp_path, RIG, PLANT),
        [swing(1, noise_rad=5e-5), swing(2, noise_rad=5e-5)],
        how_far=False,
    )
    subject = opened(tmp_path, RIG, PLANT)
    subject.read_again = lambda *_: None
    alone = (
        diagnose(subject, [swing(1, noise_rad=5e-5), swing(2, noise_rad=5e-5)], how_far=False)
        .effects[0]
        .parameters[0]
    )
    weight = found.effects[0].parameters[0]
    assert found.verdict == "explained" and found.effects[0].confidence > 0.9, found.says
    assert weight.low <= WEIGHT_NM <= weight.high, weight
    assert 2.0 * (alone.high - alone.low) < weight.high - weight.low < 0.02 * WEIGHT_NM, (
        alone,
        weight,
    )


def test_an_arm_that_hangs_across_its_zero_has_all_its_weight_in_the_cosine(tmp_path):
    logs = [swing(seed, hangs_rad=-0.5 * np.pi) for seed in (1, 2)]
    found = diagnose(opened(tmp_path, RIG, PLANT), logs, how_far=False)
    assert [one.name for one in found.effects] == ["gravity"], found.says
    assert found.fitted["load.gravity_cosine_nm"] == pytest.approx(WEIGHT_NM, rel=0.02)


@pytest.mark.slow
def test_friction_that_rises_towards_standstill_keeps_its_level_beside_it(tmp_path):
    logs = [swing(seed, 0.1, 0.0, breakaway_nm=0.15) for seed in (1, 2, 3)]
    found = diagnose(opened(tmp_path, RIG, PLANT), logs, how_far=False)
    assert {one.name for one in found.effects} == {"coulomb", "stribeck"}, found.says
    level = next(one for one in found.effects if one.name == "coulomb").parameters[0]
    assert level.value == pytest.approx(0.1, rel=0.1)


def test_a_torque_that_is_logged_a_row_before_it_is_sent_and_then_held_is_no_gap(tmp_path):
    found = diagnose(
        opened(tmp_path, RIG, HANGS), [swing(1, late_rows=1), swing(2, late_rows=1)], how_far=False
    )
    assert found.verdict == "no_gap", found.says
    assert found.refitted["clock.row_ratio"] == pytest.approx(1.5, abs=0.15)


def test_a_drive_that_lags_is_named_behind_a_coarse_encoder(tmp_path):
    """Asked back through the lag, the encoder's noise is five times as loud at the low-pass."""
    logs = [swing(seed, 0.15, 0.0, lag_s=0.02, step_rad=2.0 * np.pi / 2**16) for seed in (1, 2)]
    dry = PLANT + "effects: {coulomb: {coulomb: 0.15 N*m}}\n"
    found = diagnose(opened(tmp_path, RIG, dry), logs, how_far=False)
    assert [one.name for one in found.effects] == ["drive_lag"], found.says
    assert found.fitted["drive.lag_s"] == pytest.approx(0.02, rel=0.1)
    assert found.fitted["shaft.inertia_kg_m2"] == pytest.approx(INERTIA, rel=0.02)


def runs(shaft, fault):
    """Two recordings of an outsider's shaft."""
    logs = []
    for seed in (1, 2):
        random = np.random.default_rng(seed)
        made = recorded(drawn(shaft, fault, random), shaft.speeds, 18.0, random)
        columns = {"place_rad": made["place"], "drive_nm": made["force"]}
        logs.append(one_trial(f"log{seed}", "outsider_shaft", ROW_S, columns))
    return logs


def test_a_coupling_that_gives_is_named_with_the_swing_of_its_load(tmp_path):
    """Walls as soft as a spring, and no gap between them."""
    shaft = replace(MACHINES["shaft"], wall=200.0)
    logs = runs(shaft, Fault(play=1e-9))
    found = diagnose(opened(tmp_path, RIGS["shaft"], PLANTS["shaft"]), logs, how_far=False)
    assert "coupling" in [one.name for one in found.effects], found.says
    lag_s = np.sqrt((1.0 - shaft.motor_share) * shaft.mass / shaft.wall)
    assert found.fitted["drive.coupling_lag_s"] == pytest.approx(lag_s, rel=0.1)


def test_play_between_motor_and_load_is_named_with_its_size(tmp_path):
    """The load flies from wall to wall of the gap, and the motor moves alone meanwhile."""
    shaft, logs = MACHINES["shaft"], runs(MACHINES["shaft"], Fault(play=6e-3))
    found = diagnose(opened(tmp_path, RIGS["shaft"], PLANTS["shaft"]), logs, how_far=False)
    assert sure(found) == ["backlash"], found.says
    assert found.fitted["drive.backlash_rad"] == pytest.approx(6e-3 * shaft.stroke, rel=0.1)
    assert found.fitted["drive.backlash_load_ratio"] == pytest.approx(0.7, abs=0.1)
