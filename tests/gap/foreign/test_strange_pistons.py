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
    seed: int, coulomb_n: float = 0.0, rise_n: float = 0.0, reads_gauge: bool = False
) -> Recording:
    random, t = np.random.default_rng(seed), np.arange(0.0, 60.0, PERIOD_S)
    x = 0.02 - 0.015 * np.cos(2 * np.pi * 0.11 * t) + 0.003 * np.sin(2 * np.pi * 0.47 * t + seed)
    v = 0.015 * 2 * np.pi * 0.11 * np.sin(2 * np.pi * 0.11 * t) + 0.003 * 2 * np.pi * 0.47 * np.cos(
        2 * np.pi * 0.47 * t + seed
    )
    over = 4e5 + 1.5e5 * np.sin(2 * np.pi * 0.05 * t + seed) + 4e4 * np.sin(2 * np.pi * 0.31 * t)
    force = (
        AREA_M2 * over
        + DRAG_N_S_M * v
        + (coulomb_n + rise_n * np.exp(-((v / 0.005) ** 2))) * np.sign(v)
    )
    read = over + (0.0 if reads_gauge else ATMOSPHERE_PA) + random.normal(0.0, 150.0, len(t))
    columns = {
        "x_m": x + random.normal(0.0, 3e-6, len(t)),
        "p_pa": read,
        "f_n": force + random.normal(0.0, 0.15, len(t)),
    }
    return one_trial(f"log{seed}", "ram", PERIOD_S, columns)


@pytest.fixture
def ram(tmp_path):
    return opened(tmp_path, RIG, PLANT)


def test_a_ram_without_a_gap_has_none(ram):
    assert diagnose(ram, [stroked(1), stroked(2)], how_far=False).verdict == "no_gap"


def test_a_rise_towards_standstill_and_the_level_that_it_stands_on_are_both_named(ram):
    found = diagnose(ram, [stroked(1, 4.0, 5.0), stroked(2, 4.0, 5.0)], how_far=False)
    assert {one.name for one in found.effects} == {"coulomb", "stribeck"}, found.says
    assert found.fitted["friction.coulomb_n"] == pytest.approx(4.0, rel=0.05)
    assert found.fitted["friction.stribeck_n"] == pytest.approx(5.0, rel=0.1)


def test_a_gauge_that_is_said_to_read_absolute_is_its_zero_or_a_constant_force(ram):
    found = diagnose(
        ram, [stroked(1, reads_gauge=True), stroked(2, reads_gauge=True)], how_far=False
    )
    assert {found.effects[0].name, *found.effects[0].not_separable_from} == {
        "gauge_zero",
        "offset",
    }, found.says
