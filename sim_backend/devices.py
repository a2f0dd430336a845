"""The devices in front of the plant, compiled: terminals' bits and steps, the drive's CiA 402
machine.

Sources: EL3004/EL4034 12-bit conversion and status bits, IEC 61800-7-201 state machine, EPOS4
status word.
"""

import math

import numpy as np
from numba import njit

from epa_rt.config.devices import CONVERSION_S
from sim_backend.wiring import ADC_STEP_COUNTS

NOT_READY, SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP, FAULT_REACTION, FAULT = (
    range(8)
)
STATUS_WORDS = np.array([0x0200, 0x0250, 0x0231, 0x0233, 0x0237, 0x0217, 0x021F, 0x0218], np.int64)
POWER_UP_CYCLES = 20
STANDSTILL_RAD_S = 2.0
CONVERSION_NS = round(CONVERSION_S * 1e9)

MACHINE = np.dtype(
    [
        ("state", "i8"),
        ("age_cycles", "i8"),
        ("control", "i8"),
        ("error_code", "i8"),
        ("mode", "i8"),
    ],
    align=True,
)


@njit(cache=True)
def _get(image: np.ndarray, byte: int, size: int) -> int:
    if byte < 0:  # an entry that the drive has not mapped
        return 0
    value = 0
    for i in range(size):
        value |= np.int64(image[byte + i]) << (8 * i)
    half = np.int64(1) << (8 * size - 1)
    return value - 2 * half if value & half else value


@njit(cache=True)
def _put(image: np.ndarray, byte: int, size: int, value: float) -> None:
    limit = 2.0 ** (8 * size - 1)
    counts = np.int64(min(max(value, -limit), limit - 1.0))
    for i in range(size):
        image[byte + i] = (counts >> (8 * i)) & 0xFF


@njit(cache=True)
def _transition(machine, control: int, standstill: bool) -> None:  # noqa: C901
    """One step of the CiA 402 machine for a control word, transitions numbered as in IEC
    61800-7-201.
    """
    state = machine.state
    reset = control & 0x80 and not machine.control & 0x80
    machine.control = control
    machine.age_cycles += 1
    if state == NOT_READY:
        if machine.age_cycles > POWER_UP_CYCLES:
            machine.state = SWITCH_ON_DISABLED
    elif state == FAULT_REACTION:
        machine.state = FAULT
    elif state == FAULT:
        if reset:
            machine.state, machine.error_code = SWITCH_ON_DISABLED, 0
    elif not control & 0x02:  # disable voltage: transitions 7, 9, 10, 12
        machine.state = SWITCH_ON_DISABLED
    elif state == QUICK_STOP:
        pass  # option 6: it holds until its voltage is taken off
    elif not control & 0x04:  # quick stop: transitions 7, 10, 11
        machine.state = QUICK_STOP if state == ENABLED else SWITCH_ON_DISABLED
    elif not control & 0x01:  # shutdown: transitions 2, 6, 8
        machine.state = READY
    elif not control & 0x08:  # switch on, disable operation: transitions 3, 5
        if state != SWITCH_ON_DISABLED:
            machine.state = SWITCHED_ON
    elif state == READY:
        machine.state = SWITCHED_ON
    elif state == SWITCHED_ON:
        machine.state = ENABLED


