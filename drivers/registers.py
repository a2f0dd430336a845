"""Registers of the slave controllers that the master's library does not look after.

Source: Beckhoff ESC datasheet, section II (0x0400 watchdog divider, 0x0420 watchdog of process data, units of 40 ns;
0x0800 + 8n sync manager: start, length, control, status, activate).
"""

import struct

import pysoem

from epa_rt.backend import BackendError

WATCHDOG_DIVIDER, WATCHDOG_PROCESS_DATA, SYNC_MANAGER = 0x0400, 0x0420, 0x0800
OUTPUTS, INPUTS = 2, 3  # sync managers of process data, where a slave has a mailbox
_TRIES, _ANSWER_US = 3, 50_000
_DIVIDER, _TICK_S = 2498, 100e-6  # (2498 + 2) x 40 ns


def set_watchdog(slave: "pysoem.CdefSlave", label: str, seconds: float) -> None:
    """Outputs drop to safe after ``seconds`` without a frame. Raises BackendError."""
    _set(slave, label, WATCHDOG_DIVIDER, struct.pack("<H", _DIVIDER))
    _set(slave, label, WATCHDOG_PROCESS_DATA, struct.pack("<H", round(seconds / _TICK_S)))


def switch_off(slave: "pysoem.CdefSlave", label: str, sync_manager: int) -> None:
    """A sync manager without process data must be off; SOEM leaves it as the SII has it. Raises BackendError."""
    register = SYNC_MANAGER + 8 * sync_manager
    _set(slave, label, register + 2, bytes(2))
    _set(slave, label, register + 6, bytes(1))


def _set(slave: "pysoem.CdefSlave", label: str, register: int, data: bytes) -> None:
    """Written and read back; asked again where an answer stays away."""
    for left in reversed(range(_TRIES)):
        try:
            slave._fpwr(register, data, _ANSWER_US)
            found = slave._fprd(register, len(data), _ANSWER_US)
            break
        except pysoem.WkcError:
            if not left:
                raise BackendError(f"{label} does not answer at register 0x{register:04X}") from None
    if found != data:
        raise BackendError(f"found 0x{found[::-1].hex().upper()} in register 0x{register:04X} of {label}, "
                           f"expected 0x{data[::-1].hex().upper()}")
