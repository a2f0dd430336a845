"""The whole plant: finer sub-steps, repeats, single cycles, rest, and blocks alone against blocks
in the chain.
"""

from pathlib import Path

import numpy as np
import pytest
from plant_scenarios import SENSOR_STEP, log_commands, silent, simulate

from epa_rt.models import plant
from epa_rt.models.blocks import bus, drive, gas, load, muscle, sensors, transmission
from epa_rt.models.plant_file import load_plant
from epa_rt.models.ports import COMMAND, SENSORS, SUPPLY_FLOW, TRUTH

PLANTS = Path(__file__).parents[2] / "config" / "plants"
NAMES = ["bench", "bench_physical", "knee", "mass"]


def opened(name):
    return load_plant(PLANTS / f"{name}.yaml")


def truths(params, commands, substeps):
    """Readings and truths at every cycle end."""
    state, out = plant.new_state(params), np.zeros(len(commands), SENSORS)
    truth = np.zeros(len(commands), TRUTH)
    for k in range(len(commands)):
        plant.advance(params, state, commands[k : k + 1], out[k : k + 1], 1e-3, substeps)
        truth[k] = state["truth"][0]
    return out, truth


@pytest.mark.parametrize("name", NAMES)
def test_halving_the_sub_step_changes_no_sensor_by_its_step(name):
    file = opened(name)
    params, commands = silent(file.params), log_commands(file, 20.0)
    once, twice = (
        simulate(params, commands, file.substeps),
        simulate(params, commands, 2 * file.substeps),
    )
    for channel, step in SENSOR_STEP.items():
        assert np.max(np.abs(once[channel] - twice[channel])) <= step, channel


@pytest.mark.parametrize("name", NAMES)
def test_same_seed_same_bytes_and_cycles_equal_the_log_in_one_call(name):
    file = opened(name)
    commands = log_commands(file, 1.0)
    whole, again = (
        simulate(file.params, commands, file.substeps),
        simulate(file.params, commands, file.substeps),
    )
    single, _ = truths(file.params, commands, file.substeps)
    assert whole.tobytes() == again.tobytes() == single.tobytes()
    other = file.params.copy()
    other["sensors"]["seed"] += 1
    noisy = any(other["sensors"][n][0] > 0 for n in other["sensors"].dtype.names if "_noise" in n)
    assert (simulate(other, commands, file.substeps).tobytes() != whole.tobytes()) == noisy


@pytest.mark.parametrize("name", ["bench", "bench_physical", "knee"])
def test_the_rest_state_rests(name):
    file = opened(name)
    out = simulate(silent(file.params), np.zeros(3000, COMMAND), file.substeps)
    for channel, step in SENSOR_STEP.items():
        assert np.ptp(out[channel]) < 0.1 * step, channel


@pytest.mark.parametrize("name", ["bench", "bench_physical"])
def test_a_held_motor_does_not_chatter(name):
    """Enabled at a fixed target under a filled muscle: the last second of readings is still."""
    file = opened(name)
    commands = log_commands(file, 8.0)
    commands["mode"], commands["target_angle_rad"] = 8.0, commands["target_angle_rad"][3000]
    out = simulate(silent(file.params), commands, file.substeps)[-1000:]
    assert np.ptp(out["motor_angle_rad"]) < SENSOR_STEP["motor_angle_rad"]
    assert np.ptp(out["motor_current_a"]) < 5e-3 and np.ptp(out["motor_speed_rad_s"]) < 0.01


def test_bench_reaches_its_pressure_and_loses_it():
    file = opened("bench")
    _, truth = truths(silent(file.params), log_commands(file, 20.0), file.substeps)
    gauge = truth["pressure_pa"][:, 0] - 101325
    assert 450e3 < gauge[3400] < 750e3 and gauge[-1] < 0.75 * gauge[15000]
    still = truth["gas_mass_kg"][3500:15900, 0]
    assert np.all(still == still[0])  # shut valves: the mass is exactly constant in the chain too


def test_a_delayed_command_is_the_command_later():
    """A delay of whole cycles shifts the log exactly; half a cycle lies between."""
    file = opened("bench")
    params, commands = silent(file.params), log_commands(file, 3.0)
    commands["enabled"] = 1.0
    params["sensors"]["encoder_hold_s"] = 0.0
    prompt = simulate(params, commands, file.substeps)["motor_angle_rad"]
    params["bus"]["command_delay_s"] = 3e-3
    late = simulate(params, commands, file.substeps)["motor_angle_rad"]
    assert np.max(np.abs(late[3:1900] - prompt[:1897])) < 1e-9
    params["bus"]["command_delay_s"] = 2.5e-3
    between = simulate(params, commands, file.substeps)["motor_angle_rad"]
    assert (
        np.max(np.abs(between[3:1900] - 0.5 * (prompt[:1897] + prompt[1:1898])))
        < SENSOR_STEP["motor_angle_rad"]
    )


