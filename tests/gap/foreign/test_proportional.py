"""What goes in proportion to speed, acceleration or pressure passes the filter that the force
passes and no other, however wide the noise of a place lets its own filter be.
"""

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.gap.rig.foreign.signals import lowpass, slope, slope_as_read
from tests.gap.foreign.carriages import opened
from tests.gap.foreign.made import one_trial

PERIOD_S, LOWPASS_HZ = 2e-3, 40.0
T_S = np.arange(0.0, 16.0, PERIOD_S)
CARRIAGE = """rig: mass
kind: carriage
plant: plant.yaml
rate: 250 Hz
lowpass: 40 Hz
channels: {position: place_m, force: force_n}
settings: {typical_force: 25 N, typical_speed: 0.3 m/s, stroke: 0.06 m, middle: 0 m}
"""
MASS_KG, DRAG_N_S_M, SPRING_N = 2.0, 10.0, 60.0  # the spring's at half the stroke
SPRUNG = """plant: mass
kind: carriage
carriage: {inertia: 2 kg}
friction: {viscous: 10 N*s/m}
effects: {spring: {spring: 60 N, spring_rest: 0}}
"""
PISTON = """rig: ram
kind: piston
plant: plant.yaml
rate: 250 Hz
lowpass: 40 Hz
channels: {position: place_m, pressure: chamber_pa, force: force_n}
settings: {typical_force: 25 N, typical_speed: 0.3 m/s, stroke: 0.06 m, middle: 0 m}
"""
RAM = "plant: ram\nkind: piston\npiston: {area: 3.0e-4 m^2}\nfriction: {viscous: 10 N*s/m}\n"
FASTEST_HZ, SLOPES = 15.0, 0.002  # sixth order at 15 Hz and 500 rows per second, of a force


def swings(seed, size):
    """A sum of sines and its first two derivatives, (N,) each."""
    random = np.random.default_rng(seed)
    turns_s = 2.0 * np.pi * random.uniform(0.2, FASTEST_HZ, 12)
    phases = np.outer(T_S, turns_s) + random.uniform(0.0, 2.0 * np.pi, 12)
    height = size * random.uniform(0.2, 1.0, 12) / turns_s
    return (
        np.cos(phases) @ height,
        -np.sin(phases) @ (height * turns_s),
        -np.cos(phases) @ (height * turns_s**2),
    )


def left(subject, log, values=None):
    """The residual's deviation from zero, N, in the rows that are judged."""
    found = subject.residual(subject.prepare(log), values or {}, "force")
    return float(np.sqrt(np.nanmean(found**2)))


def deviation(values):
    return float(np.std(values[len(values) // 4 : -len(values) // 4]))


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 999), noise_m=st.floats(0.0, 2e-5), more=st.sampled_from((0.0, 0.3)))
def test_a_mass_on_a_spring_leaves_what_noise_makes_and_no_more(
    tmp_path_factory, seed, noise_m, more
):
    """``more``: that the drive asks for, whichever way it pushes; noise is pushed no way."""
    subject = opened(tmp_path_factory.mktemp("rig"), CARRIAGE, SPRUNG)
    x, v, a = swings(seed, 0.1)
    force_n = MASS_KG * a + DRAG_N_S_M * v + SPRING_N * x / 0.03
    force_n = force_n + more * np.abs(force_n)
    read = noise_m * np.random.default_rng(seed).standard_normal(len(x))
    log = one_trial("log", "mass", PERIOD_S, {"place_m": x + read, "force_n": force_n})
    speed = slope_as_read(read, 1.0 / PERIOD_S)
    asked = MASS_KG * slope_as_read(speed, 1.0 / PERIOD_S) + DRAG_N_S_M * speed
    of_noise = deviation(lowpass(asked, 1.0 / PERIOD_S, LOWPASS_HZ))
    found = left(subject, log, {"drive.asymmetry_ratio": more})
    assert found < 1.1 * of_noise + SLOPES * np.std(force_n)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 999), noise_pa=st.floats(0.0, 1e3))
def test_a_pressure_that_changes_fast_leaves_what_noise_makes_and_no_more(
    tmp_path_factory, seed, noise_pa
):
    subject = opened(tmp_path_factory.mktemp("rig"), PISTON, RAM)
    (x, v, _), (_, over, _) = swings(seed, 0.1), swings(seed + 1, 2e4)
    over_pa = 1e5 + over
    force_n = 3e-4 * over_pa + DRAG_N_S_M * v
    read = noise_pa * np.random.default_rng(seed).standard_normal(len(x))
    columns = {"place_m": x, "chamber_pa": 101_325.0 + over_pa + read, "force_n": force_n}
    log = one_trial("log", "ram", PERIOD_S, columns)
    of_noise = 3e-4 * deviation(lowpass(read, 1.0 / PERIOD_S, LOWPASS_HZ))
    assert left(subject, log) < 1.1 * of_noise + SLOPES * np.std(force_n)


def test_slopes_as_read_are_of_the_order_that_they_say():
    t_s = np.arange(40) * 0.1
    for order, sloped in ((4, partial(slope, filtered=True)), (6, slope_as_read)):
        for power in range(order + 1):
            found = sloped(t_s**power, 10.0)[3:-3]
            assert found == pytest.approx((power * t_s ** max(power - 1, 0))[3:-3], rel=1e-9)
