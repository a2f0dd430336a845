"""Registers of the slave controllers that the master's library does not look after: watchdogs.

Source: Beckhoff ESC datasheet, section II (0x0400 watchdog divider, 0x0420 watchdog of process data, units of 40 ns).
"""

import struct

import pysoem

from epa_rt.backend import BackendError

WATCHDOG_DIVIDER, WATCHDOG_PROCESS_DATA = 0x0400, 0x0420
_DIVIDER, _TICK_S = 2498, 100e-6  # (2498 + 2) x 40 ns


def set_watchdog(slave: "pysoem.CdefSlave", label: str, seconds: float) -> None:
    """Outputs drop to safe after ``seconds`` without a frame. Written and read back; raises BackendError."""
    ticks = round(seconds / _TICK_S)
    for register, value in ((WATCHDOG_DIVIDER, _DIVIDER), (WATCHDOG_PROCESS_DATA, ticks)):
        try:
            slave._fpwr(register, struct.pack("<H", value))
            found = struct.unpack("<H", slave._fprd(register, 2))[0]
        except pysoem.WkcError:
            raise BackendError(f"{label} does not answer at register 0x{register:04X}, where its watchdog is set") from None
        if found != value:
            raise BackendError(f"found {found} in register 0x{register:04X} of {label}, expected {value}: its watchdog could not be set "
                               f"to {seconds * 1e3:g} ms")
