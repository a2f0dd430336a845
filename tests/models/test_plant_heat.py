"""Heat of the motor: the winding and a slow node weaken the torque; the slow one is not there while
its ratio is 0.
"""

import numpy as np
import pytest
from catalogue_scenes import PERIOD_S, alone, opened, truths

from epa_rt.models import plant
from epa_rt.models.blocks import motor
from epa_rt.models.compiled import compiled
from epa_rt.models.parameters import neutral_params
from epa_rt.models.ports import HEAT, SENSORS, SLOW_HEAT, SMOOTH

STRONG = dict(torque_loss_per_k=8e-3, housing_heat_ratio=3.0, housing_time_s=8.0)
BOUNDS = dict(torque_loss_per_k=0.01, housing_heat_ratio=20.0, housing_time_s=5.0)


def heated(params: np.ndarray, **values: float) -> np.ndarray:
    params = params.copy()
    for name, value in values.items():
        params["drive"][name] = value
    return params


@compiled
def constants(params, warmth, out):
    for k in range(len(out)):
        out[k] = motor.torque_constant(params[0].drive, warmth[k])


@compiled
def there_and_back(params, current, warmth, out):
    """Torque of each current, and the current that the inverse makes of it."""
    p = params[0].drive
    for k in range(out.shape[1]):
        out[0, k] = motor.motor_torque(p, current[k], 0.0, warmth[k])
        out[1, k] = motor.current_for(p, out[0, k], 0.0, warmth[k])


@compiled
def warmed(params, current, step_s, steps, out):
    """Both nodes (2,) under a steady current, from cold."""
    for _ in range(steps):
        heat, slow = motor.heat_rates(params[0].drive, current, out[0], out[1])
        out[0] += step_s * heat
        out[1] += step_s * slow


@compiled
def _smooth(params, state, commands, substeps, out, smooth):
    for k in range(commands.shape[0]):
        plant.advance(params, state, commands[k : k + 1], out[k : k + 1], 1e-3, substeps)
        smooth[k] = state[0].smooth


def smooth_states(params, scene) -> np.ndarray:
    """(N, SMOOTH) at the cycle ends."""
    smooth = np.empty((len(scene.commands), SMOOTH))
    _smooth(
        params,
        plant.new_state(params),
        scene.commands,
        scene.substeps,
        np.zeros(len(scene.commands), SENSORS),
        smooth,
    )
    return smooth


@pytest.mark.parametrize("rig", ["bench", "mass"])
@pytest.mark.parametrize(
    "off",
    [dict(torque_loss_per_k=0.0), dict(housing_heat_ratio=0.0)],
    ids=["no loss", "winding alone"],
)
def test_what_is_off_is_absent_to_the_bit(rig, off):
    """Without a loss neither node does anything; at ratio 0 the slow one does nothing, and its time
    is no number of the run.
    """
    scene = opened(rig)
    plain = (
        heated(scene.params, torque_loss_per_k=STRONG["torque_loss_per_k"])
        if "torque_loss_per_k" not in off
        else scene.params
    )
    shaped = heated(scene.params, **{**STRONG, **off})
    (read, truth), (read_too, truth_too) = truths(plain, scene), truths(shaped, scene)
    assert read.tobytes() == read_too.tobytes() and truth.tobytes() == truth_too.tobytes()
    for block in ("drive", "transmission"):
        one, other = alone(block, plain, scene, truth), alone(block, shaped, scene, truth)
        assert all(one[name].tobytes() == other[name].tobytes() for name in one)


def test_the_winding_alone_weakens_the_torque_by_the_straight_line():
    """The law at ratio 0, exactly, as far as it goes."""
    params, warmth = heated(neutral_params(), torque_loss_per_k=3e-3), np.linspace(0.0, 299.0, 300)
    out = np.empty(300)
    constants(params, warmth, out)
    assert np.array_equal(
        out, float(params["drive"]["torque_constant_nm_a"][0]) * (1.0 - 3e-3 * warmth)
    )


def test_the_slow_node_warms_as_far_as_the_winding_in_its_own_time():
    params, current, step_s = heated(neutral_params(), **STRONG), 2.5, 1e-3
    d = params["drive"][0]
    end = d["winding_thermal_k_w"] * d["winding_ohm"] * current**2
    both = np.zeros(2)
    warmed(params, current, step_s, 8000, both)
    assert both == pytest.approx(
        end * (1.0 - np.exp(-8.0 / np.array([d["winding_time_s"], 8.0]))), rel=2e-4
    )
    warmed(params, current, step_s, 200_000, both)
    assert both == pytest.approx([end, end], rel=1e-9)


def test_the_plant_follows_both_nodes_of_its_own_current():
    """Against the exact lag of the squared current, straight between cycles."""
    scene = opened("mass")
    params = heated(scene.params, **STRONG)
    smooth, d = smooth_states(params, scene), params["drive"][0]
    _, truth = truths(params, scene)
    squared = np.concatenate([[0.0], truth["motor_current_a"]]) ** 2
    for index, time_s in ((HEAT, d["winding_time_s"]), (SLOW_HEAT, d["housing_time_s"])):
        fade, wanted = np.exp(-PERIOD_S / time_s), np.zeros(len(truth))
        for k in range(len(truth)):
            end = d["winding_thermal_k_w"] * d["winding_ohm"] * 0.5 * (squared[k] + squared[k + 1])
            wanted[k] = end + ((wanted[k - 1] if k else 0.0) - end) * fade
        assert wanted[-1] > 1.0
        assert np.max(np.abs(smooth[:, index] - wanted)) < 5e-3 * np.max(wanted)
    assert np.array_equal(smooth[:, HEAT], truth["winding_heat_k"])


def test_the_shaft_alone_accounts_for_the_slow_node():
    """Over the motion of a plant that has it, the balance with it needs the plant's current, the
    winding alone does not.
    """
    scene = opened("mass")
    params = heated(scene.params, **STRONG)
    _, truth = truths(params, scene)
    left = [
        np.sqrt(
            np.mean(
                (alone("drive", p, scene, truth)["needed_a"] - truth["motor_current_a"])[4000:]
                .reshape(-1, 100)
                .mean(axis=1)
                ** 2
            )
        )
        for p in (params, heated(params, housing_heat_ratio=0.0))
    ]
    assert left[0] < 0.3 * left[1]


def test_the_torque_keeps_its_sign_at_the_bounds():
    """A tenth of the cold constant is left at least; torque and current stay each other's inverse
    there.
    """
    params = heated(neutral_params(), **BOUNDS)
    cold, warmth, out = (
        float(params["drive"]["torque_constant_nm_a"][0]),
        np.linspace(0.0, 21 * 100.0, 2000),
        np.empty(2000),
    )
    constants(params, warmth, out)
    assert np.all(np.diff(out) <= 0.0) and out[0] == cold and out[-1] == motor.LEAST_CONSTANT * cold
    current, both = np.linspace(-8.0, 8.0, 2000), np.empty((2, 2000))
    there_and_back(params, current, warmth, both)
    assert np.all(both[0] * current >= 0.0) and both[1] == pytest.approx(
        current, rel=1e-12, abs=1e-12
    )


@pytest.mark.parametrize("rig", ["bench", "knee", "mass"])
def test_the_plant_runs_at_the_bounds(rig):
    scene = opened(rig)
    out, truth = truths(heated(scene.params, **BOUNDS, winding_thermal_k_w=20.0), scene)
    assert all(np.all(np.isfinite(out[name])) for name in out.dtype.names)
    assert np.all(truth["winding_heat_k"] >= 0.0)
