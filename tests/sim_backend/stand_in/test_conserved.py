"""The gas of the stand-in keeps its mass whatever is hidden: pressure and mass are states of their
own there, and follow the braid's volume by its rate alone.
"""

import functools

import numpy as np
import pytest

from epa_rt.models.ports import COMMAND, SENSORS
from sim_backend.stand_in import effects, muscle, plant
from sim_backend.stand_in.records import MASS, PRESSURE, with_hidden
from tests.sim_backend.stand_in.test_stand_in import silent

PERIOD_S, STROKES, STROKE_M = 1e-3, 12, 0.025
HEATED = {
    "thermal_gas",
    "stirred_gas",
}  # pressure times volume over mass is its temperature, which it changes
SWELLS = {"swelling_tube"}  # its volume is not the braid's and the dead one alone
WITHIN = 2e-3


@functools.cache
def strokes() -> np.ndarray:
    """The bench filled for 0.4 s, then from the third second on strokes of the strap once a second
    with valves shut.
    """
    radius, ratio = (
        float(silent("bench")["transmission"][name][0]) for name in ("spool_radius_m", "gear_ratio")
    )
    t = np.arange((3 + STROKES) * 1000) * PERIOD_S
    made = np.zeros(len(t), COMMAND)
    made["enabled"], made["mode"] = 1.0, 9.0
    made["target_speed_rad_s"] = (
        np.where(t > 3.0, np.pi * STROKE_M * np.sin(2.0 * np.pi * (t - 3.0)), 0.0) / radius * ratio
    )
    made["inlet"][(t > 0.2) & (t < 0.6), :] = 1.0
    return made


def kept(params: np.ndarray) -> tuple[np.ndarray, float]:
    """(n,) pressure times volume over mass, gas constant and temperature at both ends of each
    stroke, and by what part of it the volume changed.
    """
    state, commands, out = plant.new_state(params), strokes(), np.zeros(500, SENSORS)
    g, m, hidden = params["gas"][0, 0], params["muscle"][0, 0], params["hidden"][0]
    found, volumes = [], []
    for k in range(0, len(commands), 500):
        plant.run(params, state, commands[k : k + 500], PERIOD_S, 4, out)
        y = state["y"][0]
        volume, _, _ = muscle.body(m, hidden, g["dead_volume_m3"], state["length_m"][0, 0])
        volumes.append(volume)
        found.append(
            y[PRESSURE] * volume / (y[MASS] * g["gas_constant_j_kg_k"] * g["temperature_k"])
        )
    return np.array(found[6:]), float(np.ptp(volumes[6:]) / volumes[-1])


@pytest.mark.parametrize(
    "effect",
    [e for e in effects.BY_NAME.values() if "bench" in e.rigs and e.name not in HEATED | SWELLS],
    ids=lambda e: e.name,
)
def test_gas_follows_the_braid_whatever_is_hidden(effect):
    shapes = {name: high for name, _, high in effect.shapes}
    found, moved = kept(
        with_hidden(
            silent("bench"), **shapes, **{effect.field: min(5.0 * effect.typical, effect.most)}
        )
    )
    assert moved > 0.05
    assert np.max(np.abs(found - 1.0)) < WITHIN


def test_the_check_can_fail():
    """A gas whose heat stays is warm, and one in tubes that swell has more room than the braid
    gives it.
    """
    for name in sorted(HEATED | SWELLS):
        effect = effects.BY_NAME[name]
        found, _ = kept(with_hidden(silent("bench"), **{effect.field: effect.most}))
        assert np.max(np.abs(found - 1.0)) > WITHIN, name
