"""What the drive asks of its loops, compiled: its ramps and holds, homing, and the status word.

Sources: maxon EPOS4 firmware specification (homing mode, status word), CiA 402.
"""

import math

import numpy as np

from sim_backend.compiled import compiled
from sim_backend.drive_machine import (
    ATTAINED,
    ENABLED,
    FAILED,
    HOMING_MODE,
    NOT_HOMED,
    POSITION_MODE,
    QUICK_STOP,
    RETURNING,
    SEEKING,
    SPEED_MODE,
    TORQUE_MODE,
    is_powered,
)

STATUS_WORDS = np.array([0x0200, 0x0250, 0x0231, 0x0233, 0x0237, 0x0217, 0x021F, 0x0218], np.int64)
REFERENCED = 0x8000  # bit 15: position referenced to home
# of homing mode, by what homing has come to: bit 10 target reached, 12 attained, 13 error
HOMING_BITS = np.array([0x0400, 0x0000, 0x1400, 0x2400, 0x0000], np.int64)
INDEX_AT_NEGATIVE, INDEX_AT_POSITIVE, HERE = 33, 34, 37  # 0x6098
INDEX_PHASE_TURNS = 0.3  # where in the motor's turn the encoder's index pulse is
RETURN_GAIN = 20.0  # 1/s: back to the pulse, slow beside the speed loop
RETURNED_RAD, RETURNED_RAD_S = 0.005, 0.2  # three counts of 4096, and hardly moving
_START, _HALT = 0x10, 0x100  # bits of the control word


@compiled
def status_word(machine) -> int:
    """0x6041."""
    word = STATUS_WORDS[machine.state]
    if machine.is_referenced:
        word |= REFERENCED
    if machine.mode == HOMING_MODE:
        word |= HOMING_BITS[machine.homing]
    return word


@compiled
def position_counts(drive, machine, angle_rad: float) -> float:
    """0x6064 at an angle of the shaft."""
    return math.floor(angle_rad / drive.rad_per_count) + machine.offset_counts


@compiled
def choose_mode(machine, wanted: int) -> None:
    """0x6060; a mode that the drive does not know keeps the one before."""
    if wanted == machine.mode:
        return
    if wanted in (POSITION_MODE, SPEED_MODE, TORQUE_MODE, HOMING_MODE):
        machine.mode, machine.homing = wanted, NOT_HOMED
        machine.hold_angle_rad = machine.angle_rad


@compiled
def home(drive, machine, control: int, before: int) -> None:
    """Homing mode for one cycle: ``before`` is the control word of the last one."""
    if machine.state != ENABLED:
        if machine.homing in (SEEKING, RETURNING):
            machine.homing = NOT_HOMED
        if machine.state != QUICK_STOP:
            machine.hold_angle_rad = machine.angle_rad
        return
    if machine.homing in (SEEKING, RETURNING):
        if control & _HALT or not control & _START:  # interrupted
            machine.homing, machine.hold_angle_rad = NOT_HOMED, machine.angle_rad
        elif machine.homing == SEEKING:
            _seek(drive, machine)
        else:
            _return(drive, machine)
    elif control & _START and not before & _START and not control & _HALT:
        if drive.homing_method == HERE:
            _set_home(drive, machine, machine.angle_rad)
        elif drive.homing_method in (INDEX_AT_NEGATIVE, INDEX_AT_POSITIVE):
            machine.homing, machine.is_referenced, machine.ramp_rad_s = SEEKING, 0, 0.0
            machine.index_turn = _index_turn(machine.angle_rad)
        else:
            machine.homing = FAILED


@compiled
def _index_turn(angle_rad: float) -> int:
    return np.int64(math.floor(angle_rad / (2.0 * math.pi) - INDEX_PHASE_TURNS))


@compiled
def _seek(drive, machine) -> None:
    """Moves at the homing speed until the index pulse has passed; home is there."""
    turn = _index_turn(machine.angle_rad)
    if turn != machine.index_turn:
        if drive.has_index:
            passed = max(turn, machine.index_turn)
            _set_count(drive, machine, (passed + INDEX_PHASE_TURNS) * 2.0 * math.pi)
            machine.homing = RETURNING
            return
        machine.index_turn = turn
    speed = drive.homing_speed_rad_s
    _ramp_to(drive, machine, -speed if drive.homing_method == INDEX_AT_NEGATIVE else speed)


@compiled
def _return(drive, machine) -> None:
    """Brakes behind the index pulse and goes back to it; homing is attained there."""
    left, most = machine.hold_angle_rad - machine.angle_rad, drive.homing_speed_rad_s
    _ramp_to(drive, machine, min(max(RETURN_GAIN * left, -most), most))
    if abs(left) <= RETURNED_RAD and abs(machine.ramp_rad_s) <= RETURNED_RAD_S:
        machine.homing, machine.is_referenced = ATTAINED, 1


@compiled
def _ramp_to(drive, machine, speed_rad_s: float) -> None:
    step = drive.homing_rad_s2 * drive.period_s
    machine.ramp_rad_s += min(max(speed_rad_s - machine.ramp_rad_s, -step), step)


@compiled
def _set_home(drive, machine, angle_rad: float) -> None:
    """Home is here, without a motion."""
    _set_count(drive, machine, angle_rad)
    machine.homing, machine.is_referenced = ATTAINED, 1


@compiled
def _set_count(drive, machine, angle_rad: float) -> None:
    """The count at an angle becomes the home position; the shaft will be held there."""
    counts = np.int64(math.floor(angle_rad / drive.rad_per_count))
    machine.offset_counts = drive.home_counts - counts
    machine.hold_angle_rad = angle_rad


@compiled
def overrule(machine, command) -> None:
    """Power as the drive's state has it; in the place of targets what the drive does of itself."""
    command.enabled = 1.0 if is_powered(machine) else 0.0
    is_homing = machine.mode == HOMING_MODE and machine.homing in (SEEKING, RETURNING)
    if machine.is_braking or is_homing:
        command.mode, command.target_speed_rad_s = SPEED_MODE, machine.ramp_rad_s
    elif machine.state == QUICK_STOP or machine.mode == HOMING_MODE:
        command.mode, command.target_angle_rad = POSITION_MODE, machine.hold_angle_rad
        command.target_speed_rad_s = 0.0
