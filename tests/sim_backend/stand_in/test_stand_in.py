"""The stand-in against the plant it stands for, and its hidden effects one by one."""

import ast
from pathlib import Path

import numpy as np
import pytest

import epa_rt.models.plant as nominal_physics
from epa_rt.cli.gap.blind.make import _record
from epa_rt.config.rig import load_rig
from epa_rt.models.catalogue import BY_NAME as CATALOGUE
from epa_rt.models.catalogue import write_knob
from epa_rt.models.plant_file import load_plant
from sim_backend.backend import SimBackend
from sim_backend.stand_in import effects
from sim_backend.stand_in.records import HIDDEN, with_hidden
from sim_backend.stand_in.replayed import commands_of, run_again
from sim_backend.stand_in.truth import STEPS
from sim_backend.stand_in.whole import SPOTS

ROOT = Path(__file__).resolve().parents[3]
CONFIG = ROOT / "config"
# rad/s and A: the larger of a sensor's step and the plant's own noise
AGREES = {**STEPS, "motor_current_a": 5e-3}


def silent(rig: str) -> np.ndarray:
    params = load_plant(CONFIG / "plants" / f"{rig}.yaml").params
    for name in params["sensors"].dtype.names:
        if "_noise_" in name:
            params["sensors"][name] = 0.0
    return params


def commands(rig: str, experiment: str) -> np.ndarray:
    typed, plant = (
        load_rig(CONFIG / "rigs" / f"{rig}.yaml"),
        load_plant(CONFIG / "plants" / f"{rig}.yaml"),
    )
    outcome, outputs = _record(
        CONFIG / "experiments" / f"{experiment}.yaml",
        CONFIG / "rigs" / f"{rig}.yaml",
        CONFIG / "plants" / f"{rig}.yaml",
        SimBackend(typed, plant, 1),
        None,
    )
    assert outcome == "completed"
    return commands_of(typed, outputs)


@pytest.fixture(scope="module")
def logs() -> dict[str, np.ndarray]:
    return {
        "bench": commands("bench", "identification_short"),
        "knee": commands("knee", "knee_chirp_short"),
    }


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_stand_in_and_plant_agree_within_a_sensor_step(logs, rig):
    params = silent(rig)
    ours = run_again(params, logs[rig], 1e-3, 2, nominal_physics)
    theirs = run_again(with_hidden(params), logs[rig], 1e-3)
    for channel, step in AGREES.items():
        assert np.max(np.abs(ours[channel] - theirs[channel])) <= step, channel
    assert np.max(np.abs(ours["supply_gauge_pa"] - theirs["supply_gauge_pa"])) <= 1.0
    assert np.ptp(ours["force_n"]) > 20.0  # something happened


THE_SAME_THERE = [  # hidden laws at numbers at which they say what the catalogue's say
    ({"strap_m": 30.0, "strap_n": 1e6}, {"muscle.strap_compliance_m_n": 3e-5}),
    ({"end_m": 1e-3}, {"muscle.end_length_m": 1e-3}),
    ({"wall_n_m": 300.0, "wall_rise_per_m": 0.0}, {"muscle.bladder_stiffness_n_m": 300.0}),
    (
        {"regulator_pa_s_kg": 3e8, "regulator_hz": 5.0, "regulator_damping": 0.3},
        {
            "gas.supply_droop_pa_s_kg": 3e8,
            "gas.droop_time_s": 0.3 / (np.pi * 5.0),
            "gas.droop_ring_ratio": 0.25 / 0.3**2,
        },
    ),
    ({"tilt_rad": 0.05}, {"load.misalignment_rad": 0.05}),
    ({"knee_spring_nm_rad": 1.0}, {"load.knee_spring_nm_rad": 1.0}),
    (
        {"knee_bristle_nm": 0.1, "knee_bristle_rad": 0.004},
        {
            "load.knee_coulomb_nm": 0.1,
            "load.knee_stiffness_nm_rad": 25.0,
            "load.knee_bend_ratio": 1.0,
            "load.presliding_time_s": 5e-4,
        },
    ),
    (
        {"force_offset_n": 2.0, "force_gain_ratio": 0.02},
        {"sensors.force_offset_n": 2.0, "sensors.force_gain_ratio": 1.02},
    ),
    (
        {"encoder_wobble_rad": 3e-3, "encoder_phase_rad": 1.0},
        {
            "sensors.encoder_eccentricity_rad": 3e-3,
            "sensors.encoder_phase_rad": 1.0,
            "sensors.encoder_twice_sine_ratio": 0.2 * np.cos(0.4),
            "sensors.encoder_twice_cosine_ratio": 0.2 * np.sin(0.4),
        },
    ),
]


