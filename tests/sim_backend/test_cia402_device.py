"""The simulated drive against the transition table of the power drive system (IEC 61800-7-201,
table 30 and figure 2).
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sim_rigs import Driven

from epa_rt.control.cia402 import DriveState, decode
from sim_backend import drive_machine as d
from sim_backend.drive_motion import STATUS_WORDS
from sim_backend.wiring import DRIVE

# a command word's meaning by bits 7, 3, 2, 1, 0; the standard's own patterns, x where it says any
PATTERNS = {
    "shutdown": "0x110",
    "switch on": "00111",
    "enable operation": "01111",
    "disable voltage": "0xx0x",
    "quick stop": "0x01x",
}
STOPPED, MOVING = True, False

# state -> command -> next; 'auto' is what the drive does of itself
TABLE = {
    d.SWITCH_ON_DISABLED: {"shutdown": d.READY},
    d.READY: {
        "switch on": d.SWITCHED_ON,
        "enable operation": d.SWITCHED_ON,
        "disable voltage": d.SWITCH_ON_DISABLED,
        "quick stop": d.SWITCH_ON_DISABLED,
    },
    d.SWITCHED_ON: {
        "enable operation": d.ENABLED,
        "shutdown": d.READY,
        "disable voltage": d.SWITCH_ON_DISABLED,
        "quick stop": d.SWITCH_ON_DISABLED,
    },
    d.ENABLED: {
        "switch on": d.SWITCHED_ON,
        "shutdown": d.READY,
        "disable voltage": d.SWITCH_ON_DISABLED,
        "quick stop": d.QUICK_STOP,
    },
    d.QUICK_STOP: {"disable voltage": d.SWITCH_ON_DISABLED},
    d.FAULT_REACTION: {},
    d.FAULT: {},
}


def meanings(control: int) -> str:
    bits = "".join(str(control >> i & 1) for i in (7, 3, 2, 1, 0))
    found = [
        name
        for name, pattern in PATTERNS.items()
        if all(p in ("x", b) for p, b in zip(pattern, bits, strict=True))
    ]
    assert len(found) == 1, (control, found)
    return found[0]


def machine_in(state: int, control: int = 0) -> np.record:
    machine = np.zeros(1, d.MACHINE).view(np.recarray)
    machine.state, machine.control, machine.error_code = state, control, 0x8611
    return machine


def drive_with(**options: float) -> np.record:
    drive = np.zeros(1, DRIVE)
    drive["bus"], drive["period_s"], drive["power_up_cycles"] = 1, 1e-3, 20
    drive["quick_stop"], drive["shutdown"], drive["disable"], drive["fault"] = 2, 1, 1, 2
    drive["deceleration_rad_s2"] = drive["quick_stop_rad_s2"] = 1000.0
    for name, value in options.items():
        drive[name] = value
    return drive[0]


def step(state: int, control: int, standstill: bool, before: int = 0, **options: float) -> int:
    machine = machine_in(state, before)
    machine.speed_rad_s = 0.5 if standstill else 100.0
    d.step(drive_with(**options), machine[0], control)
    return int(machine.state[0])


@pytest.mark.parametrize("state", list(TABLE))
@pytest.mark.parametrize("standstill", [STOPPED, MOVING])
def test_every_state_and_word_goes_where_the_standard_says(state, standstill):
    for control in range(0x80):
        meaning = meanings(control)
        expected = TABLE[state].get(meaning, state)
        if state == d.ENABLED:
            if standstill and meaning == "quick stop":
                expected = d.SWITCH_ON_DISABLED  # transition 12, the ramp is done
            elif not standstill and meaning in ("switch on", "shutdown"):
                expected = d.ENABLED  # until the ramp is done
        if state == d.FAULT_REACTION:
            expected = d.FAULT  # transition 14
        assert step(state, control, standstill) == expected, hex(control)
        assert step(state, control | 0x7F70, standstill) == expected, (
            "bits that belong to the mode change nothing"
        )


@pytest.mark.parametrize(
    ("before", "control", "after"),
    [
        (0x00, 0x80, d.SWITCH_ON_DISABLED),
        (0x80, 0x80, d.FAULT),
        (0x0F, 0x0F, d.FAULT),
        (0x00, 0x8F, d.SWITCH_ON_DISABLED),
        (0x80, 0x00, d.FAULT),
    ],
)
def test_a_fault_is_reset_on_the_rising_edge_of_bit_7_only(before, control, after):
    machine = machine_in(d.FAULT, before)
    d.step(drive_with(), machine[0], control)
    assert machine.state[0] == after and (machine.error_code[0] == 0) == (after != d.FAULT)


def test_status_words_mean_their_states():
    names = {
        d.NOT_READY: DriveState.NOT_READY,
        d.SWITCH_ON_DISABLED: DriveState.SWITCH_ON_DISABLED,
        d.READY: DriveState.READY,
        d.SWITCHED_ON: DriveState.SWITCHED_ON,
        d.ENABLED: DriveState.OPERATION_ENABLED,
        d.QUICK_STOP: DriveState.QUICK_STOP_ACTIVE,
        d.FAULT_REACTION: DriveState.FAULT_REACTION,
        d.FAULT: DriveState.FAULT,
    }
    for state, name in names.items():
        word = int(STATUS_WORDS[state])
        assert decode(word) is name
        assert bool(word & 0x10) == (state not in (d.NOT_READY,)), (
            "voltage enabled" if state != d.NOT_READY else ""
        )


def test_the_drive_is_not_ready_for_its_power_up_time_whatever_it_is_told():
    for word in (0x00, 0x06, 0x0F, 0x80):
        driven = Driven("bench")
        seen = [driven.cycle(cmd_drive_control_raw=word)["drive_status_raw"] for _ in range(25)]
        assert seen[:20] == [0x8200] * 20 and seen[20] == 0x8250


def test_the_mode_is_shown_and_mode_zero_keeps_the_one_before():
    driven = Driven("bench").enable(9)
    assert driven.cycle()["drive_mode_raw"] == 9
    driven.cycle(cmd_drive_mode_raw=0)
    assert driven.cycle()["drive_mode_raw"] == 9 and driven.plant_command["mode"] == 9


def test_targets_reach_the_plant_in_its_units():
    driven = Driven("bench").enable(8)
    driven.cycle(
        cmd_motor_travel_m=0.0062831853,
        cmd_motor_speed_m_s=0.06283185307,
        cmd_motor_torque_nm=-0.085,
    )
    command = driven.plant_command
    assert command["target_angle_rad"] == pytest.approx(
        19 * 0.1 * 2 * np.pi, abs=2e-3
    )  # a tenth of a turn of the spool
    assert command["target_speed_rad_s"] == pytest.approx(
        19 * 2 * np.pi, abs=0.06
    )  # one rpm is the step
    assert (
        command["target_torque_nm"] == pytest.approx(-0.085, abs=1e-4) and command["enabled"] == 1.0
    )


def test_disable_voltage_takes_the_current_off_at_once():
    driven = Driven("bench").enable(9)
    driven.cycles(100, cmd_motor_speed_m_s=0.05)
    driven.cycle(cmd_drive_control_raw=0x00)
    assert driven.plant_command["enabled"] == 0.0
    assert abs(driven.cycles(30)["motor_current_a"]) < 0.1


def test_a_drive_with_fewer_entries_takes_the_missing_ones_as_zero():
    from sim_rigs import edited

    on = edited(
        "bench",
        (
            "rated_torque: 170 mNm}",
            "rated_torque: 170 mNm, outputs: [control_word, mode, target_position]}",
        ),
        (
            (
                "  - name: cmd_motor_speed_m_s\n    entry: drive.target_speed\n    calibration:"
                " {native: [0 rpm, 1140 rpm], value: [0 mm/s, 62.83185307 mm/s]}\n    limits: [-80"
                " mm/s, 80 mm/s]\n    slew: 3 m/s^2\n"
            ),
            "",
        ),
        (
            (
                "  - name: cmd_motor_torque_nm\n    entry: drive.target_torque\n    calibration:"
                " {native: [0 permille, 1000 permille], value: [0 mNm, 170 mNm]}\n    limits: [-170"
                " mNm, 170 mNm]\n    slew: 10 Nm/s\n"
            ),
            "",
        ),
        ("  speed_target: cmd_motor_speed_m_s\n  torque_target: cmd_motor_torque_nm\n", ""),
    )
    driven = Driven(on).enable(8)
    driven.cycle(cmd_motor_travel_m=0.01)
    assert (
        driven.plant_command["target_speed_rad_s"]
        == driven.plant_command["target_torque_nm"]
        == 0.0
    )


EVENTS = st.one_of(
    st.integers(0, 0xFF).map(lambda word: ("word", word)),
    st.sampled_from([0x06, 0x07, 0x0F, 0x02, 0x00, 0x8F]).map(lambda word: ("word", word)),
    st.sampled_from([0x8611, 0x2310, d.STO_CODE]).map(lambda code: ("fail", code)),
    st.just(("alone", 0)),
    st.just(("supply", 0)),
)


@given(
    events=st.lists(st.tuples(EVENTS, st.floats(-300.0, 300.0)), max_size=40),
    options=st.tuples(*(st.sampled_from(c) for c in ((0, 1, 2, 5, 6), (0, 1), (0, 1), (0, 1, 2)))),
    lost_master=st.integers(0, 3),
)
def test_power_goes_where_it_must_and_a_ramp_never_rises(events, options, lost_master):
    names = ("quick_stop", "shutdown", "disable", "fault")
    drive = drive_with(
        lost_master=lost_master, rad_per_count=1e-3, **dict(zip(names, options, strict=True))
    )
    machine = machine_in(d.SWITCHED_ON)[0]
    d.step(drive, machine, 0x0F)
    assert d.is_powered(machine)
    for (event, value), speed in events:
        machine.speed_rad_s = speed
        braked, ramp = bool(machine.is_braking), abs(machine.ramp_rad_s)
        if event == "word":
            machine.is_alone = 0
            reacting = machine.state == d.FAULT_REACTION
            d.step(drive, machine, value)
            if not value & 0x02 and not reacting:
                assert not d.is_powered(machine)  # disable voltage
        elif event == "fail":
            d.fail(drive, machine, value)
            assert d.can_brake(value) or not d.is_powered(machine)
        elif event == "alone":
            d.lose_master(drive, machine)
            machine.is_alone = 1
            assert lost_master != 2 or machine.state not in (d.ENABLED, d.QUICK_STOP)
        else:
            d.lose_supply(drive, machine)
            assert not d.is_powered(machine) and not machine.is_referenced
        if braked and machine.is_braking:
            assert abs(machine.ramp_rad_s) <= ramp
        assert not machine.is_braking or d.is_powered(machine)
