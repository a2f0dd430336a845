"""A chamber of somebody else's simulator: its valve's seat lets supply air in, it leaks to the
outside, and its walls creep.
"""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Recording
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.made import one_trial

PERIOD_S, ROWS, SUBSTEPS = 0.1, 1450, 10
OUTSIDE_PA, SUPPLY_PA = 101_325.0, 9e5
IN_PER_S, OUT_PER_S, CREEP_RATIO, CREEP_S = 0.01, 0.012, 0.01, 5.0
RIG = """rig: chamber
kind: chamber
plant: plant.yaml
rate: 5 Hz
lowpass: 2.5 Hz
channels: {pressure: p_pa}
settings: {atmosphere: 101.325 kPa, supply: 9 bar}
"""
PLANT = "plant: chamber\nkind: chamber\nchamber: {stand_leak: 2.0e-5 1/s}\n"


def held(filled_pa: float, seed: int) -> Recording:
    random, step_s = np.random.default_rng(seed), PERIOD_S / SUBSTEPS
    p, found = filled_pa, np.zeros(ROWS)
    for row in range(ROWS):
        found[row] = p
        for i in range(SUBSTEPS):
            t = row * PERIOD_S + i * step_s
            gained = IN_PER_S * (SUPPLY_PA - p) - OUT_PER_S * (p - OUTSIDE_PA)
            p += step_s * (gained - CREEP_RATIO * filled_pa / (CREEP_S + t))
    read = np.round((found + random.normal(0.0, 30.0, ROWS)) / 20.0) * 20.0
    return one_trial(f"log{seed}", "chamber", PERIOD_S, {"p_pa": read})


def test_a_leak_by_another_law_with_an_effect_more_is_not_named_for_it(tmp_path):
    """A leak through a fine gap, beside walls that stretch, does what one in proportion does."""
    logs = [held(filled_pa, seed) for seed, filled_pa in ((1, 6e5), (2, 3e5), (3, 4.5e5))]
    found = diagnose(opened(tmp_path, RIG, PLANT), logs, how_far=False)
    assert {one.family for one in found.effects} == {"leak", "leak_in", "relaxation"}, found.says
    assert found.fitted["leak.supply_per_s"] == pytest.approx(IN_PER_S, rel=0.02)
    assert found.fitted["walls.creep_ratio"] == pytest.approx(CREEP_RATIO, rel=0.1)
