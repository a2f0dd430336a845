"""What stands far above its floor is never called nothing, and trials set aside are held against
the blocks, too.
"""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.recording import Span
from epa_rt.gap.rig.foreign.chamber import filled
from tests.gap.foreign.carriages import Cart, opened
from tests.gap.foreign.made import one_trial

PERIOD_S = 0.1
TANK = (
    "rig: tank\nkind: chamber\nplant: plant.yaml\nrate: 5 Hz\nlowpass: 2.5 Hz\nchannels: {pressure:"
    " tank_pa}\nsettings: {supply: 9 bar}\n"
)
PLANT = "plant: tank\nkind: chamber\nchamber: {stand_leak: 2.2e-5 1/s}\n"
CART = """rig: cart
kind: carriage
plant: plant.yaml
rate: 100 Hz
lowpass: 40 Hz
channels: {position: place_m, force: force_n}
settings: {typical_force: 40 N, typical_speed: 0.15 m/s, stroke: 0.25 m, middle: 0.15 m, pitch: 20 mm}
"""  # noqa: E501


def tank(pressure_pa: np.ndarray, seed: int):
    return one_trial(
        f"tank{seed}",
        "tank",
        PERIOD_S,
        {"tank_pa": pressure_pa + np.random.default_rng(seed).normal(0.0, 100.0, len(pressure_pa))},
    )


def held(leak_per_s: float, seconds: float = 90.0) -> np.ndarray:
    return 101_325.0 + 5e5 * np.exp(-leak_per_s * np.arange(0.0, seconds, PERIOD_S))


def test_a_chamber_that_is_filled_again_within_its_hold_is_not_called_without_a_gap(tmp_path):
    """From six bar to seven and a half, half a minute on: no law of a sealed chamber rises so, and
    so small a step is no fill that a hold begins with.
    """
    again = np.concatenate([held(1e-3, 30.0), held(1e-3) + 1.5e5])
    found = diagnose(opened(tmp_path, TANK, PLANT), [tank(again, 1)], how_far=False)
    assert (
        found.verdict in ("not_in_catalogue", "partly_explained")
        and found.location[0].times_floor > 100.0
    )


FILLS = [(0.0, 0.1), (3.0, 8.0), (30.0, 2.0)]  # each wait and each length of a fill once
MORE = [(b, f) for b in (0.0, 3.0, 30.0) for f in (0.1, 2.0, 8.0) if (b, f) not in FILLS]


@pytest.mark.parametrize(
    ("before_s", "fill_s"), (*FILLS, *(pytest.param(*one, marks=pytest.mark.slow) for one in MORE))
)
@pytest.mark.parametrize(("leak_per_s", "verdict"), [(2.2e-5, "no_gap"), (1e-3, "explained")])
def test_a_chamber_may_be_filled_within_its_log(tmp_path, before_s, fill_s, leak_per_s, verdict):
    """The hold begins behind the fill, wherever that is: a hold that began within it was a gap of a
    rig without one, and took 8 per cent off a leak.
    """
    hold = held(leak_per_s)
    fill = 101_325.0 + (hold[0] - 101_325.0) * np.arange(0.0, 1.0, PERIOD_S / fill_s)
    whole = np.concatenate([np.full(round(before_s / PERIOD_S), 101_325.0), fill, hold])
    found = diagnose(opened(tmp_path, TANK, PLANT), [tank(whole, 1), tank(whole, 2)], how_far=False)
    assert found.verdict.removeprefix("partly_") == verdict, found.says
    assert not found.effects or found.effects[0].confidence > 0.6
    for effect in found.effects:
        (number,) = effect.parameters
        assert effect.name == "leak_linear" and abs(number.value / leak_per_s - 1.0) < 0.04


def test_a_chamber_into_which_air_leaks_was_not_filled():
    pressure = 8e5 - 5e5 * np.exp(-0.01 * np.arange(0.0, 120.0, PERIOD_S))
    assert filled(pressure, 1.0 / PERIOD_S) == 0
    assert filled(np.full(900, 6e5), 1.0 / PERIOD_S) == filled(np.zeros(0), 10.0) == 0


def test_trials_set_aside_are_judged_block_by_block(tmp_path):
    """Two holds of one log: the second, which no fit has seen, opens wider."""
    one = tank(np.concatenate([held(1e-3), held(4e-3)]), 2)
    half = one.samples // 2
    two = replace(
        one, spans=(Span("first", 0, half, True), Span("second", half, one.samples, True))
    )
    found = diagnose(opened(tmp_path, TANK, PLANT), [two])
    rows = [
        row
        for row in found.shrinkage
        if row.mode == "teacher_forced" and row.baseline == "refitted" and row.channel == "tank_pa"
    ]
    assert len(rows) == 1 and rows[0].after > 5.0 * rows[0].floor
    assert found.verdict != "explained"
    assert not found.effects or "something besides" in found.says


def test_dry_friction_that_a_simulator_rounds_off_is_named_as_that(tmp_path):
    cart = Cart(
        "cart",
        "force_n",
        1e-3,
        mass_kg=42.0,
        drag_n_s_m=160.0,
        stiffness_n_m=60_000.0,
        damping_n_s_m=2500.0,
        place_noise_m=1e-6,
        force_noise_n=0.1,
    )
    t = np.arange(0.0, 14.0, 1e-3)
    wanted = [
        0.15 + a * np.sin(2 * np.pi * 0.3 * t) + b * np.sin(2 * np.pi * 0.8 * t)
        for a, b in ((0.08, 0.02), (0.05, 0.03))
    ]
    logs = []
    for k, one in enumerate(wanted):
        made = cart.driven(f"log{k}", one, np.random.default_rng(k))
        speed = np.gradient(one, 1e-3)
        logs.append(
            replace(
                made,
                columns={
                    **made.columns,
                    "force_n": made.columns["force_n"] + 20.0 * np.tanh(speed / 3e-3),
                },
            )
        )
    plant = (
        "plant: cart\nkind: carriage\ncarriage: {inertia: 41 kg}\nfriction: {viscous: 165"
        " N*s/m}\neffects:\n  coulomb: {coulomb: 20 N}\n"
    )
    found = diagnose(opened(tmp_path, CART, plant), logs, how_far=False)
    assert found.effects[0].name == "coulomb_rounding", found.says
    assert (
        2e-3 < found.fitted["friction.rounding_speed_m_s"] < 4e-3
    )  # it was rounded off at the commanded speed, not at the true one