def test_blocks_alone_equal_blocks_in_the_chain():
    """Each block fed with the chain's own signals at the cycle ends gives the chain's output within
    a sensor step.
    """
    file = opened("bench_physical")
    params, commands = silent(file.params), log_commands(file, 16.0)
    params["sensors"]["encoder_hold_s"] = 0.0
    out, t = truths(params, commands, file.substeps)
    length, speed = t["muscle_length_m"][:, 0], t["muscle_speed_m_s"][:, 0]
    current, torque = drive.drive_over_log(
        params, commands, t["motor_angle_rad"], t["motor_speed_rad_s"], 1e-3
    )
    travel, _ = transmission.transmission_over_log(params, t["motor_angle_rad"], t["spool_force_n"])
    pressure, _ = gas.gas_over_log(
        params, length, commands["inlet"][:, 0], commands["exhaust"][:, 0], 1e-3
    )
    force = muscle.muscle_over_log(params, t["pressure_pa"][:, 0] - 101325, length, speed)
    # between two samples the measured speed is taken as a parabola: short of the truth where a loop
    # starts with a jolt
    apart = np.abs(current - t["motor_current_a"]) / SENSOR_STEP["motor_current_a"]
    assert np.quantile(apart, 0.999) < 1 and np.max(apart) < 3
    assert np.max(np.abs(torque - 0.0448 * current)) < 1e-12
    assert np.max(np.abs(travel - t["travel_m"])) < 1e-12
    assert np.max(np.abs(pressure - t["pressure_pa"][:, 0])) < SENSOR_STEP["muscle0_gauge_pa"]
    assert np.max(np.abs(force - t["muscle_force_n"][:, 0])) < SENSOR_STEP["force_n"]
    seen = bus.bus_over_log(params, commands, 1e-3)
    assert np.array_equal(seen[:, 3], commands["target_angle_rad"])
    alone = sensors.sensors_over_log(params, t, 1e-3)
    assert alone["force_n"].tobytes() == out["force_n"].tobytes()
    assert np.max(np.abs(alone["muscle0_gauge_pa"] - out["muscle0_gauge_pa"])) < 1e-3


def test_the_knee_alone_equals_the_knee_in_the_chain():
    file = opened("knee")
    params = silent(file.params)
    _, t = truths(params, log_commands(file, 10.0), file.substeps)
    start = 100  # at rest on its stop
    place, speed = load.load_over_log(
        params,
        t["muscle_force_n"][start:],
        1e-3,
        t["joint_angle_rad"][start],
        t["joint_speed_rad_s"][start],
    )
    assert np.max(np.abs(place - t["joint_angle_rad"][start:])) < SENSOR_STEP["joint_angle_rad"]
    assert np.max(np.abs(speed - t["joint_speed_rad_s"][start:])) < SENSOR_STEP["joint_speed_rad_s"]


def test_torque_mode_stalls_at_its_torque():
    """Motor held by a filled muscle: commanded torque minus friction is what the muscle takes."""
    file = opened("bench")
    params, commands = silent(file.params), np.zeros(4000, COMMAND)
    commands["enabled"], commands["mode"], commands["target_torque_nm"] = 1.0, 10.0, 0.05
    commands["inlet"][:1500, 0] = 1.0
    _, t = truths(params, commands, file.substeps)
    assert t["motor_current_a"][-1] == pytest.approx(0.05 / 0.0448, rel=1e-6)
    assert abs(t["muscle_force_n"][-1, 0] * 0.01 / 19 - 0.05) <= 3.1e-3


@pytest.mark.parametrize(("skew", "opens", "closes"), [(0.0, 10, 10), (0.4, 10, 6), (-0.3, 7, 10)])
def test_valves_open_and_close_as_late_as_told(skew, opens, closes):
    file = opened("bench")
    params, commands = silent(file.params), np.zeros(60, COMMAND)
    commands["inlet"][20:40, 0] = 1.0
    params["bus"]["valve_delay_s"], params["bus"]["valve_skew_ratio"] = 10e-3, skew
    inlet = bus.bus_over_log(params, commands, 1e-3)[:, 6]
    assert np.flatnonzero(inlet > 0.5)[[0, -1]].tolist() == [20 + opens, 39 + closes]
    assert set(np.round(inlet, 9)) == {0.0, 1.0}


def test_a_supply_flow_that_has_faded_is_none():
    """Half a minute after the last draw no state is so small that a processor is slow with it."""
    file = load_plant(PLANTS / "knee.yaml")
    commands = log_commands(file, 30.0)
    state, out = plant.new_state(file.params), np.zeros(len(commands), SENSORS)
    plant.run(file.params, state, commands[:2100], 1e-3, file.substeps, out[:2100])
    assert state["smooth"][0, SUPPLY_FLOW] > 0.0
    plant.run(file.params, state, commands[2100:], 1e-3, file.substeps, out[2100:])
    assert state["smooth"][0, SUPPLY_FLOW] == 0.0
    sizes = np.abs(state["smooth"])
    assert np.all((sizes == 0.0) | (sizes > np.finfo(float).tiny))
