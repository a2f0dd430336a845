"""The muscle: static figures, pull only, and no energy from closed cycles."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.models.blocks import braid, laws, muscle
from epa_rt.models.parameters import neutral_params

# contraction (m of thread), turns, force at 15 cm and 600 kPa (N), stiffness at no-load length
# (N/m), P(15 cm)/P0
GEOMETRY = [
    (0.2078, 4.58, 55, 1639, 1.113),
    (0.2078, 3.05, 124, 3688, 1.113),
    (0.2078, 2.29, 221, 6556, 1.113),
    (0.2014, 4.28, 70, 1822, 1.161),
    (0.2014, 2.85, 158, 4099, 1.161),
    (0.2014, 2.14, 282, 7287, 1.161),
    (0.1949, 3.96, 90, 2056, 1.227),
    (0.1949, 2.64, 202, 4627, 1.227),
    (0.1949, 1.98, 360, 8225, 1.227),
]


def params_with(**values):
    params = neutral_params()
    for name, value in values.items():
        params["muscle"][name] = value
    return params


def static(params, gauge_pa, length):
    return muscle.muscle_over_log(params, np.full(2, gauge_pa), np.full(2, length), np.zeros(2))[0]


@pytest.mark.parametrize(("thread", "turns", "force", "stiffness", "ratio"), GEOMETRY)
def test_static_figures_of_a_15_cm_muscle(thread, turns, force, stiffness, ratio):
    params = params_with(braid_length_m=thread, braid_turns_ratio=turns, take_up_m=1e-5)
    p, no_load = params[0]["muscle"][0], thread / math.sqrt(3)
    assert static(params, 600e3, 0.15) == pytest.approx(force, rel=0.02)
    # with a fixed gas mass the pressure has no slope at no-load length, so this is the closed
    # muscle's stiffness too
    slope = (static(params, 600e3, no_load + 1e-4) - static(params, 600e3, no_load)) / 1e-4
    assert slope == pytest.approx(stiffness, rel=0.02)
    assert muscle.shape(p, 0.0, no_load)[0] / muscle.shape(p, 0.0, 0.15)[0] == pytest.approx(
        ratio, rel=0.005
    )


def test_force_is_minus_pressure_times_slope_of_volume():
    p = neutral_params()[0]["muscle"][0]
    for length in np.linspace(0.1201, 0.17, 20):
        volume_slope = (
            muscle.shape(p, 0.0, length + 1e-6)[0] - muscle.shape(p, 0.0, length - 1e-6)[0]
        ) / 2e-6
        assert muscle.shape(p, 0.0, length)[1] == pytest.approx(-volume_slope, rel=1e-5, abs=1e-9)


paths = st.lists(st.floats(0.115, 0.155), min_size=2, max_size=6)
FRICTION = dict(
    slip_ratio=0.09,
    dahl_ratio=0.05,
    stribeck_ratio=0.02,
    creep_stiffness_n_m=300.0,
    creep_time_s=0.5,
    bladder_stiffness_n_m=200.0,
    lock_stiffness_n_m=1e5,
    lock_viscous_n_s_m=50.0,
    run_in_ratio=0.02,
    lugre_ratio=0.05,
    bouc_wen_ratio=0.05,
    preisach_ratio=0.05,
    pressure_viscous_s_m=0.05,
    coulomb_ratio=0.05,
    creep_slow_ratio=0.5,
    bladder_hardening_per_m=50.0,
    lock_hardening_per_m=100.0,
)


def closed_path(corners):
    """Lengths through the corners and back to the first, three laps, at steps of at most 20 um;
    speeds to match.
    """
    corners = [*corners, corners[0]] * 3
    pieces = [
        np.linspace(a, b, max(int(abs(b - a) / 2e-5), 1), endpoint=False)
        for a, b in zip(corners[:-1], corners[1:], strict=True)
    ]
    length = np.concatenate([*pieces, [corners[-1]]])
    return length, np.append(0.0, np.diff(length)) / 1e-3


@settings(max_examples=60, deadline=None)
@given(paths, st.floats(0.0, 850e3), st.booleans())
def test_closed_cycles_give_no_energy(corners, pressure, sealed):
    """At constant pressure, and sealed (pressure follows volume), the work put in over closed laps
    is not negative.
    """
    params = params_with(viscous_n_s_m=1.0, **FRICTION)
    length, speed = closed_path(corners)
    p = params[0]["muscle"][0]
    volume = np.array([muscle.shape(p, 1e-6, x)[0] for x in length])
    gauge = (
        (pressure + 101325) * volume[0] / volume - 101325
        if sealed
        else np.full(len(length), pressure)
    )
    force = muscle.muscle_over_log(params, gauge, length, speed)
    work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(length))
    assert work >= -1e-3 * (1 + np.max(force)) * 0.04


@settings(max_examples=12, deadline=None)
@given(paths, st.floats(1e3, 850e3))
def test_slip_friction_never_yields_energy(corners, pressure):
    """Friction alone: work in minus stored energy never falls, at any moment and not only over
    laps.
    """
    params = params_with(slip_ratio=0.09)
    p, slip = params[0]["muscle"][0], np.zeros(4)
    scale = 0.09 * muscle.friction_scale(p, pressure)
    limits = np.array([p[f"slip{k}_m"] for k in (1, 2, 3, 4)])
    shares = np.array([p[f"slip{k}_ratio"] for k in (1, 2, 3, 4)])
    lost, stored = 0.0, 0.0
    for moved in np.diff(closed_path(corners)[0]):
        before = scale * np.sum(shares * slip / limits)
        braid.slip_settle(p, slip, moved)
        after = scale * np.sum(shares * slip / limits)
        energy = 0.5 * scale * np.sum(shares * slip**2 / limits)
        lost = 0.5 * (before + after) * moved - (energy - stored)
        assert lost >= -1e-12 * scale
        stored = energy


# Each law of friction alone, at strengths and shapes up to the bounds that its energy was thought
# about at.
LAWS_OF_FRICTION = {
    "slip": {"slip_ratio": 0.05},
    "dahl": {"dahl_ratio": 0.05},
    "stribeck": {"stribeck_ratio": 0.05},
    "run_in": {"run_in_ratio": 0.05, "run_in_m": 0.05},
    "lugre": {"lugre_ratio": 0.05, "lugre_extra_ratio": 3.0},
    "bouc_wen": {"bouc_wen_ratio": 0.05},
    "bouc_wen_sharp": {"bouc_wen_ratio": 0.05, "bouc_wen_exponent_ratio": 6.0},
    "bouc_wen_steep": {"bouc_wen_ratio": 0.05, "bouc_wen_unload_ratio": 1.0},
    "preisach": {"preisach_ratio": 0.05},
    "preisach_growing": {"preisach_ratio": 0.03, "preisach_m": 8e-3, "preisach_slope_per_m": 60.0},
    "preisach_falling": {"preisach_ratio": 0.03, "preisach_m": 8e-3, "preisach_slope_per_m": -60.0},
    "viscous": {"pressure_viscous_s_m": 0.05},
    "coulomb": {"coulomb_ratio": 0.05, "coulomb_speed_m_s": 1e-5},
}


@pytest.mark.parametrize("law", LAWS_OF_FRICTION)
@settings(max_examples=25, deadline=None)
@given(corners=st.lists(st.floats(0.135, 0.165), min_size=2, max_size=6))
def test_no_law_of_friction_ever_gives_more_energy_than_it_took(law, corners):
    """From fresh elements the work put into friction stays positive at every moment (constant
    pressure).
    """
    length, speed = closed_path(corners)
    gauge = np.full(len(length), 600e3)
    without = muscle.muscle_over_log(params_with(viscous_n_s_m=0.0), gauge, length, speed)
    friction = (
        muscle.muscle_over_log(
            params_with(viscous_n_s_m=0.0, **LAWS_OF_FRICTION[law]), gauge, length, speed
        )
        - without
    )
    assert np.min(without + friction) > 0.0  # pulls throughout: nothing is cut off
    work = np.cumsum(0.5 * (friction[1:] + friction[:-1]) * np.diff(length))
    assert np.min(work, initial=0.0) >= -1e-6 * np.max(np.abs(friction))


@given(st.floats(0, 1e6), st.floats(0.05, 0.2), st.floats(-1.0, 1.0))
def test_a_muscle_only_pulls(gauge, length, speed):
    for law in (0.0, 1.0, 2.0):
        force = muscle.muscle_over_log(
            params_with(law_code=law, **FRICTION),
            np.full(3, gauge),
            np.full(3, length),
            np.full(3, speed),
        )
        assert np.all(force >= 0) and np.all(np.isfinite(force))
        if length <= 0.2078 / math.sqrt(3):
            assert np.all(force == 0)


def test_the_polynomial_by_hand():
    p = params_with(poly_c3_ratio=0.0)[0]["muscle"][0]
    # P = 0.8, L = 0.5, contraction speed 0.4 in normalised units
    by_hand = 124.0 * (2.42 * 0.5 * 0.8 - 0.22 * 0.4 * 0.8 + 0.19 * 0.4 * 0.64 - 5.4e-4)
    assert laws.polynomial(p, 600e3, 0.015, -0.02) == pytest.approx(by_hand, rel=1e-12)


def test_tang_by_hand():
    p = params_with(
        tang_k0_m2=2e-4,
        tang_k1_m=-3e-3,
        tang_k2_ratio=0.01,
        tang_s0_n=1.0,
        tang_s1_n_m=-20.0,
        tang_s2_n_m2=5.0,
        tang_d1_n_s_m_pa=2e-5,
        tang_d2_n_s2_m2_pa=1e-4,
        tang_n0_m2=1e-5,
        tang_n1_m=1e-4,
        tang_n2_ratio=1e-3,
        tang_phi_pa=1e4,
    )[0]["muscle"][0]
    x, v, pressure = -0.02, 0.03, 3e5
    by_hand = (
        pressure * (0.01 * x * x - 3e-3 * x + 2e-4)
        + 5.0 * x * x
        - 20.0 * x
        + 1.0
        - pressure * (1e-4 * v * v + 2e-5 * v)
        - (pressure - 1e4) * (1e-3 * x * x + 1e-4 * x + 1e-5)
    )
    assert laws.tang(p, pressure, -x, -v) == pytest.approx(by_hand, rel=1e-12)


@given(st.floats(0.0, 1e4), st.floats(0.0, 0.05), st.floats(0.0, 200.0))
def test_a_hardening_spring_is_a_plain_one_at_first_and_only_ever_stiffer(
    stiffness, stretch, hardening
):
    assert muscle.hardened(stretch, 0.0) == stretch
    assert muscle.hardened(stretch, hardening) >= stretch
    assert muscle.hardened(stretch, hardening, 4.0) >= muscle.hardened(stretch, hardening)
    if hardening > 0.0:
        assert muscle.hardened(1.0 / hardening, hardening, 4.0) == pytest.approx(16.0 / hardening)
        assert muscle.hardened(1.0 / hardening, hardening) == pytest.approx(2.0 / hardening)


@given(st.floats(0.0, 500.0), st.floats(1e-7, 1e-4), st.floats(1e-4, 1.0))
def test_a_stiffening_strap_stretches_less_the_more_it_is_pulled_and_never_beyond_its_end(
    force, compliance, stiffening
):
    p = params_with(strap_compliance_m_n=compliance, strap_stiffening_per_n=stiffening)[0][
        "muscle"
    ][0]
    stretch = muscle.strap_stretch(p, force)
    assert 0.0 <= stretch <= min(compliance * force, compliance / stiffening) * (1.0 + 1e-12)
    assert muscle.strap_stretch(p, force + 1.0) > stretch


def test_branches_of_creep_relax_one_after_the_other():
    """Stretched at once and held: what is left over the muscle without creep falls as five
    exponentials, ten times apart.
    """
    params = params_with(
        creep_stiffness_n_m=300.0, creep_time_s=0.5, creep_slow_ratio=0.5, viscous_n_s_m=0.0
    )
    n = 20_000
    length = np.where(np.arange(n) < 10, 0.14, 0.141)
    speed = np.append(0.0, np.diff(length)) / 1e-3
    gauge = np.full(n, 3e5)
    left = muscle.muscle_over_log(params, gauge, length, speed) - muscle.muscle_over_log(
        params_with(viscous_n_s_m=0.0), gauge, length, speed
    )
    t = np.arange(n - 11) * 1e-3
    assert left[11:] == pytest.approx(
        sum(0.3 * 0.5**j * np.exp(-t / (0.5 * 10**j)) for j in range(5)), rel=5e-3, abs=2e-4
    )


@given(st.floats(0.0, 1.0, allow_subnormal=False), st.floats(0.0, 50.0))
def test_friction_at_low_speed_peaks_at_its_speed_whatever_its_tail(tail, s):
    assert braid.fallen(1.0, tail) == pytest.approx(1.0)
    assert 0.0 <= s * braid.fallen(s, tail) <= 1.0 + 1e-12
    assert s * braid.fallen(s, 1.0) >= s * braid.fallen(s, tail) - 1e-12


@given(st.floats(0.0, 1.0, allow_subnormal=False), st.floats(1.0, 1.6), st.floats(1e-4, 200.0))
def test_a_broad_peak_of_friction_is_the_same_peak_over_a_stretched_logarithm_of_speed(
    tail, breadth, s
):
    assert braid.peak(1.0, tail, breadth) == pytest.approx(1.0)
    assert braid.peak(s**breadth, tail, breadth) == pytest.approx(
        braid.peak(s, tail, 1.0), rel=1e-9
    )
    assert braid.peak(-s, tail, breadth) == -braid.peak(s, tail, breadth)
    assert braid.peak(0.0, tail, breadth) == 0.0
