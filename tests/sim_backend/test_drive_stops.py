"""How the drive stops of itself: ramps and holds by its option codes, and what takes torque away at
once.
"""

import numpy as np
import pytest
from sim_rigs import Driven, edited

from sim_backend import drive_machine as d

RUNNING, HELD = 0x0F, 0x02
SPEED_M_S = 0.05
PERIODS = (2e-3, 1e-3, 0.5e-3, 0.25e-3)


def moving(mode: int = 9, on="bench", **options: int) -> Driven:
    """The bench's motor at 50 mm/s in a mode of the drive, with other option codes."""
    driven = Driven(on).enable(9)
    driven.cycles(round(0.2 / driven.rig.period_s), cmd_motor_speed_m_s=SPEED_M_S)
    for name, value in options.items():
        driven.model._drive[name] = value
    if mode == 8:
        travel = driven.decoder.measured["motor_travel_m"]
        driven.cycle(cmd_drive_mode_raw=8, cmd_motor_travel_m=travel)
        for _ in range(20):
            travel += SPEED_M_S * driven.rig.period_s
            driven.cycle(cmd_motor_travel_m=travel)
    elif mode == 10:
        driven.cycle(cmd_drive_mode_raw=10, cmd_motor_torque_nm=0.0)
    return driven


def state(driven: Driven) -> int:
    return int(driven.model.machine["state"][0])


def speeds(driven: Driven, cycles: int, **command: float) -> np.ndarray:
    """True speed of the motor's travel (m/s) in each cycle."""
    found = []
    for _ in range(cycles):
        driven.cycle(**command)
        found.append(driven.model.state["truth"]["travel_speed_m_s"][0])
    return np.array(found)


@pytest.mark.parametrize("mode", [8, 9, 10])
@pytest.mark.parametrize("word", [0x02, 0x06, 0x07])
def test_a_stop_brakes_on_its_ramp_in_every_mode(mode, word):
    driven = moving(mode)
    ramp = driven.rig.motor.stop_deceleration_si
    seen = speeds(driven, 200, cmd_drive_control_raw=word)
    slowest = int(np.argmax(seen < 0.2 * SPEED_M_S))
    assert slowest * 1e-3 == pytest.approx(0.8 * seen[0] / ramp, abs=0.006)
    assert np.abs(seen[-50:]).max() < 1e-3
    expected = {0x02: d.QUICK_STOP, 0x06: d.READY, 0x07: d.SWITCHED_ON}[word]
    assert state(driven) == expected
    assert driven.plant_command["enabled"] == float(expected == d.QUICK_STOP)


@pytest.mark.parametrize(
    ("code", "ends", "powered"),
    [
        (0, d.SWITCH_ON_DISABLED, 0.0),
        (1, d.SWITCH_ON_DISABLED, 0.0),
        (2, d.SWITCH_ON_DISABLED, 0.0),
        (5, d.QUICK_STOP, 1.0),
        (6, d.QUICK_STOP, 1.0),
    ],
)
def test_a_quick_stop_ends_as_its_option_code_says(code, ends, powered):
    driven = moving(quick_stop=code)
    driven.cycle(cmd_drive_control_raw=HELD)
    assert driven.plant_command["enabled"] == float(code != 0)
    driven.cycles(200)
    assert (state(driven), driven.plant_command["enabled"]) == (ends, powered)


def test_a_held_quick_stop_stands_against_a_muscle_that_fills():
    driven = moving()
    driven.cycles(300, cmd_drive_control_raw=HELD)
    stood = driven.model.state["truth"]["travel_m"][0]
    driven.cycles(3000, cmd_muscle_inlet_open=1.0, cmd_muscle_exhaust_open=0.0)
    assert driven.model.state["truth"]["muscle_force_n"][0, 0] > 20.0
    assert driven.model.state["truth"]["travel_m"][0] == pytest.approx(stood, abs=2e-4)
    driven.cycle(cmd_drive_control_raw=0x00)
    assert state(driven) == d.SWITCH_ON_DISABLED and driven.plant_command["enabled"] == 0.0


