"""A carriage that moves from place to place and stands between: what its drive gives there says
nothing of the plant. And a hand on it is a gap that nothing foresees.
"""

import re
from dataclasses import replace

import numpy as np
import pytest

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.fits import check_judged
from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.finding import stretches
from epa_rt.gap.likelihood.floor import white
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.rests import at_rest, check_rests
from epa_rt.gap.where.localise import localise
from tests.gap.foreign.carriages import Cart, opened
from tests.gap.foreign.made import one_trial

PERIOD_S = 2e-3
CART = Cart(
    "cart",
    "force_n",
    PERIOD_S,
    mass_kg=12.0,
    drag_n_s_m=30.0,
    stiffness_n_m=9000.0,
    damping_n_s_m=500.0,
    place_noise_m=5e-7,
    force_noise_n=0.6,
)
RIG = """rig: cart
kind: carriage
plant: plant.yaml
rate: 100 Hz
lowpass: 40 Hz
channels: {position: place_m, force: force_n}
settings: {typical_force: 15 N, typical_speed: 0.15 m/s, stroke: 0.4 m, pitch: 20 mm}
"""
PLANT = (
    "plant: cart\nkind: carriage\ncarriage: {inertia: 11.7 kg}\nfriction: {viscous: 33"
    " N*s/m}\neffects: {coulomb: {coulomb: 3 N}}\n"
)


def run(seed: int, strokes: bool = True, coulomb_n: float = 3.0, hand_n: float = 0.0) -> Recording:
    """From place to place, or without a rest; a ``hand_n`` leans on it now and then."""
    random, t = np.random.default_rng(seed), np.arange(0.0, 20.0, PERIOD_S)
    turns = random.uniform(-0.15, 0.15, 14)
    told = (
        np.repeat(turns, 750)[: len(t)]
        if strokes
        else 0.12 * np.sin(2 * np.pi * 0.4 * t) + 0.04 * np.sin(2 * np.pi * 1.1 * t + seed)
    )
    calm = np.hanning(351)
    wanted = (
        np.convolve(np.pad(told, 175, "edge"), calm / calm.sum(), "valid")[: len(t)]
        if strokes
        else told
    )
    push = hand_n * np.convolve(
        random.normal(0.0, 1.0, len(t)), np.ones(300) / np.sqrt(300.0), "same"
    )
    return CART.driven(f"log{seed}", wanted, random, coulomb_n=coulomb_n, push_n=push)


@pytest.fixture
def cart(tmp_path):
    return opened(tmp_path, RIG, PLANT)


def test_rows_in_which_nothing_moves_are_not_judged_and_that_is_said(cart):
    log = run(1)
    ready = cart.prepare(log)
    speed = ready.work.base.speed_m_s
    resting = at_rest(ready.signals, speed, {**cart.rig.settings, **cart.plant.numbers})
    assert np.array_equal(ready.undetermined, resting[:: ready.signals.stride])
    assert 0.2 < resting.mean() < 0.9
    assert np.abs(speed[~resting]).max() > 0.1 and np.median(np.abs(speed[resting])) < 5e-4
    assert not ready.judged["force"][resting[:: ready.signals.stride]].any()
    (finding,) = check_rests([log], cart)
    assert finding.severity == "note" and "not judged" in finding.says
    assert not check_rests([run(1, strokes=False)], cart)  # reversals are no rests


def test_a_joint_that_never_moves_tells_a_bound_of_its_friction(cart):
    """The drive swings by 5 N to either side of a constant load, and nothing moves."""
    log = run(1)
    t = np.arange(log.samples) * PERIOD_S
    held = {"place_m": np.full(len(t), 0.1), "force_n": 2.0 + 5.0 * np.sin(np.pi * t)}
    (finding,) = check_rests([replace(log, columns={**log.columns, **held})], cart)
    bound = re.search(r"dry friction is ([\d.]+) N at least", finding.says)
    assert bound and 4.9 <= float(bound.group(1)) <= 5.001
    assert "100% of the rows" in finding.says


