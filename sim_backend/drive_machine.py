"""The drive's CiA 402 machine, compiled: commanded transitions, and how it stops of itself.

Sources: IEC 61800-7-201 (state machine, option codes 0x6007 and 0x605A to 0x605E), maxon EPOS4
firmware specification (device control, error handling).
"""

import math

import numpy as np

from sim_backend.compiled import compiled

NOT_READY, SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP, FAULT_REACTION, FAULT = (
    range(8)
)
POSITION_MODE, SPEED_MODE, TORQUE_MODE, HOMING_MODE = 8, 9, 10, 6
NOT_HOMED, SEEKING, ATTAINED, FAILED, RETURNING = range(5)  # what homing has come to
STANDSTILL_RAD_S = 2.0
LOST_MASTER_CODE = 0x8180
STO_CODE = 0x8A88

# option codes
NO_ACTION, FAULT_SIGNAL, DISABLE_VOLTAGE, QUICK_STOP_COMMAND = range(4)  # 0x6007
OFF_AT_ONCE, SLOW_DOWN, QUICK_STOP_RAMP = range(3)  # 0x605A to 0x605E
STAYS = 4  # added to 1 and 2 of 0x605A: 5 and 6 brake alike, then stay in quick stop

MACHINE = np.dtype(
    [
        ("state", "i8"),
        ("age_cycles", "i8"),
        ("control", "i8"),
        ("error_code", "i8"),
        ("mode", "i8"),
        ("is_alone", "i8"),  # without a master: no control word acts
        ("is_braking", "i8"),
        ("goes_to", "i8"),  # the state in which the ramp ends
        ("homing", "i8"),
        ("index_turn", "i8"),  # turns of the index pulse, in which homing seeks the next one
        ("is_referenced", "i8"),
        ("offset_counts", "i8"),  # of the count over the angle
        ("ramp_rad_s", "f8"),  # speed that it asks of its own loop
        ("ramp_rad_s2", "f8"),
        ("hold_angle_rad", "f8"),
        ("angle_rad", "f8"),  # of the shaft, as the drive has it
        ("speed_rad_s", "f8"),
    ],
    align=True,
)


@compiled
def is_powered(machine) -> bool:
    """Does the drive move its motor now?"""
    state = machine.state
    return state in (ENABLED, QUICK_STOP) or (state == FAULT_REACTION and machine.is_braking != 0)


@compiled
def step(drive, machine, control: int) -> None:
    """One cycle of the machine, with the control word that its master sends."""
    machine.age_cycles += 1
    if not machine.is_alone:
        _obey(drive, machine, control)
    _go_on(drive, machine)


@compiled
def _obey(drive, machine, control: int) -> None:
    """Commanded transitions, numbered as in IEC 61800-7-201."""
    state = machine.state
    reset = control & 0x80 and not machine.control & 0x80
    machine.control = control
    if state in (NOT_READY, FAULT_REACTION):
        return
    if state == FAULT:
        if reset:  # 15
            machine.state, machine.error_code = SWITCH_ON_DISABLED, 0
    elif not control & 0x02:  # disable voltage: 7, 9, 10, 12
        switch_off(machine, SWITCH_ON_DISABLED)
    elif state == ENABLED:
        _obey_enabled(drive, machine, control)
    elif state == QUICK_STOP:
        if control & 0x0F == 0x0F and drive.quick_stop > STAYS:  # 16
            machine.state, machine.is_braking = ENABLED, 0
    elif not control & 0x04:  # quick stop: 7, 10
        machine.state = SWITCH_ON_DISABLED
    elif not control & 0x01:  # shutdown: 2, 6
        machine.state = READY
    elif state != SWITCH_ON_DISABLED:  # switch on, enable operation: 3, 4
        enable = control & 0x08 and state == SWITCHED_ON
        machine.state = ENABLED if enable else SWITCHED_ON


@compiled
def _obey_enabled(drive, machine, control: int) -> None:
    if not control & 0x04:  # 11
        quick_stop(drive, machine)
    elif not control & 0x01:  # 8
        _stop(drive, machine, drive.shutdown, READY)
    elif not control & 0x08:  # 5
        _stop(drive, machine, drive.disable, SWITCHED_ON)
    else:
        machine.is_braking = 0  # told to go on before it had stopped


