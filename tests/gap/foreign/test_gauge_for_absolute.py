"""A chamber's gauge that is said to read absolute: its zero is 1 bar off, and a leak that the plant
file knows is no other leak.
"""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Recording, Span
from tests.gap.foreign.carriages import opened

ATMOSPHERE_PA = 101_325.0
RIG = """rig: tank
kind: chamber
plant: plant.yaml
rate: 5 Hz
lowpass: 2.5 Hz
channels: {pressure: tank_pa}
settings: {supply: 9 bar}
"""
PLANT = "plant: tank\nkind: chamber\nchamber: {stand_leak: 3.0e-3 1/s}\n"


def test_a_gauge_that_is_said_to_read_absolute_is_a_zero_and_no_leak(tmp_path):
    random, t = np.random.default_rng(3), np.arange(0.0, 90.0, 0.1)
    spans, parts = [], []
    for start_pa in (6.5e5, 4.0e5, 5.2e5):
        over = start_pa * np.exp(-3.0e-3 * np.maximum(t - 5.0, 0.0))
        spans.append(
            Span(f"hold{len(parts)}", len(parts) * len(t), (len(parts) + 1) * len(t), True)
        )
        parts.append(over + random.normal(0.0, 50.0, len(t)))
    read = np.concatenate(parts)
    log = Recording(
        "log", "", "tank", "", "", 0.1, np.arange(len(read)), {"tank_pa": read}, tuple(spans)
    )
    found = diagnose(opened(tmp_path, RIG, PLANT), [log], how_far=False)
    assert found.effects[0].name == "sensor_zero", found.says
    assert found.fitted["sensor.zero_pa"] == pytest.approx(-ATMOSPHERE_PA, rel=0.05)