def test_told_to_go_on_before_it_has_stopped_it_goes_on():
    driven = moving()
    driven.cycles(5, cmd_drive_control_raw=0x07)
    assert state(driven) == d.ENABLED and driven.model.machine["is_braking"][0]
    seen = speeds(driven, 100, cmd_drive_control_raw=RUNNING)
    assert seen[-1] == pytest.approx(SPEED_M_S, abs=2e-3)


@pytest.mark.parametrize(("code", "braked"), [(0x8611, True), (0x8A88, False), (0x2310, False)])
def test_a_fault_is_braked_where_the_drive_still_can(code, braked):
    driven = moving()
    driven.model.fail_drive(code)
    assert driven.plant_command["enabled"] == float(braked)
    seen = speeds(driven, 200)
    if braked:
        assert np.abs(seen[-50:]).max() < 1e-3
    assert state(driven) == d.FAULT and driven.plant_command["enabled"] == 0.0
    assert driven.decoder.measured["drive_error_raw"] == code


def test_sto_ends_a_reaction_that_is_still_braking():
    driven = moving()
    driven.model.fail_drive(0x8611)
    driven.cycles(5)
    driven.model.fail_drive(0x8A88)
    assert driven.plant_command["enabled"] == 0.0
    driven.cycle()
    assert state(driven) == d.FAULT


@pytest.mark.parametrize(
    ("code", "first", "ends", "error"),
    [
        (0, d.ENABLED, d.ENABLED, 0),
        (1, d.FAULT_REACTION, d.FAULT, 0x8180),
        (2, d.SWITCH_ON_DISABLED, d.SWITCH_ON_DISABLED, 0),
        (3, d.QUICK_STOP, d.QUICK_STOP, 0),
    ],
)
def test_a_lost_master_is_answered_as_its_option_code_says(code, first, ends, error):
    driven = moving(lost_master=code)
    driven.model.lose_drive_master()
    driven.model.machine["is_alone"] = 1
    assert state(driven) == first
    # the word that still stands in the drive does not act
    driven.cycles(200, cmd_drive_control_raw=0x00)
    assert state(driven) == ends and driven.model.machine["error_code"][0] == error
    driven.model.machine["is_alone"] = 0
    driven.cycle()
    assert state(driven) == (d.FAULT if ends == d.FAULT else d.SWITCH_ON_DISABLED)


def test_a_lost_supply_takes_torque_count_and_reference():
    driven = moving()
    before = driven.decoder.measured["motor_travel_m"]
    assert before > 5e-3 and int(driven.decoder.measured["drive_status_raw"]) & 0x8000
    for _ in range(10):
        driven.model.lose_drive_supply()
        assert driven.plant_command["enabled"] == 0.0
        driven.cycle()
    stood = driven.model.machine["angle_rad"][0]
    measured = driven.cycles(40, cmd_drive_control_raw=0x00)
    assert int(measured["drive_status_raw"]) == 0x0250
    moved = driven.model.sensors["motor_angle_rad"][0] - stood
    assert measured["motor_travel_m"] == pytest.approx(moved * 0.010 / 19, abs=5e-5)


@pytest.mark.parametrize("period_s", PERIODS)
def test_ramps_and_power_up_take_their_time_at_every_period(period_s):
    on = edited("bench", ("period: 1 ms", f"period: {period_s * 1e3:g} ms"))
    driven = Driven(on)
    assert driven.model._drive["power_up_cycles"][0] == round(0.020 / period_s)
    driven = moving(on=on)
    cycles = round(0.1 / period_s)
    seen = speeds(driven, cycles, cmd_drive_control_raw=HELD)
    stopped = np.argmax(seen < 0.1 * SPEED_M_S) * period_s
    expected = 0.9 * seen[0] / on.motor.stop_deceleration_si
    assert stopped == pytest.approx(expected, abs=3e-3 + period_s)
