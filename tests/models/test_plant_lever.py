"""The knee's lever: an arm that changes over the angle is a pulley off its axis, and what it pulls
in is its integral.
"""

import math
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.models.blocks.load import KNEE, coordinate

LEVER_M = 0.057
angles = st.floats(-1.2, 1.2)
ratios = st.floats(-0.9, 0.9)


def pulley(slope: float, curve: float):
    return SimpleNamespace(
        kind_code=KNEE, lever_m=LEVER_M, lever_slope_per_rad=slope, lever_curve_per_rad2=curve
    )


@given(angles, ratios, ratios)
def test_the_arm_is_what_the_length_changes_by(angle, slope, curve):
    p, by = pulley(slope, curve), 1e-5
    ahead, behind = (coordinate.py_func(p, angle + off, 0.0)[0] for off in (by, -by))
    _, speed, arm = coordinate.py_func(p, angle, 2.0)
    assert (ahead - behind) / (2.0 * by) == pytest.approx(arm, abs=1e-8)
    assert speed == 2.0 * arm


@given(angles, st.floats(0.0, 0.9), st.floats(-math.pi, math.pi))
def test_it_is_the_distance_of_a_cable_from_the_axis_of_a_pulley_off_its_centre(angle, off, phase):
    """A cable that leaves straight up a round pulley stands as far from the axis as the radius and
    the centre's share across it.
    """
    arm = coordinate.py_func(pulley(off * math.sin(phase), -off * math.cos(phase)), angle, 0.0)[2]
    radius_m = LEVER_M * (1.0 - off * math.cos(phase))  # so that the arm is the lever at angle zero
    assert arm == pytest.approx(radius_m + LEVER_M * off * math.cos(angle - phase), abs=1e-12)


@given(angles)
def test_a_round_pulley_on_its_axis_is_the_lever_and_nothing_else(angle):
    assert coordinate.py_func(pulley(0.0, 0.0), angle, 3.0) == (
        LEVER_M * angle,
        LEVER_M * 3.0,
        LEVER_M,
    )
