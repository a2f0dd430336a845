"""Is somebody else driving this bus, from another machine or with other software? Asked by reading
alone, before any slave is addressed or told a state.

One frame of our own (ETG.1000.4: BRD and APRD of AL status 0x0130 and code 0x0134, watchdog status
0x0440). Its index lies above those that SOEM takes for an answer of its own.
"""

import select
import socket
import struct
import time
from typing import NamedTuple

from drivers.words import ERROR, OP, SAFEOP, state_words
from epa_rt.backend import BackendError

_ETHERTYPE, _BRD, _APRD = 0x88A4, 7, 1
_AL_STATUS, _WATCHDOG_STATUS = 0x0130, 0x0440
_INDEX = 0xEA
_HEADER = b"\xff" * 6 + b"\x01" * 6 + struct.pack(">H", _ETHERTYPE)
_WATCHDOG_EXPIRED = 0x001B  # AL status code
_ANSWER_S, _TRIES = 0.05, 3
_EVERY_S = 0.02
_LONGER_S = 0.1  # than the watchdog: slaves take their time to fall


class Seen(NamedTuple):
    """One slave: AL state, AL status code, whether its process data watchdog is running."""

    state: int
    code: int
    is_fed: bool


def expect_no_master(interface: str, watchdog_s: float, take_over: bool) -> None:
    """Raises BackendError where slaves are in OP or SAFEOP, which is another master's work.

    A master that died leaves slaves in SAFEOP with a watchdog error, or none whose watchdog is
    running: that bus is free, and waited for as long as the watchdog takes. ``take_over``: nothing
    is asked.
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
    """Whether the watchdogs say that no process data come any more."""
    fell = any(s.state & ERROR and s.code == _WATCHDOG_EXPIRED for s in slaves)
    return fell or not any(s.is_fed for s in slaves)


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
            watchdog, _ = self._read(_APRD, -i & 0xFFFF, _WATCHDOG_STATUS, 2)
            if there:
                state, code = status[0] & 0x1F, int.from_bytes(status[4:6], "little")
                seen.append(Seen(state, code, bool(watchdog[0] & 1)))
        return seen

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
