"""The compiled plant against a second simulator written from the equations alone."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from plant_scenarios import SENSOR_STEP, rise, silent, simulate
from second_effects import WithEffects
from second_knobs import SCENES, Scene
from second_simulator import SecondSimulator

from epa_rt.models.knobs import read_knob, write_knob
from epa_rt.models.parameters import effects, neutral_params
from epa_rt.models.plant_file import load_plant
from epa_rt.models.ports import COMMAND

PLANTS = Path(__file__).parents[2] / "config" / "plants"
PAGE = Path(__file__).parents[2] / "docs" / "plant.md"
SECONDS = 1.2


def short_log(per_metre: float, knee: bool) -> np.ndarray:
    """Fill, move in position and speed loop, vent: 1.2 s."""
    t = np.arange(round(SECONDS / 1e-3)) * 1e-3
    commands = np.zeros(len(t), COMMAND)
    commands["enabled"], commands["mode"] = 1.0, 8.0
    commands["enabled"][:20] = 0.0
    travel = 0.018 * rise(t, 0.03, 0.4) + 0.004 * rise(t, 0.3, 0.3) * np.sin(2 * math.pi * 2.5 * t)
    commands["target_angle_rad"] = travel * per_metre
    commands["target_speed_rad_s"] = np.gradient(travel, 1e-3) * per_metre
    if not knee:
        commands["mode"][700:900] = 9.0
    commands["inlet"][100 : (280 if knee else 600), 0] = 1.0
    commands["inlet"][120:200, 1] = 1.0
    commands["exhaust"][950:1010] = 1.0
    return commands


def agreed(name: str, params: np.ndarray, commands: np.ndarray, simulator) -> np.ndarray:
    """The readings of the compiled plant, from which the second simulator's differ by a sensor's
    step at most.
    """
    first, second = (
        simulate(params, commands, load_plant(PLANTS / f"{name}.yaml").substeps),
        simulator.run(commands),
    )
    assert set(second) == set(first.dtype.names)
    for channel, values in second.items():
        assert np.max(np.abs(first[channel] - values)) <= SENSOR_STEP[channel], channel
    return first


def commands_for(name: str, params: np.ndarray) -> np.ndarray:
    gear = params["transmission"][0]
    return short_log(float(gear["gear_ratio"] / gear["spool_radius_m"]), name == "knee")


def plant_of(scene: Scene) -> np.ndarray:
    params = silent(load_plant(PLANTS / f"{scene.plant}.yaml").params)
    for key, value in scene.knobs.items():
        write_knob(params, key, value)
    return params


def shows(
    scene: Scene, params: np.ndarray, commands: np.ndarray, readings: np.ndarray, key: str
) -> bool:
    """Whether a reading moves by more than a sensor's step where this knob alone goes back to its
    default.
    """
    other = params.copy()
    write_knob(other, key, float(read_knob(neutral_params(), key)))
    without = simulate(other, commands, load_plant(PLANTS / f"{scene.plant}.yaml").substeps)
    return any(np.max(np.abs(readings[c] - without[c])) > step for c, step in SENSOR_STEP.items())


@pytest.mark.parametrize("name", ["bench_physical", "knee"])
def test_two_simulators_agree_within_a_sensor_step(name):
    params = silent(load_plant(PLANTS / f"{name}.yaml").params)
    agreed(name, params, commands_for(name, params), SecondSimulator(params))


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_two_simulators_agree_on_effects_and_laws_within_a_sensor_step(scene):
    params = plant_of(scene)
    commands = commands_for(scene.plant, params)[: round(scene.seconds / 1e-3)]
    if scene.prepare:
        scene.prepare(commands)
    simulator = WithEffects(params)
    simulator.parts = scene.parts
    readings = agreed(scene.plant, params, commands, simulator)
    assert not [key for key in scene.knobs if not shows(scene, params, commands, readings, key)]


def test_the_page_says_how_many_effects_two_simulators_are_held_together_on():
    plants = [plant_of(scene) for scene in SCENES.values()]
    held = {
        name
        for name, switches in effects().items()
        if any(np.any(p[block][row.name] != row.neutral) for p in plants for block, row in switches)
    }
    said = re.search(r"they switch (\d+) of the (\d+) effects on", PAGE.read_text(encoding="utf-8"))
    assert (int(said[1]), int(said[2])) == (len(held), len(effects())), sorted(
        set(effects()) - held
    )
