"""Is somebody else driving this bus, from another machine or with other software? Asked by reading
alone, before any slave is addressed or told a state.

Frames of our own (ETG.1000.4: BRD and APRD of AL status 0x0130 and code 0x0134, watchdog time
0x0420 and status 0x0440, sync managers 0x0800). Their index lies above those that SOEM takes for an
answer of its own.
"""

import select
import socket
import struct
import time
from typing import NamedTuple

from drivers.words import OP, SAFEOP, state_words
from epa_rt.backend import BackendError

_ETHERTYPE, _BRD, _APRD = 0x88A4, 7, 1
_AL_STATUS, _WATCHDOG_TIME, _WATCHDOG_STATUS = 0x0130, 0x0420, 0x0440
_SYNC_MANAGERS, _CONTROL, _ACTIVATE, _EACH, _COUNT = 0x0800, 4, 6, 8, 4
_TRIGGERS_WATCHDOG, _ENABLED = 0x40, 0x01
_INDEX = 0xEA
_HEADER = b"\xff" * 6 + b"\x01" * 6 + struct.pack(">H", _ETHERTYPE)
_ANSWER_S, _TRIES = 0.05, 3
_EVERY_S = 0.02
_LONGER_S = 0.1  # than the watchdog: slaves take their time to fall


class Seen(NamedTuple):
    """One slave: its AL state; whether its process data watchdog is fed, None where it has none in
    use, as a terminal of inputs alone.
    """

    state: int
    is_fed: bool | None


def expect_no_master(interface: str, watchdog_s: float, take_over: bool) -> None:
    """Raises BackendError where slaves are in OP or SAFEOP, which is another master's work.

    A master that died leaves no slave whose watchdog is fed: that bus is free, and waited for as
    long as the watchdog takes. ``take_over``: nothing is asked.
    """
    if take_over:
        return
    deadline = time.monotonic() + watchdog_s + _LONGER_S
    with _Asking(interface) as asking:
        while True:
            slaves = asking.slaves()
            busy = [i for i, s in enumerate(slaves, 1) if s.state in (SAFEOP, OP)]
            if not busy or is_abandoned(slaves):
                return
            if time.monotonic() > deadline:
                raise BackendError(
                    f"found slave {busy[0]} on {interface} in"
                    f" {state_words(slaves[busy[0] - 1].state)}, expected INIT or PREOP: another"
                    " master drives this bus, from another machine or with other software; end it,"
                    " or, if it is known to be dead, start with --take-over"
                )
            time.sleep(_EVERY_S)


def is_abandoned(slaves: list[Seen]) -> bool:
    """Whether the watchdogs say that no process data come any more: there is one, and none is fed.
    One slave that fell while others are fed has trouble of its own under a living master.
    """
    watchdogs = [s.is_fed for s in slaves if s.is_fed is not None]
    return bool(watchdogs) and not any(watchdogs)


class _Asking:
    """A raw socket for frames of our own, closed on the way out."""

    def __init__(self, interface: str):
        self._socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ETHERTYPE))
        self._socket.bind((interface, _ETHERTYPE))

    def __enter__(self) -> "_Asking":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def slaves(self) -> list[Seen]:
        """Every slave that answers; empty where nobody runs, or nobody is there."""
        data, count = self._read(_BRD, 0, _AL_STATUS, 6)
        if not data[0] & (SAFEOP | OP):
            return []
        seen = []
        for i in range(count):
            status, there = self._read(_APRD, -i & 0xFFFF, _AL_STATUS, 6)
            if there:
                seen.append(Seen(status[0] & 0x1F, self._is_fed(i)))
        return seen

    def _is_fed(self, slave: int) -> bool | None:
        """The watchdog of a slave by its place; the status of one that is not in use reads fed."""
        place = -slave & 0xFFFF
        time_set, _ = self._read(_APRD, place, _WATCHDOG_TIME, 2)
        managers, _ = self._read(_APRD, place, _SYNC_MANAGERS, _EACH * _COUNT)
        status, there = self._read(_APRD, place, _WATCHDOG_STATUS, 2)
        triggers = any(
            managers[at + _CONTROL] & _TRIGGERS_WATCHDOG and managers[at + _ACTIVATE] & _ENABLED
            for at in range(0, len(managers), _EACH)
        )
        if not there or not triggers or not any(time_set):
            return None
        return bool(status[0] & 1)

    def _read(self, command: int, address: int, register: int, size: int) -> tuple[bytes, int]:
        """Data and working counter; zeros where nothing comes back."""
        datagram = struct.pack("<BBHHHH", command, _INDEX, address, register, size, 0)
        body = datagram + bytes(size + 2)
        frame = _HEADER + struct.pack("<H", len(body) | 0x1000) + body
        for _ in range(_TRIES):
            self._socket.send(frame.ljust(60, b"\0"))
            deadline = time.monotonic() + _ANSWER_S
            while (left := deadline - time.monotonic()) > 0.0:
                if not select.select([self._socket], [], [], left)[0]:
                    break
                answer = self._socket.recv(1518)
                if len(answer) < 16 + len(body) or answer[16:18] != bytes([command, _INDEX]):
                    continue  # another master's
                if answer[20:22] != datagram[4:6]:
                    continue  # an older one of ours
                counter = int.from_bytes(answer[26 + size : 28 + size], "little")
                return answer[26 : 26 + size], counter
        return bytes(size), 0
