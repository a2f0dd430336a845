"""A motion that excites an effect, the whole plant's truth over it, and every block alone over that
truth.
"""

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from plant_scenarios import log_commands, silent

from epa_rt.models import plant
from epa_rt.models.blocks import bus, drive, gas, load, motor, muscle, sensors, transmission
from epa_rt.models.catalogue import write_knob
from epa_rt.models.compiled import compiled
from epa_rt.models.effect import Effect
from epa_rt.models.plant_file import load_plant
from epa_rt.models.ports import SENSORS, TRUTH

PLANTS = Path(__file__).parents[2] / "config" / "plants"
PERIOD_S = 1e-3
SECONDS = 18.0
# What else must hold for an effect to show: a supply not far above what the motor takes, a muscle
# stretched far enough (lengths above both starts of its locking), a parallel muscle with some
# pressure in it.
NEEDED = {"bus_sag": {"drive.supply_v": 6.0}, "braid_lock": {"load.rest0_m": 0.125}}
FILL_BOTH = ("muscle1_gauge_bow", "muscle1_gauge_gain")


class Scene(NamedTuple):
    params: np.ndarray
    commands: np.ndarray
    substeps: int


@cache
def opened(name: str) -> Scene:
    file = load_plant(PLANTS / f"{name}.yaml")
    return Scene(silent(file.params), log_commands(file, SECONDS), file.substeps)


def rig_of(effect: Effect) -> str:
    """The plant in which an effect can show at all."""
    if effect.name == "guide_friction":
        return "mass"
    keys = " ".join(effect.knobs)
    return (
        "knee"
        if effect.block == "load" or any(w in keys for w in ("joint", "muscle1", "load_position"))
        else "bench"
    )


def scene_of(effect: Effect) -> Scene:
    """Plant without the effect, and commands that excite it."""
    scene = opened(rig_of(effect))
    params = scene.params.copy()
    for key, value in NEEDED.get(effect.name, {}).items():
        write_knob(params, key, value)
    commands = scene.commands.copy()
    if effect.name in FILL_BOTH:
        commands["inlet"][1500:2500, 1] = 1.0
    return Scene(params, commands, scene.substeps)


def switched_on(params: np.ndarray, effect: Effect, start: tuple[float, ...]) -> np.ndarray:
    params = params.copy()
    for key, value in zip(effect.knobs, start, strict=True):
        write_knob(params, key, value)
    return params


@compiled
def _run(params, state, commands, substeps, out, truth):
    for k in range(commands.shape[0]):
        plant.advance(params, state, commands[k : k + 1], out[k : k + 1], 1e-3, substeps)
        truth[k] = state[0].truth


def truths(params: np.ndarray, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Readings and truths at every cycle end."""
    out, truth = np.zeros(len(scene.commands), SENSORS), np.zeros(len(scene.commands), TRUTH)
    _run(params, plant.new_state(params), scene.commands, scene.substeps, out, truth)
    return out, truth


def line_length(params: np.ndarray, t: np.ndarray, i: int) -> np.ndarray:
    """Length of muscle i's line with its strap."""
    p = params[0]["load"]
    return (
        p[f"rest{i}_m"]
        + p[f"travel{i}_ratio"] * t["travel_m"]
        + p[f"load{i}_ratio"] * t["load_position_m"]
    )


def alone(block: str, params: np.ndarray, scene: Scene, t: np.ndarray) -> dict[str, np.ndarray]:
    """Outputs of a block fed with truths of the whole plant."""
    angle, speed, atmosphere = (
        t["motor_angle_rad"],
        t["motor_speed_rad_s"],
        float(params["gas"]["atmosphere_pa"][0, 0]),
    )
    accelerated = np.gradient(speed, PERIOD_S)
    shaft = {
        "needed_a": motor.motor_over_log(
            params, angle, speed, accelerated, t["spool_force_n"], PERIOD_S
        )
    }
    if block == "bus":
        return {"seen": bus.bus_over_log(params, scene.commands, PERIOD_S)}
    if block == "drive":
        current, torque = drive.drive_over_log(
            params, scene.commands, angle, speed, PERIOD_S, scene.substeps
        )
        return {"current": current, "torque": torque, **shaft}
    if block == "transmission":
        travel, torque = transmission.transmission_over_log(params, angle, t["spool_force_n"])
        return {"travel": travel, "load_torque": torque, **shaft}
    if block == "gas":
        commands = scene.commands
        return {
            "pressure": gas.gas_over_log(
                params,
                t["muscle_length_m"][:, 0],
                commands["inlet"][:, 0],
                commands["exhaust"][:, 0],
                PERIOD_S,
            )[0]
        }
    if block == "muscle":
        return {
            "force": muscle.muscle_over_log(
                params,
                t["pressure_pa"][:, 0] - atmosphere,
                line_length(params, t, 0),
                t["muscle_speed_m_s"][:, 0],
            )
        }
    if block == "load":
        knee = float(params["load"]["kind_code"][0]) == load.KNEE
        place, rate = (
            (t["joint_angle_rad"], t["joint_speed_rad_s"])
            if knee
            else (t["load_position_m"], t["load_speed_m_s"])
        )
        return {
            "needed_n": load.load_force_over_log(
                params, place, rate, np.gradient(rate, PERIOD_S), PERIOD_S
            )
        }
    readings = sensors.sensors_over_log(params, t, PERIOD_S)
    return {name: readings[name] for name in SENSORS.names}


def real(params: np.ndarray, out: np.ndarray, t: np.ndarray) -> dict[str, np.ndarray]:
    """What the outputs of ``alone`` are in the whole plant."""
    drawn = (
        load.along_load(params[0]["load"], 1.0, 0.0),
        load.along_load(params[0]["load"], 0.0, 1.0),
    )
    return {
        "current": t["motor_current_a"],
        "torque": t["motor_torque_nm"],
        "needed_a": t["motor_current_a"],
        "travel": t["travel_m"],
        "pressure": t["pressure_pa"][:, 0],
        "force": t["muscle_force_n"][:, 0],
        "needed_n": drawn[0] * t["muscle_force_n"][:, 0] + drawn[1] * t["muscle_force_n"][:, 1],
        **{name: out[name] for name in SENSORS.names},
    }
