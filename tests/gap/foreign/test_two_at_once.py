"""A guide by Newton's law alone that lacks two effects at once, of the same part and of different
physics: both are named, and no third stands in for one of them.
"""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Recording
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.made import one_trial

PERIOD_S, MASS_KG, DRAG_N_S_M, LEVEL_N, MIDDLE_M = 4e-3, 20.0, 90.0, 20.0, 0.2
HALF_STROKE_M, PITCH_M = 0.15, 0.02
ROUNDED_M_S, SHARP_M_S = 1e-3, 2e-4  # the latter a thousandth of the typical speed
RIG = """rig: guide
kind: carriage
plant: plant.yaml
rate: 50 Hz
lowpass: 20 Hz
channels: {position: place, force: drive}
settings: {typical_force: 60 N, typical_speed: 0.2 m/s, stroke: 0.3 m, middle: 0.2 m, pitch: 20 mm}
"""
BARE = "plant: guide\nkind: carriage\ncarriage: {inertia: 20.3 kg}\nfriction: {viscous: 95 N*s/m}\n"
DRY = BARE + f"effects: {{coulomb: {{coulomb: {LEVEL_N} N}}}}\n"


def guided(seed: int, level_n: float, rounded: bool = True, **strengths: float) -> Recording:
    """What moves it, read with the noise of an encoder and of a drive. ``rounded``: whether dry
    friction turns over within ROUNDED_M_S, and not as sharply as the catalogue has it.
    """
    random, t = np.random.default_rng(seed), np.arange(0.0, 24.0, PERIOD_S)
    x, v, a = np.full_like(t, MIDDLE_M), np.zeros_like(t), np.zeros_like(t)
    for hz, size in zip((0.23, 0.61, 1.7, 3.1), (0.07, 0.03, 0.012, 4e-3), strict=True):
        w = 2.0 * np.pi * hz * random.uniform(0.9, 1.1)
        angle = w * t + random.uniform(0.0, 2.0 * np.pi)
        x += size * np.sin(angle)
        v += size * w * np.cos(angle)
        a -= size * w**2 * np.sin(angle)
    way, turn = (x - MIDDLE_M) / HALF_STROKE_M, 2.0 * np.pi * (x - MIDDLE_M) / PITCH_M
    sign = np.tanh(v / ROUNDED_M_S) if rounded else v / np.hypot(v, SHARP_M_S)
    shapes = {
        "load_friction": np.abs(MASS_KG * a) * sign,
        "friction_over_turn": np.sin(turn + 0.7) * sign,
        "rough_spot": np.exp(-(((way - 0.25) / 0.12) ** 2)) * sign,
        "friction_over_place": way * sign,
        "viscous_quadratic": v * np.abs(v),
        "warming": v * (1.0 - np.exp(-t / 20.0)),
    }
    force = MASS_KG * a + DRAG_N_S_M * v + level_n * sign
    force += sum(strength * shapes[name] for name, strength in strengths.items())
    columns = {
        "place": x + random.normal(0.0, 1e-6, len(t)),
        "drive": force + random.normal(0.0, 0.15, len(t)),
    }
    return one_trial(f"log{seed}", "guide", PERIOD_S, columns)


@pytest.mark.parametrize(
    "strengths",
    [
        {"friction_over_turn": 5.0, "rough_spot": 8.0},
        {"friction_over_place": 6.0, "rough_spot": 8.0},
        {"viscous_quadratic": 80.0, "warming": -30.0},
    ],
    ids="+".join,
)
def test_two_that_act_on_the_same_part_are_both_named(strengths, tmp_path):
    logs = [guided(seed, LEVEL_N, **strengths) for seed in (1, 2)]
    found = diagnose(opened(tmp_path, RIG, DRY), logs, how_far=False)
    assert {one.name for one in found.effects} == set(strengths), found.says
    assert min(one.confidence for one in found.effects) > 0.9, found.says


@pytest.mark.parametrize("rounded", [False, True], ids=["sharp", "rounded"])
def test_dry_friction_and_friction_by_load_are_both_named(rounded, tmp_path):
    logs = [guided(seed, LEVEL_N, rounded, load_friction=0.1) for seed in (1, 2)]
    found = diagnose(opened(tmp_path, RIG, BARE), logs, how_far=False)
    missing = {"coulomb", "load_friction"} | ({"coulomb_rounding"} if rounded else set())
    assert {one.name for one in found.effects} == missing, found.says
    assert found.fitted["friction.coulomb_n"] == pytest.approx(LEVEL_N, rel=0.02)
    assert found.fitted["friction.load_ratio"] == pytest.approx(0.1, rel=0.05)
    speed_m_s = ROUNDED_M_S - SHARP_M_S if rounded else 0.0
    assert found.fitted.get("friction.rounding_speed_m_s", 0.0) == pytest.approx(speed_m_s, rel=0.2)


def test_friction_by_load_is_named_alone_where_the_plant_file_has_the_dry_one(tmp_path):
    logs = [guided(seed, LEVEL_N, load_friction=0.1) for seed in (1, 2)]
    found = diagnose(opened(tmp_path, RIG, DRY), logs, how_far=False)
    assert [one.name for one in found.effects] == ["load_friction"], found.says
