"""A place is filtered no more than its noise asks for: at a reversal dry friction and acceleration
jump together, and a smoother motion would put the jumps elsewhere than the force does.
"""

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.likelihood.floor import floors
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.rig.foreign import moved
from epa_rt.gap.rig.foreign.moved import WIDER, cut_off, smoothed
from epa_rt.gap.rig.foreign.signals import Signals, lowpass, slope
from epa_rt.gap.where.localise import localise
from tests.gap.foreign.carriages import Cart, opened

PERIOD_S, COULOMB_N = 1e-3, 19.0
NUMBERS = {"typical_speed": 0.08, "typical_force": 50.0, "carriage.inertia_kg": 95.0}
CART = Cart(
    "cart",
    "force_n",
    PERIOD_S,
    mass_kg=92.0,
    drag_n_s_m=430.0,
    stiffness_n_m=83e3,
    damping_n_s_m=5e3,
    place_noise_m=1e-7,
    force_noise_n=0.05,
)
RIG = """rig: cart
kind: carriage
plant: plant.yaml
rate: 100 Hz
lowpass: 40 Hz
channels: {position: place_m, force: force_n}
settings: {typical_force: 50 N, typical_speed: 0.08 m/s, stroke: 0.2 m, middle: 0.12 m, pitch: 5 mm}
"""
PLANT = (
    "plant: cart\nkind: carriage\ncarriage: {inertia: 95 kg}\nfriction: {viscous: 400"
    " N*s/m}\neffects: {coulomb: {coulomb: 19 N}}\n"
)


def strokes(seed):
    """Fast, from place to place without a rest."""
    turns = [0.02, 0.22, 0.05, 0.12, 0.09, 0.20, 0.16, 0.02] * 2
    parts = []
    for a, b in zip(turns[:-1], turns[1:], strict=True):
        t = (
            np.arange(0.0, 1.9 * abs(b - a) / 0.25, PERIOD_S) / (1.9 * abs(b - a) / 0.25)
            if a != b
            else np.zeros(0)
        )
        parts.append(a + (b - a) * (10 * t**3 - 15 * t**4 + 6 * t**5))
    return CART.driven(
        f"log{seed}", np.concatenate(parts), np.random.default_rng(seed), coulomb_n=COULOMB_N
    )


def signals(noise_m, step_m=1e-9):
    t, random = np.arange(0.0, 10.0, PERIOD_S), np.random.default_rng(3)
    place = (
        np.round(
            (0.05 * np.sin(2.0 * np.pi * 0.5 * t) + noise_m * random.standard_normal(len(t)))
            / step_m
        )
        * step_m
    )
    return Signals(
        "log", 1.0 / PERIOD_S, 40.0, 10, {"position": place}, {"position": np.ones(len(t), bool)}
    )


@pytest.mark.parametrize(("noise_m", "hertz"), [(1e-8, 160.0), (3e-6, 40.0), (1e-4, 40.0)])
def test_the_more_noise_the_narrower_and_never_narrower_than_the_residual(noise_m, hertz):
    of = signals(noise_m)
    assert cut_off(of, NUMBERS)[0] == hertz >= of.lowpass_hz * min(WIDER)
    place_m, _ = smoothed(of, NUMBERS)
    assert np.array_equal(place_m, lowpass(of.columns["position"], of.rate_hz, hertz))


def test_without_a_mass_the_noise_of_the_speed_alone_counts():
    without = {key: value for key, value in NUMBERS.items() if key != moved.MASS}
    assert [cut_off(signals(noise_m), without)[0] for noise_m in (1e-7, 1.5e-6, 1e-4)] == [
        160.0,
        80.0,
        40.0,
    ]


def test_a_coarse_step_counts_as_noise():
    assert cut_off(signals(0.0, step_m=1e-3), NUMBERS)[0] == 40.0


def test_a_log_that_begins_with_a_long_rest_hides_no_step():
    of = signals(0.0, step_m=1e-3)
    place = np.concatenate([np.full(30_000, of.columns["position"][0]), of.columns["position"]])
    resting = Signals(
        "log", of.rate_hz, 40.0, 10, {"position": place}, {"position": np.ones(len(place), bool)}
    )
    assert cut_off(resting, NUMBERS)[0] == 40.0


def test_the_noise_of_the_speed_is_that_of_the_filter_that_is_used():
    of = signals(1e-7)
    clean = signals(0.0)
    read, true = (slope(smoothed(x, NUMBERS)[0], x.rate_hz, True) for x in (of, clean))
    off = np.std(read - true)
    assert cut_off(of, NUMBERS)[1] == pytest.approx(off, rel=0.1)
    assert cut_off(of, NUMBERS)[1] < moved.QUIET * NUMBERS["typical_speed"]


def times_floor(cart, logs):
    """Residual over the noise, of the block that has most, with the plant's numbers fitted."""
    problem = Problem(cart, logs, floors(cart, logs, {}))
    values = settled(problem).values
    return localise(cart, problem.prepared, values, problem.floors)[0].times_floor


def test_fast_strokes_of_a_carriage_without_a_gap_show_none(tmp_path, monkeypatch):
    cart, logs = opened(tmp_path, RIG, PLANT), [strokes(1), strokes(2)]
    found = diagnose(cart, logs, how_far=False)
    assert found.verdict == "no_gap", found.says
    wide = times_floor(cart.evenly(), logs)
    monkeypatch.setattr(moved, "WIDER", (1.0,))
    assert times_floor(cart.evenly(), logs) > 1.5 * wide