@pytest.mark.parametrize("rig", ["bench", "knee"])
@pytest.mark.parametrize(("hidden", "knobs"), THE_SAME_THERE, ids=lambda at: next(iter(at)))
def test_where_a_hidden_law_is_the_catalogues_both_agree_within_a_sensor_step(
    logs, rig, hidden, knobs
):
    params = silent(rig)
    if rig == "bench" and next(iter(knobs)).startswith("load."):
        pytest.skip("the bench has no knee")
    patched = params.copy()
    for key, value in knobs.items():
        write_knob(patched, key, value)
    ours, theirs = (
        run_again(patched, logs[rig], 1e-3, 2, nominal_physics),
        run_again(with_hidden(params, **hidden), logs[rig], 1e-3),
    )
    for channel, step in AGREES.items():
        assert np.max(np.abs(ours[channel] - theirs[channel])) <= step, channel
    assert not np.array_equal(ours, run_again(params, logs[rig], 1e-3, 2, nominal_physics))


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_uneven_play_is_the_catalogues_but_for_its_round_flanks(logs, rig):
    """Forces differ by what a flank's own speed drags: the catalogue leaves it out."""
    params, ratio, phase = silent(rig), 0.6, -1.5
    patched, radius = params.copy(), float(params["transmission"]["spool_radius_m"][0])
    for name, value in (
        ("uneven_backlash_rad", 1e-3 / radius),
        ("backlash_wave_ratio", ratio),
        ("backlash_phase_rad", phase),
    ):
        write_knob(patched, f"transmission.{name}", value)
    hidden = with_hidden(
        params, play_m=1e-3, play_spread_ratio=0.0, play_uneven_ratio=ratio, play_phase_rad=phase
    )
    bare, ours = (run_again(p, logs[rig], 1e-3, 2, nominal_physics) for p in (params, patched))
    theirs = run_again(hidden, logs[rig], 1e-3)
    for channel in ("muscle0_gauge_pa", "force_n", "motor_angle_rad"):
        assert np.max(np.abs(ours[channel] - theirs[channel])) <= max(
            0.05 * np.max(np.abs(ours[channel] - bare[channel])), AGREES[channel]
        ), channel


def seen_of(rig: str) -> np.ndarray:
    """(N,) angles of the spool, evenly over what a rig's trials turn it by."""
    return np.linspace(0.0, {"bench": 2.6, "knee": 0.8}[rig], 200)


@pytest.mark.parametrize(("rig", "least"), [("bench", 0.1), ("knee", 0.05)])
def test_worn_spots_are_no_wave_over_the_turn_wherever_they_lie(rig, least):
    """What one plus a sine, the catalogue's law, leaves of the width over what the spool turns, as
    a part of its mean.
    """
    one, angle = effects.THIRD["play"], seen_of(rig)
    shapes = {name: (low, high) for name, low, high in one.shapes}
    table = np.stack([np.ones(len(angle)), np.sin(angle), np.cos(angle)], axis=1)
    left = []
    for phase in np.linspace(*shapes["play_phase_rad"], 40):
        for sharp in shapes["play_worn_sharpness"]:
            wide = 1.0 + np.mean(shapes["play_worn_ratio"]) * np.exp(
                sharp * (np.cos(SPOTS * (angle + phase)) - 1.0)
            )
            rest = wide - table @ np.linalg.lstsq(table, wide, rcond=None)[0]
            left.append(np.max(np.abs(rest)) / np.mean(wide))
    assert np.median(left) > least


