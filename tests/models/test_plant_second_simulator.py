"""The compiled plant against a second simulator written from the equations alone."""

import math
from pathlib import Path

import numpy as np
import pytest
from plant_scenarios import SENSOR_STEP, rise, silent, simulate
from second_simulator import SecondSimulator

from epa_rt.models import plant
from epa_rt.models.plant_file import load_plant
from epa_rt.models.ports import COMMAND, LOAD_PLACE

PLANTS = Path(__file__).parents[2] / "config" / "plants"
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
    commands["inlet"][100:(280 if knee else 600), 0] = 1.0
    commands["inlet"][120:200, 1] = 1.0
    commands["exhaust"][950:1010] = 1.0
    return commands


@pytest.mark.parametrize("name", ["bench_physical", "knee"])
def test_two_simulators_agree_within_a_sensor_step(name):
    file = load_plant(PLANTS / f"{name}.yaml")
    params = silent(file.params)
    gear = params["transmission"][0]
    commands = short_log(float(gear["gear_ratio"] / gear["spool_radius_m"]), name == "knee")
    place = float(plant.new_state(params)["smooth"][0, LOAD_PLACE])
    first, second = simulate(params, commands, file.substeps), SecondSimulator(params, place).run(commands)
    for channel, values in second.items():
        assert np.max(np.abs(first[channel] - values)) <= SENSOR_STEP[channel], channel
