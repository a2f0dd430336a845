"""Logical addressing: FMMUs of all slaves turned into copy operations for one datagram, down to the
bit.

A plan is made once per (command, address, length) and thrown away when any FMMU, sync manager or
the wiring changes. Sources: ETG.1000.4 (FMMU registers 0x0600+16n, LRD/LWR/LRW and their working
counters).
"""

from collections.abc import Sequence
from struct import Struct
from typing import NamedTuple

from sim_backend.bus.esc import Esc
from sim_backend.bus.frame import LRD, LRW, LWR
from sim_backend.bus.registers import DIGITAL_OUTPUTS, FMMU, MEMORY_SIZE

_FMMU = Struct("<IHBBHBBB")
_PLANS = 64  # more different datagrams than this in a row: a fuzzer; start over


class ByteCopy(NamedTuple):
    """Whole bytes between datagram [at, at_end) and slave memory [place, place_end)."""

    memory: bytearray
    at: int
    at_end: int
    place: int
    place_end: int

    def write(self, frame: bytearray, base: int) -> None:
        self.memory[self.place : self.place_end] = frame[base + self.at : base + self.at_end]

    def read(self, frame: bytearray, base: int) -> None:
        frame[base + self.at : base + self.at_end] = self.memory[self.place : self.place_end]

    def zero(self, image: bytearray) -> None:
        image[self.at : self.at_end] = bytes(self.at_end - self.at)


class BitCopy(NamedTuple):
    """``bits`` bits between datagram bit ``at`` and memory bit ``place``; the bits around them stay
    as they are.
    """

    memory: bytearray
    at: int
    place: int
    bits: int

    def write(self, frame: bytearray, base: int) -> None:
        _copy_bits(frame, 8 * base + self.at, self.memory, self.place, self.bits)

    def read(self, frame: bytearray, base: int) -> None:
        _copy_bits(self.memory, self.place, frame, 8 * base + self.at, self.bits)

    def zero(self, image: bytearray) -> None:
        _copy_bits(bytes(self.bits // 8 + 2), 0, image, self.at, self.bits)


def _copy_bits(source: bytes | bytearray, at: int, target: bytearray, to: int, bits: int) -> None:
    mask = (1 << bits) - 1
    first, last = at >> 3, (at + bits + 7) >> 3
    value = (int.from_bytes(source[first:last], "little") >> (at & 7)) & mask
    first, last = to >> 3, (to + bits + 7) >> 3
    kept = int.from_bytes(target[first:last], "little") & ~(mask << (to & 7))
    target[first:last] = (kept | value << (to & 7)).to_bytes(last - first, "little")


class Plan(NamedTuple):
    """What one logical datagram does: writes first, then reads. ``before`` is the exact order,
    slave by slave, where a later slave writes what an earlier one has read into the datagram.
    ``written``: the slaves whose outputs it carries.
    """

    before: tuple
    writes: tuple[ByteCopy | BitCopy, ...]
    reads: tuple[ByteCopy | BitCopy, ...]
    working_counter: int
    written: tuple[Esc, ...]
    carries_all_outputs: bool


class LogicalMap:
    """Plans for the slaves that are on the wire now."""

    def __init__(self):
        self._plans: dict[tuple[int, int, int], Plan] = {}
        self._escs: Sequence[Esc] = ()

    def set_slaves(self, escs: Sequence[Esc]) -> None:
        self._escs = escs
        self._plans.clear()

    def forget(self) -> None:
        """FMMUs or sync managers have changed."""
        self._plans.clear()

    def plan(self, command: int, address: int, length: int) -> Plan:
        key = (command, address, length)
        plan = self._plans.get(key)
        if plan is None:
            if len(self._plans) >= _PLANS:
                self._plans.clear()
            plan = self._plans[key] = _make_plan(self._escs, command, address, length)
        return plan


def fmmus_of(esc: Esc) -> list[tuple[int, int, int, int]]:
    """Active FMMUs as (first logical bit, bits, first physical bit, direction: 1 read, 2 write)."""
    found = []
    for n in range(esc.fmmu_count):
        logical, length, start_bit, stop_bit, physical, physical_bit, direction, active = (
            _FMMU.unpack_from(esc.memory, FMMU + 16 * n)
        )
        bits = 8 * (length - 1) + (stop_bit & 7) - (start_bit & 7) + 1
        if active & 1 and length and bits > 0 and direction & 3:
            found.append(
                (
                    8 * logical + (start_bit & 7),
                    bits,
                    8 * physical + (physical_bit & 7),
                    direction & 3,
                )
            )
    return found


def _copies(esc: Esc, address: int, length: int, writing: bool) -> list[ByteCopy | BitCopy]:
    found = []
    for logical, bits, physical, direction in fmmus_of(esc):
        if not direction & (2 if writing else 1):
            continue
        first, last = max(logical, 8 * address), min(logical + bits, 8 * (address + length))
        if first >= last:
            continue
        place, at, count = physical + first - logical, first - 8 * address, last - first
        start, end = place >> 3, (place + count + 7) >> 3
        if (
            end > MEMORY_SIZE
            or writing
            and start < DIGITAL_OUTPUTS
            or not esc.sync_managers.lets_through(start, end, writing)
        ):
            continue
        if at & 7 or place & 7 or count & 7:
            found.append(BitCopy(esc.memory, at, place, count))
        else:
            found.append(ByteCopy(esc.memory, at >> 3, (at + count) >> 3, start, end))
    return found


def _range(copy: ByteCopy | BitCopy) -> tuple[int, int]:
    """The datagram bits that a copy touches."""
    if isinstance(copy, BitCopy):
        return copy.at, copy.at + copy.bits
    return 8 * copy.at, 8 * copy.at_end


def _make_plan(escs: Sequence[Esc], command: int, address: int, length: int) -> Plan:
    sequence, writes, reads, written, counter, all_writers = [], [], [], [], 0, 0
    tangled = False
    for esc in escs:
        writing = _copies(esc, address, length, True) if command in (LWR, LRW) else []
        reading = _copies(esc, address, length, False) if command in (LRD, LRW) else []
        tangled = tangled or any(
            a < d and c < b for a, b in map(_range, writing) for c, d in map(_range, reads)
        )
        sequence += [(copy, True) for copy in writing] + [(copy, False) for copy in reading]
        writes += writing
        reads += reading
        if writing:
            written.append(esc)
        counter += bool(reading) + bool(writing) * (2 if command == LRW else 1)
        all_writers += any(direction & 2 for *_, direction in fmmus_of(esc))
    carries_all = command != LRD and len(written) == all_writers
    return Plan(
        tuple(sequence) if tangled else (),
        tuple(writes),
        tuple(reads),
        counter,
        tuple(written),
        carries_all,
    )
