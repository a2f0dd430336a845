"""Frames through a row of slaves: every EtherCAT command with its address and working counter
arithmetic.

Source: ETG.1000.4 (commands, working counter: read +1, write +1, read-write write +2; logical
read-write +3 at most).
"""

from collections.abc import Callable, Sequence
from struct import pack_into

from sim_backend.bus import frame as ec
from sim_backend.bus.esc import Esc
from sim_backend.bus.logical import LogicalMap, Plan
from sim_backend.bus.registers import DC_SYSTEM_TIME

_AUTO = (ec.APRD, ec.APWR, ec.APRW, ec.ARMW)
_STATION = (ec.FPRD, ec.FPWR, ec.FPRW, ec.FRMW)
_BROADCAST = (ec.BRD, ec.BWR, ec.BRW)
_READS = {ec.APRD, ec.FPRD, ec.BRD}
_WRITES = {ec.APWR, ec.FPWR, ec.BWR}


class Segment:
    """The slaves that a frame passes, in order. ``on_outputs`` is called between the writes and the
    reads of a logical datagram, with its plan: there the plant moves.
    """

    def __init__(self, on_outputs: Callable[[Plan], None]):
        self.logical = LogicalMap()
        self.clock_escs: Sequence[Esc] = ()  # those with distributed clocks, reached or not
        self._escs: Sequence[Esc] = ()
        self._clocked: Sequence[Esc] = ()
        self._on_outputs = on_outputs

    def set_slaves(self, escs: Sequence[Esc]) -> None:
        self._escs = escs
        self._clocked = [esc for esc in escs if any(esc is other for other in self.clock_escs)]
        self.logical.set_slaves(escs)

    def run(self, frame: bytearray, datagrams: list[tuple[int, int, int, int, int]]) -> None:
        """Executes all datagrams of a frame in place."""
        for command, _, address, start, length in datagrams:
            if ec.LRD <= command <= ec.LRW:
                self._logical(frame, command, address, start, length)
            elif command != ec.NOP:
                self._physical(frame, command, address & 0xFFFF, address >> 16, start, length)

    def _logical(
        self, frame: bytearray, command: int, address: int, start: int, length: int
    ) -> None:
        plan = self.logical.plan(command, address, length)
        if plan.before:
            for copy, writing in plan.before:
                copy.write(frame, start) if writing else copy.read(frame, start)
        else:
            for copy in plan.writes:
                copy.write(frame, start)
        if command != ec.LRD:
            self._on_outputs(plan)
        for copy in plan.reads:
            copy.read(frame, start)
        _count(frame, start + length, plan.working_counter)

    def _is_clocked(self, station: int) -> bool:
        low, high = station & 0xFF, station >> 8
        others = len(self._escs) != len(self._clocked)
        return (
            others
            and sum(esc.memory[0x10] == low and esc.memory[0x11] == high for esc in self._escs) == 1
            and any(esc.memory[0x10] == low and esc.memory[0x11] == high for esc in self._clocked)
        )

    def _physical(
        self, frame: bytearray, command: int, position: int, offset: int, start: int, length: int
    ) -> None:
        end, counter = start + length, 0
        escs = self._escs
        if (
            command == ec.FRMW
            and DC_SYSTEM_TIME <= offset < DC_SYSTEM_TIME + 8
            and self._is_clocked(position)
        ):
            escs = self._clocked  # every cycle: the others have no such register
        for esc in escs:
            if command in _STATION:
                is_mine = (esc.memory[0x10] | esc.memory[0x11] << 8) == position
            else:
                is_mine = position == 0 or command in _BROADCAST
                position = (position + 1) & 0xFFFF
            if is_mine or command in (ec.ARMW, ec.FRMW):
                counter += _access(esc, frame, command, is_mine, offset, start, end)
        if command not in _STATION:
            frame[start - 8], frame[start - 7] = position & 0xFF, position >> 8
        _count(frame, end, counter)


def _access(
    esc: Esc, frame: bytearray, command: int, is_mine: bool, offset: int, start: int, end: int
) -> int:
    """One slave's part of a physical command; returns what it adds to the working counter."""
    if command in _READS or command in (ec.ARMW, ec.FRMW) and is_mine:
        data = esc.read(offset, end - start)
        if data is None:
            return 0
        _put(frame, start, data, command == ec.BRD)
        return 1
    if command in _WRITES or command in (ec.ARMW, ec.FRMW):
        return 1 if esc.write(offset, frame[start:end]) else 0
    written = bytes(frame[start:end])
    data = esc.read(offset, end - start)
    if data is not None:
        _put(frame, start, data, command == ec.BRW)
    return (data is not None) + (2 if esc.write(offset, written) else 0)


def _put(frame: bytearray, start: int, data: bytes, is_or: bool) -> None:
    if is_or:
        for i, byte in enumerate(data):
            frame[start + i] |= byte
    else:
        frame[start : start + len(data)] = data


def _count(frame: bytearray, place: int, more: int) -> None:
    """Adds to a working counter; it wraps as a 16-bit counter does."""
    if more:
        total = (frame[place] | frame[place + 1] << 8) + more
        pack_into("<H", frame, place, total & 0xFFFF)
