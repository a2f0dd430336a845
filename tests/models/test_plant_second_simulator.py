"""The compiled plant against a second simulator written from the equations alone."""

import math
from pathlib import Path

import numpy as np
import pytest
from plant_scenarios import SENSOR_STEP, rise, silent, simulate
from second_effects import WithEffects
from second_simulator import SecondSimulator

from epa_rt.models import plant
from epa_rt.models.catalogue import write_knob
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


def agreed(file, params: np.ndarray, knee: bool, simulator=SecondSimulator):
    """The readings of the compiled plant and the second simulator's over the short log, which differ by a sensor's step at most; and the commands."""
    gear = params["transmission"][0]
    commands = short_log(float(gear["gear_ratio"] / gear["spool_radius_m"]), knee)
    place = float(plant.new_state(params)["smooth"][0, LOAD_PLACE])
    first, second = simulate(params, commands, file.substeps), simulator(params, place).run(commands)
    for channel, values in second.items():
        assert np.max(np.abs(first[channel] - values)) <= SENSOR_STEP[channel], channel
    return first, second, commands


@pytest.mark.parametrize("name", ["bench_physical", "knee"])
def test_two_simulators_agree_within_a_sensor_step(name):
    file = load_plant(PLANTS / f"{name}.yaml")
    agreed(file, silent(file.params), name == "knee")


EFFECTS = {  # several at once: each run of the second simulator takes seconds
    "drive: heat, a supply that sags, waves of the torque, saturation": {
        "drive.torque_loss_per_k": 2e-3, "drive.winding_thermal_k_w": 20.0, "drive.winding_time_s": 0.5, "drive.housing_heat_ratio": 3.0, "drive.housing_time_s": 8.0, "drive.bus_sag_ohm": 2.0,
        "drive.torque_ripple_ratio": 0.05, "drive.ripple_twice_sine_ratio": 0.3, "drive.ripple_phase_rad": 0.7, "drive.cogging_nm": 3e-3, "drive.cogging_twice_cosine_ratio": -0.4,
        "drive.torque_saturation_per_a": 0.02},
    "a spool that is not round, creep": {"transmission.eccentricity_ratio": 0.1, "transmission.eccentricity_phase_rad": 1.0, "transmission.wind_up_per_rad": 0.06,
                                         "muscle.creep_stiffness_n_m": 2000.0, "muscle.creep_time_s": 0.1, "muscle.creep_slow_ratio": 0.6},
    "low-speed friction of the motor": {"drive.stribeck_ratio": 1.5, "drive.stribeck_speed_rad_s": 30.0, "drive.stribeck_exponent_ratio": 0.8},
    "play": {"transmission.backlash_rad": 0.03},
    "uneven play": {"transmission.uneven_backlash_rad": 0.03, "transmission.backlash_wave_ratio": 0.7, "transmission.backlash_per_turn_ratio": 2.0, "transmission.backlash_narrowness_ratio": 1.8,
                    "transmission.backlash_phase_rad": 1.1},
    "play with round flanks": {"transmission.backlash_rad": 0.03, "transmission.backlash_roundness_ratio": 0.6},
    "friction of the braid": {"muscle.stribeck_ratio": 0.05, "muscle.stribeck_tail_ratio": 0.5, "muscle.stribeck_breadth_ratio": 1.4, "muscle.coulomb_ratio": 0.03,
                              "muscle.coulomb_speed_m_s": 0.004, "muscle.pressure_viscous_s_m": 0.3},
    "friction of the gear": {"transmission.gear_friction_n": 12.0, "transmission.gear_efficiency_ratio": 0.85, "transmission.gear_friction_speed_rad_s": 3.0,
                             "transmission.gear_friction_sharpness_ratio": 2.0},
    "bladder, threshold, softening, end fittings, leak through narrow gaps": {
        "muscle.bladder_stiffness_n_m": 500.0, "muscle.bladder_hardening_per_m": 30.0, "muscle.threshold_pa": 2e4, "muscle.softening_per_pa": 3e-7, "muscle.end_length_m": 2e-3,
        "gas.leak_per_s": 0.2, "gas.leak_laminar_ratio": 0.8},
    "friction of the gear in motion alone": {"transmission.gear_friction_n": 30.0, "transmission.gear_sliding_ratio": 1.0},
    "friction of the gear, half and half; valves that do not shut": {"transmission.gear_friction_n": 10.0, "transmission.gear_friction_speed_rad_s": 5.0, "transmission.gear_sliding_ratio": 0.5,
                                                                     "gas.inlet_seat_leak_ratio": 0.02, "gas.exhaust_seat_leak_ratio": 0.03, "gas.leak_laminar_ratio": 0.6},
    "lock": {"muscle.lock_stiffness_n_m": 3000.0, "muscle.lock_hardening_per_m": 100.0, "muscle.lock_steepening_ratio": 3.0, "muscle.lock_viscous_n_s_m": 20.0, "muscle.lock_length_m": 0.1385},
}


@pytest.mark.parametrize("knobs", EFFECTS.values(), ids=EFFECTS)
def test_two_simulators_agree_on_effects_within_a_sensor_step(knobs):
    file = load_plant(PLANTS / "bench_physical.yaml")
    bare = silent(file.params)
    params = bare.copy()
    for key, value in knobs.items():
        write_knob(params, key, value)
    first, second, commands = agreed(file, params, knee=False, simulator=WithEffects)
    without = simulate(bare, commands, file.substeps)
    assert any(np.max(np.abs(first[c] - without[c])) > SENSOR_STEP[c] for c in second)  # it shows


@pytest.mark.parametrize(("payload_kg", "lever"), [(0.3, 1.6), (-0.2, 1.0)])
def test_two_simulators_agree_on_a_weight_on_the_shin(payload_kg, lever):
    file = load_plant(PLANTS / "knee.yaml")
    params = silent(file.params)
    write_knob(params, "load.payload_kg", payload_kg)
    write_knob(params, "load.payload_lever_ratio", lever)
    agreed(file, params, knee=True)
