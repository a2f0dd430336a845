"""Taking a terminal back into operation while the others run: a few datagrams at a time, with
process data in between.

pysoem's ``reconfig`` does it in one go, which may take longer than the other slaves' watchdogs
allow; and it restores sync managers and FMMUs only.

Source: ETG.1000.6 (AL control, status), ETG.1000.4 (registers of sync managers and FMMUs), SOEM's
own order of steps.
"""

import struct
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import pysoem

from drivers.registers import read_register
from drivers.words import ERROR, INIT, OP, PREOP, SAFEOP

_AL_CONTROL, _AL_STATUS, _EEPROM_CONTROL = 0x0120, 0x0130, 0x0500
_FMMU, _SYNC_MANAGER = 0x0600, 0x0800
_FMMU_COUNT, _SYNC_MANAGER_COUNT = 0x0004, 0x0005
_ACKNOWLEDGE = 0x10
_MAILBOXES = 2
_RECOVER_US = 500
_PATIENCE = 50  # looks at a state that does not come before it is asked for again


class Shape:
    """The registers that make up a slave's process data, as they were when the bus came up."""

    def __init__(self, slave: "pysoem.CdefSlave", label: str):
        """Raises BackendError where the slave does not answer."""
        read = partial(read_register, slave, label)
        counts = read(_FMMU_COUNT, 2)
        self._fmmus = [read(_FMMU + 16 * n, 16) for n in range(counts[0])]
        self._managers = [read(_SYNC_MANAGER + 8 * n, 8) for n in range(counts[1])]

    def write_mailboxes(self, slave: "pysoem.CdefSlave") -> None:
        self._write_managers(slave, range(min(_MAILBOXES, len(self._managers))))

    def write_process_data(self, slave: "pysoem.CdefSlave") -> None:
        self._write_managers(slave, range(_MAILBOXES, len(self._managers)))
        for n, fmmu in enumerate(self._fmmus):
            if fmmu[12]:  # active
                slave._fpwr(_FMMU + 16 * n, fmmu)

    def _write_managers(self, slave: "pysoem.CdefSlave", numbers: range) -> None:
        for n in numbers:
            start, length, control, _status, activate, _pdi = struct.unpack(
                "<HHBBBB", self._managers[n]
            )
            if start:
                slave._fpwr(
                    _SYNC_MANAGER + 8 * n,
                    struct.pack("<HHBBBB", start, length, control, 0, activate, 0),
                )


def take_back(
    slave: "pysoem.CdefSlave", shape: Shape, set_up: Sequence[Callable[[], object]]
) -> Iterator[None]:
    """One step per ``next``, each of a few datagrams or one object. Raises pysoem.WkcError where
    the slave is gone again.
    """
    while True:
        try:
            state = _state(slave)
            break
        except pysoem.WkcError:
            slave.recover(_RECOVER_US)
            yield
    if state & 0x0F not in (SAFEOP, OP):
        slave._fpwr(_EEPROM_CONTROL, b"\x01")  # some slaves need their EEPROM on the way to PREOP
        yield from _reach(slave, INIT)
        shape.write_mailboxes(slave)
        yield from _reach(slave, PREOP)
        for step in set_up:
            step()
            yield
        shape.write_process_data(slave)
    yield from _reach(slave, SAFEOP)
    yield from _reach(slave, OP)


def _reach(slave: "pysoem.CdefSlave", wanted: int) -> Iterator[None]:
    looks = 0
    while True:
        state = _state(slave)
        if state == wanted:
            return
        if state & ERROR or looks % _PATIENCE == 0:
            slave._fpwr(_AL_CONTROL, struct.pack("<H", wanted | _ACKNOWLEDGE))
        looks += 1
        yield


def _state(slave: "pysoem.CdefSlave") -> int:
    status: bytes = slave._fprd(_AL_STATUS, 2)
    return status[0] & 0x1F
