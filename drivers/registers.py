"""Registers of the slave controllers that the master's library does not look after.

Source: Beckhoff ESC datasheet, section II (0x0400 watchdog divider, 0x0420 watchdog of process
data, units of 40 ns; 0x0800 + 8n sync manager: start, length, control, status, activate; bit 6 of
control lets its data trigger the watchdog, and control and length can be written only while it is
off).
"""

import struct
from collections.abc import Callable

import pysoem

from drivers.asking import insist
from epa_rt.backend import BackendError

WATCHDOG_DIVIDER, WATCHDOG_PROCESS_DATA, SYNC_MANAGER = 0x0400, 0x0420, 0x0800
OUTPUTS, INPUTS = 2, 3  # sync managers of process data, where a slave has a mailbox
OUTPUTS_BARE = 0  # where it has none
_ANSWER_US = 50_000
_DIVIDER, _TICK_S = 2498, 100e-6  # (2498 + 2) x 40 ns
_LENGTH, _CONTROL, _ACTIVATE = 2, 4, 6  # of a sync manager
_TRIGGERS_WATCHDOG, _ENABLE = 0x40, 0x01


def set_watchdog(slave: "pysoem.CdefSlave", label: str, seconds: float) -> None:
    """Outputs drop to safe after ``seconds`` without a frame. Raises BackendError."""
    for register, data in _watchdog_times(seconds):
        _set(slave, label, register, data)


def set_watchdog_once(slave: "pysoem.CdefSlave", label: str, seconds: float) -> None:
    """The same while others run: nothing is asked again, and pysoem.WkcError is raised where the
    slave does not answer.
    """
    for register, data in _watchdog_times(seconds):
        slave._fpwr(register, data)
        _compare(label, register, data, slave._fprd(register, len(data)))


def _watchdog_times(seconds: float) -> tuple[tuple[int, bytes], ...]:
    return (WATCHDOG_DIVIDER, struct.pack("<H", _DIVIDER)), (
        WATCHDOG_PROCESS_DATA,
        struct.pack("<H", round(seconds / _TICK_S)),
    )


def arm_watchdog(slave: "pysoem.CdefSlave", label: str, sync_manager: int) -> None:
    """Has the outputs' sync manager trigger the watchdog, without which its times act on nothing:
    SOEM takes the control byte from the SII, where some terminals have the bit clear. In PREOP.
    Raises BackendError.
    """
    register = SYNC_MANAGER + 8 * sync_manager
    control, activate = (
        read_register(slave, label, register + at, 1)[0] for at in (_CONTROL, _ACTIVATE)
    )
    if control & _TRIGGERS_WATCHDOG:
        return
    _set(slave, label, register + _ACTIVATE, bytes([activate & ~_ENABLE]))
    _insist(
        lambda: slave._fpwr(register + _CONTROL, bytes([control | _TRIGGERS_WATCHDOG]), _ANSWER_US),
        label,
        register + _CONTROL,
    )
    _set(slave, label, register + _ACTIVATE, bytes([activate]))
    found = read_register(slave, label, register + _CONTROL, 1)[0]
    if found != control | _TRIGGERS_WATCHDOG:
        raise BackendError(
            f"found 0x{found:02X} in register 0x{register + _CONTROL:04X} of {label}, expected"
            f" 0x{control | _TRIGGERS_WATCHDOG:02X}: its outputs cannot arm its watchdog, so that"
            " they would stay on when the master is gone"
        )


def switch_off(slave: "pysoem.CdefSlave", label: str, sync_manager: int) -> None:
    """A sync manager without process data must be off; SOEM leaves it as the SII has it. Raises
    BackendError.
    """
    register = SYNC_MANAGER + 8 * sync_manager
    _set(slave, label, register + _ACTIVATE, bytes(1))
    _set(slave, label, register + _LENGTH, bytes(2))


def _set(slave: "pysoem.CdefSlave", label: str, register: int, data: bytes) -> None:
    """Written and read back."""

    def both() -> bytes:
        slave._fpwr(register, data, _ANSWER_US)
        answer: bytes = slave._fprd(register, len(data), _ANSWER_US)
        return answer

    _compare(label, register, data, _insist(both, label, register))


def _compare(label: str, register: int, data: bytes, found: bytes) -> None:
    if found != data:
        raise BackendError(
            f"found 0x{found[::-1].hex().upper()} in register 0x{register:04X} of {label}, "
            f"expected 0x{data[::-1].hex().upper()}"
        )


def read_register(slave: "pysoem.CdefSlave", label: str, register: int, size: int) -> bytes:
    """A register's bytes, asked for again where an answer gets lost. Raises BackendError."""
    return _insist(lambda: slave._fprd(register, size, _ANSWER_US), label, register)


def _insist(ask: Callable[[], bytes], label: str, register: int) -> bytes:
    try:
        return insist(ask)
    except (pysoem.WkcError, pysoem.PacketError):
        raise BackendError(f"{label} does not answer at register 0x{register:04X}") from None
