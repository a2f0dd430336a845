"""Two effects of one part, which a rig has at once: both are named, and nothing stands in."""

import pytest

from epa_rt.gap.diagnose import diagnose
from tests.gap.house.runs import plant_with, recorded, subject


def test_a_spool_out_of_its_centre_that_winds_up_its_strap_is_both():
    plant = plant_with(
        "bench",
        "spool",
        transmission__eccentricity_ratio=0.02,
        transmission__eccentricity_phase_rad=0.8,
        transmission__wind_up_per_rad=0.012,
    )
    found = diagnose(subject("bench"), [recorded("bench", 1, plant)], how_far=False)
    assert {one.name for one in found.effects} == {"spool_eccentricity", "spool_wind_up"}, (
        found.says
    )
    assert found.fitted["transmission.eccentricity_ratio"] == pytest.approx(0.02, rel=0.05)
    assert found.fitted["transmission.wind_up_per_rad"] == pytest.approx(0.012, rel=0.05)


def test_a_bladder_s_spring_is_weighed_at_its_own_optimum():
    """Where the first fit had left it, it was partly explained: the gas had not followed."""
    plant = plant_with("bench", "bladder", muscle__bladder_stiffness_n_m=400.0)
    found = diagnose(subject("bench"), [recorded("bench", 1, plant)], how_far=False)
    assert [one.name for one in found.effects] == ["bladder_spring"], found.says
    assert found.verdict == "explained", found.says
