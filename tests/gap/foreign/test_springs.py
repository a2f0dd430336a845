"""A mass on springs, by Newton's law alone: a spring that stiffens or softens with the cube of its
way is named, and weighed in newtons over cubic metres or newton metres over cubic radians; a
linear one is named beside it, and beside a rough spot of the guide.
"""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.kinds import KINDS
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.made import one_trial

PERIOD_S = 4e-3
MASS_KG, DRAG_N_S_M, SPRING_N_M, REST_M = 2.0, 25.0, 500.0, 0.006
HALF_STROKE_M = 0.06
COULOMB_N, SPOT_M, SPOT_HALF_M = 2.0, 0.01, 6e-3
CARRIAGE = """rig: sprung
kind: carriage
plant: plant.yaml
rate: 50 Hz
lowpass: 20 Hz
channels: {position: place, force: drive}
settings: {typical_force: 12 N, typical_speed: 0.3 m/s, stroke: 0.12 m}
"""
BARE = "plant: sprung\nkind: carriage\ncarriage: {inertia: 2 kg}\nfriction: {viscous: 25 N*s/m}\n"
SPRUNG = BARE + "effects: {spring: {spring: 30 N, spring_rest: 0.1}}\n"


def moved(random: np.random.Generator, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place, speed and acceleration of five waves."""
    place, speed, acceleration = np.zeros((3, len(t)))
    for hz, size in zip((0.17, 0.41, 0.9, 1.6, 2.7), (0.03, 0.018, 8e-3, 4e-3, 2e-3), strict=True):
        w = 2.0 * np.pi * hz * random.uniform(0.9, 1.1)
        wave = w * t + random.uniform(0.0, 2.0 * np.pi)
        place += size * np.sin(wave)
        speed += size * w * np.cos(wave)
        acceleration -= size * w**2 * np.sin(wave)
    return place, speed, acceleration


def sprung(seed: int, cubic_n_m3: float, spot_n: float = 0.0) -> Recording:
    """What moves the mass, read with the noise of an encoder and a load cell. A guide with a spot
    has dry friction everywhere, and more of it there.
    """
    random, t = np.random.default_rng(seed), np.arange(0.0, 12.0, PERIOD_S)
    place, speed, acceleration = moved(random, t)
    way = place - REST_M
    force = MASS_KG * acceleration + DRAG_N_S_M * speed + SPRING_N_M * way + cubic_n_m3 * way**3
    if spot_n > 0.0:
        level_n = COULOMB_N + spot_n * np.exp(-(((place - SPOT_M) / SPOT_HALF_M) ** 2))
        force += level_n * np.tanh(speed / 2e-3)
    columns = {
        "place": place + random.normal(0.0, 5e-6, len(t)),
        "drive": force + random.normal(0.0, 0.15, len(t)),
    }
    return one_trial(f"log{seed}", "sprung", PERIOD_S, columns)


def answer(subject, cubic_n_m3: float):
    return diagnose(subject, [sprung(seed, cubic_n_m3) for seed in (1, 2)], how_far=False)


@pytest.mark.parametrize("cubic_n_m3", [4e4, -1.5e4])
def test_a_spring_that_stiffens_or_softens_is_named_with_its_rest(cubic_n_m3, tmp_path):
    found = answer(opened(tmp_path, CARRIAGE, SPRUNG), cubic_n_m3)
    assert found.verdict == "explained", found.says
    (one,) = found.effects
    assert one.name == "cubic_spring" and one.confidence > 0.9, found.says
    cubic, rest = one.parameters
    assert cubic.value == pytest.approx(cubic_n_m3, rel=0.02) and cubic.low < cubic.high
    assert rest.value == pytest.approx(REST_M / HALF_STROKE_M, abs=0.02)


def test_a_spring_as_the_plant_file_has_it_is_no_gap(tmp_path):
    found = answer(opened(tmp_path, CARRIAGE, SPRUNG), 0.0)
    assert found.verdict == "no_gap", found.says


def test_no_wave_stands_in_for_a_spring_that_the_catalogue_lacks(tmp_path):
    subject = opened(tmp_path, CARRIAGE, SPRUNG, frozenset({"cubic_spring"}))
    found = answer(subject, 4e4)
    assert found.verdict == "not_in_catalogue", found.says


def test_a_linear_spring_is_named_beside_a_cubic_one(tmp_path):
    found = answer(opened(tmp_path, CARRIAGE, BARE), 4e4)
    assert {one.name for one in found.effects} == {"spring", "cubic_spring"}, found.says
    assert found.fitted["friction.spring_n"] == pytest.approx(SPRING_N_M * HALF_STROKE_M, rel=0.02)
    assert found.fitted["friction.cubic_n_m3"] == pytest.approx(4e4, rel=0.05)


@pytest.mark.parametrize("known_n", [0.0, 25.0])
def test_a_spring_that_is_wrong_or_missing_is_named_beside_a_rough_spot(known_n, tmp_path):
    """As 25 N in the plant file was made up for by a drive's gain, while a set held one law of the
    place.
    """
    spring = f", spring: {{spring: {known_n} N, spring_rest: 0.1}}" if known_n else ""
    plant = f"{BARE}effects: {{coulomb: {{coulomb: {COULOMB_N} N}}{spring}}}\n"
    logs = [sprung(seed, 0.0, 3.0) for seed in (1, 2)]
    found = diagnose(opened(tmp_path, CARRIAGE, plant), logs, how_far=False)
    assert {one.name for one in found.effects} == {"spring", "rough_spot"}, found.says
    assert found.fitted["friction.spring_n"] == pytest.approx(SPRING_N_M * HALF_STROKE_M, rel=0.02)
    assert found.fitted["friction.spot_n"] == pytest.approx(3.0, rel=0.1)


def test_on_a_shaft_it_is_a_torque_over_a_cubic_radian():
    of_it = [one for one in KINDS["shaft"].parameters if one.effect == "cubic_spring"]
    assert [(one.key, one.unit) for one in of_it] == [
        ("friction.cubic_nm_rad3", "N*m/rad^3"),
        ("friction.cubic_rest_ratio", "1"),
    ]
