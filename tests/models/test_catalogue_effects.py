"""Every effect of the catalogue acts in the whole plant and in its block alone, and is absent to
the bit when neutral.
"""

import numpy as np
import pytest
from catalogue_scenes import alone, opened, real, scene_of, switched_on, truths
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_scenarios import SENSOR_STEP, simulate

from epa_rt.models.catalogue import CATALOGUE, write_knob
from epa_rt.models.knobs import row_of
from epa_rt.models.parameters import effects
from epa_rt.models.ports import SENSORS

SWITCHES = {f"{block}.{row.name}" for pairs in effects().values() for block, row in pairs}
STARTS = [
    pytest.param(effect, i, id=f"{effect.name}-{i}")
    for effect in CATALOGUE
    for i in range(len(effect.starts))
]
# Shapes that only come into play with their effect, whether or not a fit may move them.
SHAPES = sorted(
    {key for effect in CATALOGUE for key in effect.knobs} - SWITCHES
    | {
        "muscle.slip4_m",
        "muscle.slip1_ratio",
        "muscle.slip2_ratio",
        "muscle.slip3_ratio",
        "muscle.slip4_ratio",
        "muscle.slip_reference_length_m",
        "muscle.bouc_wen_unload_ratio",
        "load.guide_stiffness_n_m",
        "load.knee_stiffness_nm_rad",
    }
)


@pytest.mark.parametrize(("effect", "i"), STARTS)
def test_acts_in_the_whole_plant(effect, i):
    scene = scene_of(effect)
    without = simulate(scene.params, scene.commands, scene.substeps)
    given_it = simulate(
        switched_on(scene.params, effect, effect.starts[i]), scene.commands, scene.substeps
    )
    assert all(np.all(np.isfinite(given_it[name])) for name in SENSORS.names)
    assert given_it.tobytes() != without.tobytes()


@pytest.mark.parametrize(
    "effect",
    [e for e in CATALOGUE if len([k for k in e.knobs if k in SWITCHES]) > 1],
    ids=lambda e: e.name,
)
def test_each_switch_of_an_effect_matters(effect):
    """Of an effect with several switches, none is there for nothing."""
    scene = scene_of(effect)
    strongest = {
        key: max(start[i] for start in effect.starts) for i, key in enumerate(effect.knobs)
    }
    on = switched_on(scene.params, effect, tuple(strongest.values()))
    whole = simulate(on, scene.commands, scene.substeps)
    for key in (key for key in effect.knobs if key in SWITCHES):
        less = on.copy()
        write_knob(less, key, row_of(key)[1].neutral)
        assert simulate(less, scene.commands, scene.substeps).tobytes() != whole.tobytes(), key


@pytest.mark.parametrize(("effect", "i"), STARTS)
def test_acts_in_its_block_alone(effect, i):
    scene = scene_of(effect)
    _, truth = truths(scene.params, scene)
    without = alone(effect.block, scene.params, scene, truth)
    given_it = alone(
        effect.block, switched_on(scene.params, effect, effect.starts[i]), scene, truth
    )
    assert all(np.all(np.isfinite(values)) for values in given_it.values())
    assert any(given_it[name].tobytes() != without[name].tobytes() for name in without)


@pytest.mark.parametrize("effect", [e for e in CATALOGUE if e.block != "bus"], ids=lambda e: e.name)
def test_block_alone_accounts_for_its_effect_in_the_whole_plant(effect):
    """A plant with the effect: its block alone with the effect gives what the plant gave, without
    it not.

    The shaft's balance sees the acceleration only as a slope between cycles: it is held to means
    over 0.1 s, and less closely.
    """
    scene = scene_of(effect)
    given_it = switched_on(scene.params, effect, effect.starts[0])
    out, truth = truths(given_it, scene)
    wanted = real(given_it, out, truth)
    left, before = (
        alone(effect.block, params, scene, truth) for params in (given_it, scene.params)
    )
    shares = {
        name: rms(left[name] - wanted[name], name) / rms(before[name] - wanted[name], name)
        for name in left
        if name in wanted and left[name].tobytes() != before[name].tobytes()
    }
    best = min(shares, key=shares.get)
    assert shares[best] < (0.3 if best == "needed_a" else 0.05), shares
    assert max(shares.values()) < 1.0, shares


def rms(values: np.ndarray, name: str) -> float:
    values = values[100:].reshape(-1, 100).mean(axis=1) if name == "needed_a" else values[5:]
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
def test_typical_strength_moves_a_reading_by_a_tenth_of_its_step(effect):
    """What a fit starts from is not lost in the resolution: on a motion made for it, it can be
    seen.
    """
    scene = scene_of(effect)
    without = simulate(scene.params, scene.commands, scene.substeps)
    given_it = simulate(
        switched_on(scene.params, effect, effect.starts[0]), scene.commands, scene.substeps
    )
    moved = {
        name: np.max(np.abs(given_it[name] - without[name])) / step
        for name, step in SENSOR_STEP.items()
    }
    assert max(moved.values()) > 0.1, moved


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.sampled_from(["bench", "knee", "mass"]),
    st.lists(st.sampled_from(CATALOGUE), max_size=3),
    st.lists(st.floats(0.0, 1.0), min_size=len(SHAPES), max_size=len(SHAPES)),
)
def test_what_shapes_an_effect_is_silent_while_it_is_off(rig, on, places):
    """Bit-identical, whatever other effects are on: a neutral effect is computed as if its code
    were not there.
    """
    scene = opened(rig)
    params, commands = scene.params.copy(), scene.commands[1500:4500]
    used = {key for effect in on for key in effect.knobs}
    for effect in on:
        params = switched_on(params, effect, effect.starts[0])
    plain = simulate(params, commands, scene.substeps)
    slips = rig == "mass" or any("slip_ratio" in key or "run_in" in key for key in used)
    friction = slips or any(
        word in key
        for key in used
        for word in (
            "dahl",
            "lugre",
            "bouc",
            "preisach",
            "pressure_viscous",
            "muscle.stribeck",
            "coulomb_ratio",
        )
    )
    for key, place in zip(SHAPES, places, strict=True):
        _, row, _ = row_of(key)
        if key in used or _in_use(key, used, rig, slips, friction):
            continue
        write_knob(params, key, row.low + place * (row.high - row.low))
    assert simulate(params, commands, scene.substeps).tobytes() == plain.tobytes()


def _in_use(key: str, used: set[str], rig: str, slips: bool, friction: bool) -> bool:
    """Whether a shape that is no knob of an effect which is on matters all the same."""
    name = key.split(".")[1]
    return (
        name.startswith("slip")
        and slips
        or name == "slip_reference_length_m"
        and friction
        or name in ("lock_length_m", "lock_hardening_per_m", "lock_steepening_ratio")
        and rig == "mass"
        or name.startswith(("gear_friction", "gear_sliding"))
        and any(k.startswith("transmission.gear_") for k in used)
        or name == "bouc_wen_unload_ratio"
        and "muscle.bouc_wen_ratio" in used
        or name == "guide_stiffness_n_m"
        and "load.coulomb_n" in used
        or name in ("knee_stiffness_nm_rad", "knee_bend_ratio")
        and "load.knee_coulomb_nm" in used
        or name == "backlash_roundness_ratio"
        and "transmission.uneven_backlash_rad" in used
        or name == "gauge_warm_up_s"
        and any("gauge_drift" in k for k in used)
    )
