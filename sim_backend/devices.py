"""The devices in front of the plant, compiled: terminals' bits and steps, the drive's entries.

Sources: conversion and status bits of epa_rt/config/terminals/, EPOS4 objects (drive_machine.py,
drive_motion.py).
"""

import math

import numpy as np

from sim_backend.analog_inputs import sample_channels
from sim_backend.bytes_of_image import get, put, put_word
from sim_backend.compiled import compiled
from sim_backend.drive_machine import (
    ENABLED,
    FAULT,
    FAULT_REACTION,
    HOMING_MODE,
    LOST_MASTER_CODE,
    MACHINE,
    NOT_READY,
    QUICK_STOP,
    READY,
    SPEED_MODE,
    STANDSTILL_RAD_S,
    SWITCH_ON_DISABLED,
    SWITCHED_ON,
    fail,
    lose_master,
    lose_supply,
    step,
)
from sim_backend.drive_motion import (
    STATUS_WORDS,
    choose_mode,
    home,
    overrule,
    position_counts,
    status_word,
)

__all__ = [
    "ENABLED",
    "FAULT",
    "FAULT_REACTION",
    "HOMING_MODE",
    "LOST_MASTER_CODE",
    "MACHINE",
    "NOT_READY",
    "QUICK_STOP",
    "READY",
    "STANDSTILL_RAD_S",
    "STATUS_WORDS",
    "SWITCHED_ON",
    "SWITCH_ON_DISABLED",
    "fail_drive",
    "latch_outputs",
    "lose_drive_master",
    "lose_drive_supply",
    "new_machine",
    "position_counts",
    "sample_inputs",
    "status_word",
]
_RPM = 2.0 * math.pi / 60.0


@compiled
def latch_outputs(outputs, valves, drives, machines, commands) -> None:
    """Turns an output image into the plant's command: valve bits, drive state and targets."""
    command, drive, machine = commands[0], drives[0], machines[0]
    for i in range(valves.shape[0]):
        valve = valves[i]
        is_on = ((outputs[valve.byte] >> valve.bit) & 1) != valve.inverted
        if valve.exhaust:
            command.exhaust[valve.muscle] = 1.0 if is_on else 0.0
        else:
            command.inlet[valve.muscle] = 1.0 if is_on else 0.0
    if drive.bus:
        _latch_bus(outputs, drive, machine, command)
    else:
        _latch_analog(outputs, drive, machine, command)


@compiled
def _latch_bus(outputs, drive, machine, command) -> None:
    control, before = get(outputs, drive.control_byte, 2) & 0xFFFF, machine.control
    step(drive, machine, control)
    if machine.is_alone:  # what it was told last goes on
        control = machine.control
    else:
        choose_mode(machine, get(outputs, drive.mode_byte, 1))
    if machine.mode == HOMING_MODE:
        home(drive, machine, control, before)
    command.mode = machine.mode
    command.target_angle_rad = (
        get(outputs, drive.position_out_byte, 4) - machine.offset_counts
    ) * drive.rad_per_count
    command.target_speed_rad_s = get(outputs, drive.speed_out_byte, 4) * _RPM
    command.target_torque_nm = get(outputs, drive.torque_out_byte, 2) * 1e-3 * drive.rated_torque_nm
    overrule(machine, command)


@compiled
def _latch_analog(outputs, drive, machine, command) -> None:
    enable = (outputs[drive.enable_byte] >> drive.enable_bit) & 1
    if machine.state == NOT_READY:
        machine.age_cycles += 1
        if machine.age_cycles > drive.power_up_cycles:
            machine.state = SWITCH_ON_DISABLED
    elif machine.state != FAULT:
        machine.state = ENABLED if enable else SWITCH_ON_DISABLED
    counts = get(outputs, drive.analog_byte, 2)
    converted = math.floor(counts / drive.analog_step) * drive.analog_step
    command.enabled = 1.0 if machine.state == ENABLED else 0.0
    command.mode = SPEED_MODE
    command.target_speed_rad_s = converted * drive.analog_rad_s_per_count


@compiled
def sample_inputs(inputs, analog, drives, machines, ports, t_ns: int) -> bool:
    """Turns the plant's sensors (``ports``: f8 in the order of SENSORS) into an input image at time
    t_ns.

    False, with the image untouched, where a sensor is not a finite number: the plant has left its
    equations.
    """
    for i in range(ports.shape[0]):
        if not math.isfinite(ports[i]):
            return False
    sample_channels(inputs, analog, ports, t_ns)
    _sample_drive(inputs, drives[0], machines[0], ports)
    return True


@compiled
def _sample_drive(inputs, drive, machine, ports) -> None:
    machine.angle_rad, machine.speed_rad_s = ports[0], ports[1]
    put_word(inputs, drive.status_byte, status_word(machine))
    if drive.display_byte >= 0:
        inputs[drive.display_byte] = machine.mode
    put_word(inputs, drive.error_byte, machine.error_code)
    put(inputs, drive.position_byte, 4, position_counts(drive, machine, ports[0]))
    put(inputs, drive.speed_byte, 4, math.floor(ports[1] * (60.0 / (2.0 * math.pi)) + 0.5))
    put(inputs, drive.current_byte, 4, math.floor(ports[2] * 1e3 + 0.5))
    put(inputs, drive.torque_byte, 2, math.floor(ports[3] / drive.rated_torque_nm * 1e3 + 0.5))


@compiled
def fail_drive(drives, machines, commands, code: int) -> None:
    """A fault of the drive between two cycles, with its error code (0x603F)."""
    fail(drives[0], machines[0], code)
    overrule(machines[0], commands[0])


@compiled
def lose_drive_master(drives, machines, commands) -> None:
    """The drive's bus has left OP."""
    lose_master(drives[0], machines[0])
    overrule(machines[0], commands[0])


@compiled
def lose_drive_supply(drives, machines, commands) -> None:
    """The drive has no supply in this cycle."""
    lose_supply(drives[0], machines[0])
    commands[0].enabled = 0.0


def new_machine(is_referenced: bool, offset_counts: int) -> np.ndarray:
    """A drive whose supply has just come, (1,) MACHINE."""
    machine = np.zeros(1, MACHINE)
    machine["is_referenced"], machine["offset_counts"] = is_referenced, offset_counts
    return machine
