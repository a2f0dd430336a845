"""A piston on a test machine of somebody else's simulator: friction that rises towards standstill
over its own level, and a gauge that is said to read absolute.
"""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Recording
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.made import one_trial

PERIOD_S, AREA_M2, DRAG_N_S_M, ATMOSPHERE_PA = 0.01, 3.06e-4, 22.0, 101_325.0
RIG = """rig: ram
kind: piston
plant: plant.yaml
rate: 50 Hz
lowpass: 15 Hz
channels: {position: x_m, pressure: p_pa, force: f_n}
settings: {typical_force: 10 N, typical_speed: 0.02 m/s, stroke: 40 mm, middle: 20 mm}
"""
PLANT = "plant: ram\nkind: piston\npiston: {area: 3.0e-4 m^2}\nfriction: {viscous: 20 N*s/m}\n"


def stroked(
    seed: int,
    coulomb_n: float = 0.0,
    rise_n: float = 0.0,
    reads_gauge: bool = False,
    builds_up_m: float = 0.0,
    seal_ratio: float = 0.0,
    mass_kg: float = 0.0,
) -> Recording:
    random, t = np.random.default_rng(seed), np.arange(0.0, 60.0, PERIOD_S)
    x = 0.02 - 0.015 * np.cos(2 * np.pi * 0.11 * t) + 0.003 * np.sin(2 * np.pi * 0.47 * t + seed)
    v = 0.015 * 2 * np.pi * 0.11 * np.sin(2 * np.pi * 0.11 * t) + 0.003 * 2 * np.pi * 0.47 * np.cos(
        2 * np.pi * 0.47 * t + seed
    )
    a = np.gradient(v, PERIOD_S)
    over = 4e5 + 1.5e5 * np.sin(2 * np.pi * 0.05 * t + seed) + 4e4 * np.sin(2 * np.pi * 0.31 * t)
    direction = built_up(x, builds_up_m) if builds_up_m else np.sign(v)
    force = (
        AREA_M2 * over
        + DRAG_N_S_M * v
        + mass_kg * a
        + (coulomb_n + rise_n * np.exp(-((v / 0.005) ** 2)) + seal_ratio * AREA_M2 * over)
        * direction
    )
    read = over + (0.0 if reads_gauge else ATMOSPHERE_PA) + random.normal(0.0, 150.0, len(t))
    columns = {
        "x_m": x + random.normal(0.0, 3e-6, len(t)),
        "p_pa": read,
        "f_n": force + random.normal(0.0, 0.15, len(t)),
    }
    return one_trial(f"log{seed}", "ram", PERIOD_S, columns)


def built_up(x_m: np.ndarray, over_m: float) -> np.ndarray:
    """Share of full friction: a bristle that gives way once it is bent by ``over_m``."""
    share = np.zeros(len(x_m))
    for i, step in enumerate(np.diff(x_m), 1):
        share[i] = np.clip(share[i - 1] + step / over_m, -1.0, 1.0)
    return share


@pytest.fixture
def ram(tmp_path):
    return opened(tmp_path, RIG, PLANT)


@pytest.fixture
def dry(tmp_path):
    """A plant file that has dry friction of 6 N."""
    return opened(tmp_path, RIG, PLANT + "effects: {coulomb: {coulomb: 6 N}}\n")


def test_a_ram_without_a_gap_has_none(ram):
    assert diagnose(ram, [stroked(1), stroked(2)], how_far=False).verdict == "no_gap"


def test_a_rise_towards_standstill_and_the_level_that_it_stands_on_are_both_named(ram):
    found = diagnose(ram, [stroked(1, 4.0, 5.0), stroked(2, 4.0, 5.0)], how_far=False)
    assert {one.name for one in found.effects} == {"coulomb", "stribeck"}, found.says
    assert found.fitted["friction.coulomb_n"] == pytest.approx(4.0, rel=0.05)
    assert found.fitted["friction.stribeck_n"] == pytest.approx(5.0, rel=0.1)


def test_dry_friction_and_a_seal_that_the_gas_presses_are_both_named(ram):
    logs = [stroked(seed, 4.0, seal_ratio=0.1) for seed in (1, 2)]
    found = diagnose(ram, logs, how_far=False)
    assert {one.name for one in found.effects} == {"coulomb", "seal_friction"}, found.says
    assert found.fitted["friction.seal_ratio"] == pytest.approx(0.1, rel=0.05)


def test_a_gauge_that_is_said_to_read_absolute_is_its_zero_or_a_constant_force(ram):
    found = diagnose(
        ram, [stroked(1, reads_gauge=True), stroked(2, reads_gauge=True)], how_far=False
    )
    assert {found.effects[0].name, *found.effects[0].not_separable_from} == {
        "gauge_zero",
        "offset",
    }, found.says


def test_dry_friction_as_the_plant_file_has_it_is_no_gap(dry):
    found = diagnose(dry, [stroked(1, 6.0), stroked(2, 6.0)], how_far=False)
    assert found.verdict == "no_gap" and found.posterior.models[0].probability > 0.7, found.says


def test_dry_friction_that_is_10_percent_more_than_in_the_plant_file_is_named(dry):
    found = diagnose(dry, [stroked(1, 6.6), stroked(2, 6.6)], how_far=False)
    assert [one.name for one in found.effects] == ["coulomb"], found.says
    assert found.fitted["friction.coulomb_n"] == pytest.approx(6.6, rel=0.02)


@pytest.mark.parametrize("builds_up_m", [5e-5, 2e-4])
def test_friction_that_builds_up_over_a_way_is_that_of_the_plant_file(dry, builds_up_m):
    logs = [stroked(seed, 6.0, builds_up_m=builds_up_m) for seed in (1, 2)]
    found = diagnose(dry, logs, how_far=False)
    assert {one.family for one in found.effects} == {"reversal"}, found.says


def test_more_friction_that_builds_up_besides_is_both(dry):
    logs = [stroked(seed, 9.0, builds_up_m=1e-4) for seed in (1, 2)]
    found = diagnose(dry, logs, how_far=False)
    assert {one.family for one in found.effects} == {"friction", "reversal"}, found.says


def test_an_effect_that_the_plant_file_has_is_known_to_half_its_strength(ram, dry):
    assert dry.knobs["friction.coulomb_n"].spread == pytest.approx(0.5 * 6.0)
    assert ram.knobs["friction.coulomb_n"].spread == pytest.approx(0.3 * 10.0)


def test_a_seal_s_friction_that_builds_up_is_not_a_law_with_more_numbers(dry):
    """Pre-sliding alone leaves most and bends what is nominal: beside it a second is looked for."""
    logs = [stroked(seed, 6.0, builds_up_m=1e-4, seal_ratio=0.05) for seed in (1, 2)]
    found = diagnose(dry, logs, how_far=False)
    assert {one.name for one in found.effects} == {"seal_friction", "presliding"}, found.says


def test_a_mass_that_moves_with_the_rod_is_no_late_force(dry):
    logs = [stroked(seed, 6.0, mass_kg=30.0) for seed in (1, 2)]
    found = diagnose(dry, logs, how_far=False)
    assert [one.name for one in found.effects] == ["moving_mass"], found.says
    assert found.fitted["piston.mass_kg"] == pytest.approx(30.0, rel=0.1)