@njit(cache=True)
def latch_outputs(outputs, valves, drives, machines, commands, standstill: bool) -> None:
    """Turns an output image into the plant's command: valve bits, drive state and targets."""
    command, drive, machine = commands[0], drives[0], machines[0]
    for i in range(valves.shape[0]):
        valve = valves[i]
        is_on = ((outputs[valve.byte] >> valve.bit) & 1) != valve.inverted
        if valve.exhaust:
            command.exhaust[valve.muscle] = 1.0 if is_on else 0.0
        else:
            command.inlet[valve.muscle] = 1.0 if is_on else 0.0
    if not drive.bus:
        _latch_analog(outputs, drive, machine, command)
        return
    _transition(machine, _get(outputs, drive.control_byte, 2) & 0xFFFF, standstill)
    wanted = _get(outputs, drive.mode_byte, 1)
    if wanted == 8 or wanted == 9 or wanted == 10:
        machine.mode = wanted
    command.enabled = 1.0 if machine.state == ENABLED or machine.state == QUICK_STOP else 0.0
    command.mode = machine.mode
    command.target_angle_rad = _get(outputs, drive.position_out_byte, 4) * drive.rad_per_count
    command.target_speed_rad_s = _get(outputs, drive.speed_out_byte, 4) * (2.0 * math.pi / 60.0)
    command.target_torque_nm = (
        _get(outputs, drive.torque_out_byte, 2) * 1e-3 * drive.rated_torque_nm
    )
    if machine.state == QUICK_STOP:
        command.mode, command.target_speed_rad_s = 9, 0.0


@njit(cache=True)
def _latch_analog(outputs, drive, machine, command) -> None:
    enable = (outputs[drive.enable_byte] >> drive.enable_bit) & 1
    if machine.state == NOT_READY:
        machine.age_cycles += 1
        if machine.age_cycles > POWER_UP_CYCLES:
            machine.state = SWITCH_ON_DISABLED
    elif machine.state != FAULT:
        machine.state = ENABLED if enable else SWITCH_ON_DISABLED
    counts = _get(outputs, drive.analog_byte, 2)
    converted = math.floor(counts / ADC_STEP_COUNTS) * ADC_STEP_COUNTS
    command.enabled = 1.0 if machine.state == ENABLED else 0.0
    command.mode = 9
    command.target_speed_rad_s = converted * drive.analog_rad_s_per_count


@njit(cache=True)
def sample_inputs(inputs, analog, drives, machines, ports, t_ns: int) -> bool:  # noqa: C901
    """Turns the plant's sensors (``ports``: f8 in the order of SENSORS) into an input image at time
    t_ns.

    False, with the image untouched, where a sensor is not a finite number: the plant has left its
    equations.
    """
    for i in range(ports.shape[0]):
        if not math.isfinite(ports[i]):
            return False
    toggle = (t_ns // CONVERSION_NS) & 1
    for i in range(analog.shape[0]):
        channel = analog[i]
        counts = 0.0
        if channel.port >= 0:
            counts = ports[channel.port] * channel.counts_per_si + channel.offset_counts
        counts = math.floor(counts / ADC_STEP_COUNTS + 0.5) * ADC_STEP_COUNTS
        status = toggle << 15
        if counts > 32767.0:
            status |= 0x42
        elif counts < -32768.0:
            status |= 0x41
        _put(inputs, channel.value_byte, 2, counts)
        if channel.status_byte >= 0:
            inputs[channel.status_byte] = status & 0xFF
            inputs[channel.status_byte + 1] = status >> 8
    drive, machine = drives[0], machines[0]
    word = STATUS_WORDS[machine.state]
    if drive.status_byte >= 0:
        inputs[drive.status_byte] = word & 0xFF
        inputs[drive.status_byte + 1] = word >> 8
    if drive.display_byte >= 0:
        inputs[drive.display_byte] = machine.mode
    if drive.error_byte >= 0:
        inputs[drive.error_byte] = machine.error_code & 0xFF
        inputs[drive.error_byte + 1] = machine.error_code >> 8
    if drive.position_byte >= 0:
        _put(inputs, drive.position_byte, 4, math.floor(ports[0] / drive.rad_per_count))
    if drive.speed_byte >= 0:
        _put(inputs, drive.speed_byte, 4, math.floor(ports[1] * (60.0 / (2.0 * math.pi)) + 0.5))
    if drive.current_byte >= 0:
        _put(inputs, drive.current_byte, 4, math.floor(ports[2] * 1e3 + 0.5))
    if drive.torque_byte >= 0:
        _put(inputs, drive.torque_byte, 2, math.floor(ports[3] / drive.rated_torque_nm * 1e3 + 0.5))
    return True
