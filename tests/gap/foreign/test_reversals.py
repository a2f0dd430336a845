"""When a sliding part turns round, and what it does between two rows, is known so well and no
better: rows there count for less, and what is fitted does not hang on them.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.likelihood.floor import floors, weight
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.rig.foreign.law import motion
from epa_rt.gap.rig.foreign.noisy_place import LOUD, narrowed
from epa_rt.gap.rig.foreign.reversals import Turning, row_variance
from epa_rt.gap.rig.foreign.signals import Signals, slope
from tests.gap.foreign.carriages import STRANGER, opened

RATE_HZ, LOWPASS_HZ, STRIDE = 1000.0, 40.0, 10
DRY_N = 24.0
CART = replace(STRANGER, rig="cart", force_column="force_n")
RIG = """rig: cart
kind: carriage
plant: plant.yaml
rate: 100 Hz
lowpass: 40 Hz
channels: {position: place_m, force: force_n}
settings: {typical_force: 60 N, typical_speed: 0.15 m/s, stroke: 0.25 m, middle: 0.15 m, pitch: 20 mm}
"""  # noqa: E501
PLANT = (
    "plant: cart\nkind: carriage\ncarriage: {inertia: 41 kg}\nfriction: {viscous: 165 N*s/m}\n"
    "effects: {coulomb: {coulomb: 24 N}}\n"
)
T_S = np.arange(0.0, 12.0, 1.0 / RATE_HZ)
PLACE_M = 0.1 * np.sin(2.0 * np.pi * 0.4 * T_S)


def of(place_m, dry_n, left, hertz=LOWPASS_HZ, slow_m_s=1e-4, size_n=0.3, unsure_n=0.0):
    """(n,) by which rows count beside noise of that size."""
    signals = Signals(
        "log", RATE_HZ, LOWPASS_HZ, STRIDE, {"position": place_m}, {"position": np.ones_like(T_S)}
    )
    moved = motion(place_m, place_m, RATE_HZ, 0.15, 0.0, 0.25, False)
    slow = np.abs(moved.speed_m_s) < slow_m_s
    dry, unsure = np.full(len(T_S), dry_n), unsure_n * np.ones_like(T_S)
    turning = Turning(moved, dry, unsure, hertz, slow, 0.0, 60.0)
    return size_n / np.hypot(size_n, np.sqrt(row_variance(signals, turning, 10.0 * place_m, left)))


def noise(size_n=0.3, seed=0):
    return size_n * np.random.default_rng(seed).standard_normal(len(T_S) // STRIDE)


def turns():
    """(n,) bool: within 75 ms of a reversal of PLACE_M."""
    return np.abs(np.cos(2.0 * np.pi * 0.4 * T_S[::STRIDE])) < np.sin(2.0 * np.pi * 0.4 * 0.075)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.0, 50.0), st.floats(0.1, 10.0))
def test_rows_count_for_less_at_reversals_alone_and_for_nothing_less_elsewhere(dry_n, size_n):
    found = of(PLACE_M, dry_n, noise(size_n), size_n=size_n)
    assert np.all((found > 0.0) & (found <= 1.0))
    assert found[~turns()].min() > 0.9


@settings(max_examples=25, deadline=None)
@given(st.floats(1.0, 100.0), st.floats(1.1, 5.0))
def test_the_more_dry_friction_and_the_slower_the_filter_the_less_they_count(dry_n, more):
    left = noise()
    found = of(PLACE_M, dry_n, left)[turns()]
    assert np.all(of(PLACE_M, more * dry_n, left)[turns()] <= found + 1e-6)
    assert np.all(of(PLACE_M, dry_n, left, hertz=more * LOWPASS_HZ)[turns()] >= found - 1e-6)


def test_without_dry_friction_or_a_reversal_all_rows_count_alike():
    assert of(PLACE_M, 0.0, noise()).min() > 0.95
    assert of(0.1 * T_S, 24.0, noise()).min() > 0.99


def test_a_slow_motion_that_is_read_in_steps_turns_round_nowhere():
    steps_m = np.round(0.002 * T_S, 4)  # 50 rows in each
    found = [of(steps_m, 24.0, noise(), h, slow_m_s=0.0) for h in (LOWPASS_HZ, 4.0 * LOWPASS_HZ)]
    assert np.array_equal(*found)  # a moment hangs on the filter, how a sign is rounded does not


def test_a_rest_says_nothing_and_its_ends_count_as_reversals_do():
    """Friction takes any force there, and the low-pass carries it over the ends."""
    resting = (T_S > 4.0) & (T_S < 8.0)
    found = of(np.cumsum(np.where(resting, 0.0, 0.1)) / RATE_HZ, DRY_N, noise())
    at_s = T_S[::STRIDE]
    near = np.minimum(np.abs(at_s - 4.0), np.abs(at_s - 8.0))
    assert found[near < 0.02].max() < 0.5 and found[resting[::STRIDE]].max() < 0.05
    assert found[(near > 0.15) & ~resting[::STRIDE]].min() > 0.9


def test_what_slopes_between_rows_leave_open_is_noise_of_its_own():
    found = of(0.1 * T_S, DRY_N, noise(), unsure_n=0.3)
    assert found[50:-50] == pytest.approx(1.0 / np.sqrt(2.0), abs=0.01)


@pytest.mark.parametrize("power", range(5))
def test_a_slope_is_exact_to_the_fourth_order(power):
    t_s = np.linspace(-1.0, 1.0, 41)
    assert slope(t_s**power, 20.0, True)[2:-2] == pytest.approx(
        (power * t_s ** max(power - 1, 0))[2:-2], abs=1e-9
    )


def test_friction_that_only_the_log_has_counts_as_that_of_the_plant_file():
    sign = motion(PLACE_M, PLACE_M, RATE_HZ, 0.15, 0.0, 0.25, False).sign[::STRIDE]
    known, unknown = of(PLACE_M, DRY_N, noise()), of(PLACE_M, 0.0, noise() + DRY_N * sign)
    assert unknown == pytest.approx(known, abs=0.05)


@pytest.fixture(scope="module")
def cart(tmp_path_factory):
    """Healthy, turning at the same two places again and again in one of its logs."""
    subject = opened(tmp_path_factory.mktemp("cart"), RIG, PLANT)
    waves = 0.15 + 0.08 * np.sin(2 * np.pi * 0.3 * T_S) + 0.03 * np.sin(2 * np.pi * 0.9 * T_S + 1)
    smooth = np.ones(150) / 150.0
    strokes = 0.15 + 0.18 / np.pi * np.arcsin(np.sin(2 * np.pi * 0.35 * T_S))
    strokes = np.convolve(np.convolve(np.pad(strokes, 150, "edge"), smooth, "same"), smooth, "same")
    wanted = {"waves": waves, "strokes": strokes[150:-150]}
    logs = [
        CART.driven(name, place, np.random.default_rng(seed), coulomb_n=DRY_N)
        for seed, (name, place) in enumerate(wanted.items(), 3)
    ]
    return subject, logs


def test_a_fit_does_not_hang_on_reversals(cart):
    """The force is held from row to row: half a row late. With all rows alike the clocks went to
    their bound, to put the reversals right.
    """
    subject, logs = cart
    values = settled(Problem(subject, logs, floors(subject, logs, {}))).values
    assert values["clock.row_ratio"] == pytest.approx(0.5, abs=0.25)
    assert values["carriage.inertia_kg"] == pytest.approx(CART.mass_kg, rel=2e-3)
    even = settled(Problem(subject.evenly(), logs, floors(subject.evenly(), logs, {}))).values
    assert even["clock.row_ratio"] > 1.2


def test_reversals_at_the_same_places_are_no_force_that_returns_there(cart):
    subject, logs = cart
    found = diagnose(subject, logs, how_far=False)
    assert found.verdict == "no_gap", found.says


def test_a_motion_read_again_counts_as_the_recording_does(cart):
    subject, logs = cart
    again = subject.read_again(logs[0], {}, None)
    floor = floors(subject, logs, {})["force"]
    own, twin, alone = (
        weight(subject, subject.prepare(one), floor)
        for one in (logs[0], again, replace(again, twin_of=None))
    )
    assert np.array_equal(own, twin)
    assert not np.allclose(own, alone, atol=0.01)  # it has less noise, and is filtered less


def test_a_place_too_coarse_for_the_low_pass_has_a_narrower_one_and_that_is_said(cart):
    subject, logs = cart
    coarse = replace(CART, place_step_m=1e-4)
    log = coarse.driven("log", PLACE_M, np.random.default_rng(0), coulomb_n=DRY_N)
    assert narrowed(subject, logs) == (subject, [])
    lower, (finding,) = narrowed(subject, [*logs, log])
    assert finding.log == "log" and "expected 3 N at most" in finding.says
    assert f"the low-pass is taken at {lower.lowpass_hz:.2g} Hz" in finding.says
    assert lower.lowpass_hz < subject.lowpass_hz
    turning = lower.turning(lower.prepare(log))
    assert turning.mass_noise == pytest.approx(LOUD * turning.typical, rel=0.1)
    assert [link.channel for link in lower.links] == [link.channel for link in subject.links]


def test_where_no_row_would_be_judged_the_low_pass_stays(cart):
    subject, _ = cart
    coarse = replace(CART, place_step_m=1e-2)
    log = coarse.driven("log", PLACE_M[:2000], np.random.default_rng(0), coulomb_n=DRY_N)
    same, (finding,) = narrowed(subject, [log])
    assert same is subject and "would leave no row to judge" in finding.says


def test_a_healthy_rig_without_any_noise_has_no_gap(cart):
    """Nothing is left but what rows do not tell; against the noise of it alone it was a gap."""
    exact = replace(CART, place_noise_m=0.0, force_noise_n=0.0, place_step_m=0.0)
    random = np.random.default_rng(0)
    logs = [
        exact.driven(name, 0.15 + 0.06 * wave(2 * np.pi * T_S), random, coulomb_n=DRY_N)
        for name, wave in (
            ("slow", lambda t: np.sin(0.3 * t)),
            ("quick", lambda t: np.sin(1.1 * t)),
        )
    ]
    found = diagnose(cart[0], logs, how_far=False)
    assert found.verdict == "no_gap", found.says
