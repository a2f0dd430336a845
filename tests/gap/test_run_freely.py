"""Where the gap shows in free run: readings of two logs of the loop, from the plant that made them
and from another one.
"""

import numpy as np
import pytest

from epa_rt.gap.subject import Plain
from epa_rt.gap.where.localise import regions
from epa_rt.gap.where.run_freely import BLOCK, localise_freely
from tests.gap.house.runs import plant_with, recorded, subject


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_the_plant_that_made_a_log_is_at_its_floor(rig):
    places = localise_freely(subject(rig), [recorded(rig, 1)], {})
    assert {"motor_current_a", "muscle_force_n" if rig == "bench" else "knee_angle_rad"} <= {
        place.link for place in places
    }
    assert max(place.times_floor for place in places) < 1.15
    assert {place.block for place in places} == {BLOCK}


def test_a_gap_is_placed_in_reading_state_band_and_time():
    log = recorded("bench", 1, plant_with("bench", "dragged", muscle__viscous_n_s_m=30.0))
    first = next(
        place
        for place in localise_freely(subject("bench"), [log], {})
        if place.link == "muscle_force_n"
    )
    assert first.unit == "N" and first.significance > 4.0
    assert first.times_floor == pytest.approx(first.rms / first.floor)
    assert first.excess == pytest.approx(np.sqrt(first.rms**2 - first.floor**2))
    assert first.state["speed_m_s near 0"] < 0.5 * max(
        first.state["speed_m_s > 0"], first.state["speed_m_s < 0"]
    )  # drag asks for speed
    assert first.band_hz and first.time_s and all(np.isfinite(list(first.band_hz.values())))


def test_a_rig_without_a_model_of_the_whole_has_none():
    class Blocks(Plain):
        without_stop = True

        def free_run(self, recording, values, seed):
            return None

    assert localise_freely(Blocks(), [recorded("bench", 1)], {}) == ()


def test_motions_are_told_by_their_amplitude():
    t = np.arange(0.0, 40.0, 0.01)
    size = np.where(t < 20.0, 1e-3, 8e-3)
    found = regions({"length_m": 0.2 + size * np.sin(2.0 * np.pi * t)}, 100.0)
    assert (
        found["amplitude of length_m low"][:1800].mean() > 0.6
        and not found["amplitude of length_m low"][2200:].any()
    )
    assert (
        found["amplitude of length_m high"][2200:].mean() > 0.4
        and not found["amplitude of length_m high"][:1800].any()
    )


def test_a_motion_that_is_always_as_large_has_no_amplitudes():
    t = np.arange(0.0, 40.0, 0.01)
    assert not [
        name
        for name in regions({"length_m": np.sin(2.0 * np.pi * t)}, 100.0)
        if name.startswith("amplitude")
    ]