@compiled
def _go_on(drive, machine) -> None:
    """What the drive does of itself: it becomes ready, brakes on its ramp, ends its reaction."""
    if machine.is_braking:
        step_rad_s = machine.ramp_rad_s2 * drive.period_s
        left = max(abs(machine.ramp_rad_s) - step_rad_s, 0.0)
        machine.ramp_rad_s = math.copysign(left, machine.ramp_rad_s)
        if left == 0.0 and abs(machine.speed_rad_s) < STANDSTILL_RAD_S:
            switch_off(machine, machine.goes_to)
    elif machine.state == FAULT_REACTION:  # 14
        machine.state = FAULT
    elif machine.state == NOT_READY and machine.age_cycles > drive.power_up_cycles:  # 1
        machine.state = SWITCH_ON_DISABLED


@compiled
def switch_off(machine, state: int) -> None:
    """Into a state, without a ramp (any more); what is held from now on is this place."""
    machine.state, machine.is_braking = state, 0
    machine.hold_angle_rad = machine.angle_rad


@compiled
def _stop(drive, machine, option: int, goes_to: int) -> None:
    """Brakes on the ramp that an option code names, and goes to a state at standstill."""
    ramp = drive.quick_stop_rad_s2 if option == QUICK_STOP_RAMP else drive.deceleration_rad_s2
    if option == OFF_AT_ONCE or ramp <= 0.0:
        switch_off(machine, goes_to)
        return
    if not machine.is_braking:
        machine.ramp_rad_s = machine.speed_rad_s
    machine.is_braking, machine.goes_to, machine.ramp_rad_s2 = 1, goes_to, ramp


@compiled
def quick_stop(drive, machine) -> None:
    """By 0x605A: brakes, then goes to switch-on-disabled or stays and holds."""
    option = drive.quick_stop
    machine.state = QUICK_STOP
    if option > STAYS:
        _stop(drive, machine, option - STAYS, QUICK_STOP)
    else:
        _stop(drive, machine, option, SWITCH_ON_DISABLED)


@compiled
def fail(drive, machine, code: int) -> None:
    """A fault: braked by 0x605E where the drive still can, else without torque at once."""
    machine.error_code = code
    if machine.state in (FAULT, FAULT_REACTION):
        if not can_brake(code):
            machine.is_braking = 0
        return
    was_powered = is_powered(machine)
    if not drive.bus:  # without a bus it shows its fault at once
        switch_off(machine, FAULT)
        return
    machine.state = FAULT_REACTION
    if was_powered and drive.fault != OFF_AT_ONCE and can_brake(code):
        _stop(drive, machine, drive.fault, FAULT)
    else:
        machine.is_braking = 0


@compiled
def can_brake(code: int) -> bool:
    """Is the drive sound enough to brake after this error? Not where its current, voltage,
    hardware or sensor has failed, or STO has taken its power stage away.
    """
    group = code >> 12
    return not (group in (2, 3, 5, 7) or code == STO_CODE)


@compiled
def lose_master(drive, machine) -> None:
    """The bus has left OP: what the drive does then stands in 0x6007."""
    if not is_powered(machine) or drive.lost_master == NO_ACTION:
        return
    if drive.lost_master == FAULT_SIGNAL or not drive.bus:
        fail(drive, machine, LOST_MASTER_CODE)
    elif machine.state == FAULT_REACTION:
        return
    elif drive.lost_master == DISABLE_VOLTAGE:
        switch_off(machine, SWITCH_ON_DISABLED)
    elif machine.state == ENABLED:
        quick_stop(drive, machine)


@compiled
def lose_supply(drive, machine) -> None:
    """No torque, no reference; the count begins at zero where the shaft stands, once it is back."""
    switch_off(machine, NOT_READY)
    machine.age_cycles = machine.control = machine.error_code = machine.mode = 0
    machine.homing, machine.is_referenced = NOT_HOMED, 0
    machine.offset_counts = -np.int64(math.floor(machine.angle_rad / drive.rad_per_count))