@pytest.mark.parametrize(("stick_s", "rests"), [(0.0, False), (0.012, True)])
def test_where_a_carriage_sticks_for_a_moment_as_it_turns_is_not_judged(cart, stick_s, rests):
    """Dry friction then takes whatever the drive gives; carriages without a gap had 1.6 to 3.6
    floors by such rows.
    """
    log, quarter = run(1, strokes=False), 0.625
    t = np.arange(log.samples) * PERIOD_S
    phase = np.mod(t, 2.0 * quarter + stick_s)  # to and fro once, standing at both ends
    way = np.cos(np.pi * np.minimum(phase, 2.0 * quarter) / (2.0 * quarter)) * np.where(
        np.mod(np.floor(t / (2.0 * quarter + stick_s)), 2.0) == 0.0, 1.0, -1.0
    )
    ready = cart.prepare(replace(log, columns={**log.columns, "place_m": 0.1 * way}))
    assert bool(ready.undetermined[50:-50].any()) is rests


def slow_logger(moving_s: float) -> Recording:
    """A carriage that goes on for a while and stands for 2 s, a row every 100 ms."""
    t = np.arange(0.0, 120.0, 0.1)
    goes = np.mod(t, moving_s + 2.0) < moving_s
    place = np.cumsum(np.where(goes, 0.05, 0.0)) * 0.1
    force = np.where(goes, 5.0 + np.sin(7.0 * t), 0.0)
    return one_trial("log", "cart", 0.1, {"place_m": place, "force_n": force})


@pytest.mark.parametrize(("lowpass_hz", "rows"), [(4, 2), (5, 8)])
def test_without_a_filter_a_rest_is_not_spread_by_one(tmp_path, lowpass_hz, rows):
    """Of the 12 rows of a motion."""
    rig = RIG.replace("100 Hz", "10 Hz").replace("40 Hz", f"{lowpass_hz} Hz")
    ready = opened(tmp_path, rig, PLANT).prepare(slow_logger(1.2))
    lasting = [stop - start for start, stop in stretches(~ready.undetermined)]
    assert abs(np.median(lasting) - rows) <= 1


@pytest.mark.parametrize(("moving_s", "judged"), [(1.2, False), (6.0, True)])
def test_motions_that_are_shorter_than_the_noise_s_memory_are_no_answer(tmp_path, moving_s, judged):
    rig = RIG.replace("100 Hz", "10 Hz").replace("40 Hz", "4 Hz")
    cart, log = opened(tmp_path, rig, PLANT), slow_logger(moving_s)
    floor = white("force", 0.1, "sensors")
    places = localise(cart, {"log": cart.prepare(log)}, {}, {"force": floor})
    assert bool(places) is judged
    if not judged:
        with pytest.raises(VerbError, match="16 rows in a row at 10 Hz beside the 2.5 s") as error:
            check_judged(places, cart)
        assert "both ends, 4.1 s together: longer motions" in str(error.value)


@pytest.mark.parametrize(("rows", "judged"), [(66, False), (67, True)])
def test_a_motion_is_judged_from_the_length_on_that_is_said(tmp_path, rows, judged):
    """At 100 Hz behind 20 Hz: 16 rows, and 25 at each end."""
    cart = opened(tmp_path, RIG.replace("40 Hz", "20 Hz"), PLANT)
    t = np.arange(rows) * 0.01
    columns = {"place_m": 0.1 * t, "force_n": 5.0 + np.sin(7.0 * t)}
    log = one_trial("log", "cart", 0.01, columns)
    floor = white("force", 0.1, "sensors")
    assert bool(localise(cart, {"log": cart.prepare(log)}, {}, {"force": floor})) is judged


def test_strokes_of_a_carriage_without_a_gap_show_none(cart):
    found = diagnose(cart, [run(1), run(2)], how_far=False)
    assert found.verdict == "no_gap", found.says


def test_strokes_show_dry_friction_that_the_plant_file_has_too_little_of(cart):
    found = diagnose(cart, [run(1, coulomb_n=6.0), run(2, coulomb_n=6.0)], how_far=False)
    assert found.effects[0].family == "friction", found.says
    assert found.effects[0].confidence > 0.5
    assert found.location[0].times_floor > 3.0


def test_a_hand_on_the_carriage_is_a_gap_though_nothing_foresees_it(cart):
    found = diagnose(
        cart, [run(1, strokes=False, hand_n=2.0), run(2, strokes=False, hand_n=2.0)], how_far=False
    )
    assert found.verdict == "not_in_catalogue" and not found.effects
    assert found.posterior.unknown > 0.8
    assert (
        diagnose(cart, [run(1, strokes=False), run(2, strokes=False)], how_far=False).verdict
        == "no_gap"
    )
