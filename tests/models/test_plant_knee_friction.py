"""A knee that sticks: bent evenly, or like bristles that give less the nearer they are to sliding.
Neither gives energy.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.models.blocks import load
from epa_rt.models.parameters import neutral_params

STEP_S = 1e-4


def knee(**values):
    """Parameters of a knee with nothing but friction: with an inertia of 1 torque is
    acceleration.
    """
    params = neutral_params()
    given = {
        "kind_code": load.KNEE,
        "inertia_kg_m2": 1.0,
        "mass_kg": 1e-9,
        "viscous_nm_s_rad": 0.0,
        "low_rad": -3.0,
        "high_rad": 3.0,
        **values,
    }
    for name, value in given.items():
        params["load"][name] = value
    return params["load"][0]


def moved(p, speed):
    """(friction, deflection), both (N,), along a motion (rad/s), by midpoint steps."""
    stuck, friction, deflection = 0.0, np.empty(len(speed)), np.empty(len(speed))
    for k, rate in enumerate(speed):
        _, first = load.rates(p, 0.0, rate, stuck, 0.0)
        acceleration, middle = load.rates(p, 0.0, rate, stuck + 0.5 * STEP_S * first, 0.0)
        friction[k], deflection[k] = -acceleration, stuck + 0.5 * STEP_S * first
        stuck += STEP_S * middle
    return friction, deflection


@settings(max_examples=40, deadline=None)
@given(
    st.floats(0.0, 1.0),
    st.floats(0.05, 0.4),
    st.floats(10.0, 200.0),
    st.floats(0.0, 0.2),
    st.integers(0, 2**32 - 1),
)
def test_it_takes_more_than_it_keeps_along_any_motion(bend, limit_nm, stiffness, built_rad_s, seed):
    p = knee(
        knee_bend_ratio=bend,
        knee_coulomb_nm=limit_nm,
        knee_stiffness_nm_rad=stiffness,
        knee_friction_speed_rad_s=built_rad_s,
    )
    speed = np.repeat(np.random.default_rng(seed).normal(0.0, 0.5, 40), 40)
    friction, deflection = moved(p, speed)
    taken, kept = np.cumsum(friction * speed) * STEP_S, 0.5 * stiffness * deflection**2
    assert np.min(taken - kept) > -1e-3 * (np.max(np.abs(taken)) + np.max(kept))
    assert np.max(np.abs(friction)) <= limit_nm + 1e-8  # what is left of its weight


def test_bristles_come_near_sliding_with_the_place_as_dahl_has_it():
    limit_nm, stiffness, speed = 0.1, 50.0, np.full(400, 0.1)  # 4 mrad, twice the bristles' length
    friction, deflection = moved(
        knee(knee_bend_ratio=1.0, knee_coulomb_nm=limit_nm, knee_stiffness_nm_rad=stiffness), speed
    )
    place = (np.arange(400) + 0.5) * 0.1 * STEP_S
    assert stiffness * deflection == pytest.approx(
        limit_nm * (1.0 - np.exp(-stiffness * place / limit_nm)), rel=1e-3, abs=1e-6
    )
    assert friction[-1] < limit_nm


def test_without_a_bend_it_sticks_with_its_whole_speed():
    p = knee(knee_coulomb_nm=0.1, knee_stiffness_nm_rad=50.0)
    assert [load.sticking_rate(p, 1e-3, rate) for rate in (0.3, -0.3, 0.0)] == [0.3, -0.3, 0.0]