def test_every_hidden_effect_shows_and_is_absent_at_zero(logs):
    silent_on = {"sagging_supply"}  # the drive never reaches its voltage here
    for rig in ("bench", "knee"):
        params, short = silent(rig), logs[rig][:14000]
        bare = run_again(with_hidden(params), short, 1e-3, 4).view("f8")
        for effect in (e for e in effects.BY_NAME.values() if rig in e.rigs):
            shapes = {name: high for name, _, high in effect.shapes}
            assert np.array_equal(
                run_again(with_hidden(params, **shapes), short[:3000], 1e-3, 4).view("f8"),
                bare[: 3000 * 11],
            ), effect.name
            out = run_again(
                with_hidden(params, **shapes, **{effect.field: effect.typical}), short, 1e-3, 4
            ).view("f8")
            assert np.all(np.isfinite(out)), effect.name
            assert effect.name in silent_on or not np.array_equal(out, bare), effect.name


def test_hidden_effects_are_many_and_named_in_the_catalogues_words():
    known = {answer for e in effects.EFFECTS for answer in e.answers if answer in CATALOGUE}
    assert sum(any(answer in CATALOGUE for answer in e.answers) for e in effects.EFFECTS) >= 30
    assert any(not any(answer in CATALOGUE for answer in e.answers) for e in effects.EFFECTS)
    assert len({CATALOGUE[name].family for name in known}) >= 25
    for effect in effects.BY_NAME.values():
        assert effect.field in HIDDEN.names
        assert all(rival in effects.BY_NAME for rival in effect.rivals)
        assert all(name in HIDDEN.names for name, _, _ in effect.shapes)


OTHERS = [
    pytest.param(first, other, id=other.name)
    for formulas in (effects.SECOND, effects.THIRD)
    for first, other in formulas.items()
]


@pytest.mark.parametrize(("first", "other"), OTHERS)
def test_another_formula_means_the_same_thing_on_the_same_rigs(first, other):
    one = effects.BY_NAME[first]
    assert (one.answers, one.blocks, one.rigs) == (other.answers, other.blocks, other.rigs)
    assert other.name not in {effect.name for effect in effects.EFFECTS}
    assert one.law != other.law


@pytest.mark.parametrize(("first", "other"), OTHERS)
def test_another_formula_is_another_one_whatever_the_first_ones_strength(logs, first, other):
    params, short = silent("bench"), logs["bench"][:20000]
    without = run_again(with_hidden(params), short, 1e-3, 4)
    channels = [name for name in AGREES if np.ptp(without[name]) > 0.0]

    def made(effect: effects.Hidden, strength: float) -> np.ndarray:
        shapes = {name: 0.5 * (low + high) for name, low, high in effect.shapes}
        out = run_again(with_hidden(params, **shapes, **{effect.field: strength}), short, 1e-3, 4)
        return np.concatenate([out[name] / AGREES[name] for name in channels])

    bare = np.concatenate([without[name] / AGREES[name] for name in channels])
    shown = made(other, other.most) - bare
    like = made(effects.BY_NAME[first], effects.BY_NAME[first].most) - bare
    left = np.linalg.norm(shown - like * (like @ shown) / (like @ like))
    assert left > 0.01 * np.linalg.norm(shown) > 0.3  # in sensor steps


def test_the_stand_in_shares_no_law_with_the_plant():
    for path in (ROOT / "sim_backend" / "stand_in").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = (
                [node.module or ""]
                if isinstance(node, ast.ImportFrom)
                else [a.name for a in node.names]
                if isinstance(node, ast.Import)
                else []
            )
            assert not [
                n
                for n in names
                if n.startswith("epa_rt.models.blocks") or n == "epa_rt.models.chain"
            ], path.name


def test_noise_of_the_stand_in_is_normal_and_follows_its_seed(logs):
    params = with_hidden(load_plant(CONFIG / "plants" / "bench.yaml").params)
    still = np.zeros(20000, logs["bench"].dtype)
    first, again = run_again(params, still, 1e-3), run_again(params, still, 1e-3)
    params["sensors"]["seed"] = 2
    other = run_again(params, still, 1e-3)
    assert np.array_equal(first["force_n"], again["force_n"])
    for values in (first["force_n"] / 0.3, other["force_n"] / 0.3):
        assert abs(values.mean()) < 0.03
        assert abs(values.std() - 1.0) < 0.03
        assert abs(np.corrcoef(values[:-1], values[1:])[0, 1]) < 0.03
    assert abs(np.corrcoef(first["force_n"], other["force_n"])[0, 1]) < 0.03
