"""EtherCAT frames: where each datagram of an Ethernet frame stands, and how to build one.

Sources: ETG.1000.4 (frame, datagram, commands). Numbers are little-endian except the EtherType.
"""

from struct import Struct

ETHERTYPE = 0x88A4
NOP, APRD, APWR, APRW, FPRD, FPWR, FPRW, BRD, BWR, BRW, LRD, LWR, LRW, ARMW, FRMW = range(15)
COMMAND_NAMES = (
    "NOP",
    "APRD",
    "APWR",
    "APRW",
    "FPRD",
    "FPWR",
    "FPRW",
    "BRD",
    "BWR",
    "BRW",
    "LRD",
    "LWR",
    "LRW",
    "ARMW",
    "FRMW",
)
ETHERNET_HEADER = 14
FIRST_DATAGRAM = 16
DATAGRAM_HEADER = 10
MIN_FRAME = 60  # without the frame check sequence
MAX_FRAME = 1514

DATAGRAM = Struct(
    "<BBHHHH"
)  # command, index, address (position or station), offset, length and flags, interrupt
LOGICAL = Struct("<BBIHH")
_TAIL = Struct("<H")
_TYPE_AND_LENGTH = Struct("<H")
_MORE, _LENGTH = 0x8000, 0x07FF


def datagrams_of(
    frame: bytes | bytearray, limit: int | None = None
) -> list[tuple[int, int, int, int, int]] | None:
    """The datagrams of a frame, each (command, index, address, start of data, length); None where
    the frame is malformed.

    Every bound is checked before the first datagram is returned, so that a broken frame has no
    effect at all.
    """
    size = len(frame) if limit is None else limit
    if size < FIRST_DATAGRAM + DATAGRAM_HEADER + 2 or frame[12] != 0x88 or frame[13] != 0xA4:
        return None
    head = frame[14] | frame[15] << 8
    end = FIRST_DATAGRAM + (head & _LENGTH)
    if head >> 12 != 1 or end > size:
        return None
    found = []
    position = FIRST_DATAGRAM
    while True:
        start = position + DATAGRAM_HEADER
        if start + 2 > end:
            return None
        command, index, address, flags, _ = LOGICAL.unpack_from(frame, position)
        length = flags & _LENGTH
        position = start + length + 2
        if position > end or command > FRMW:
            return None
        found.append((command, index, address, start, length))
        if not flags & _MORE:
            return found


def build(
    datagrams: list[tuple[int, int, int, bytes]], source: bytes = b"\x01\x01\x01\x01\x01\x01"
) -> bytes:
    """An Ethernet frame from (command, index, address, data) rows; ``address`` is the 32-bit
    address field.
    """
    parts = []
    for n, (command, index, address, data) in enumerate(datagrams):
        flags = len(data) | (_MORE if n + 1 < len(datagrams) else 0)
        parts.append(LOGICAL.pack(command, index, address & 0xFFFFFFFF, flags, 0) + data + b"\0\0")
    body = b"".join(parts)
    frame = b"\xff" * 6 + source + b"\x88\xa4" + _TYPE_AND_LENGTH.pack(len(body) | 0x1000) + body
    return frame + bytes(max(0, MIN_FRAME - len(frame)))


def working_counter(frame: bytes | bytearray, datagram: tuple[int, int, int, int, int]) -> int:
    """The working counter behind a datagram's data."""
    return _TAIL.unpack_from(frame, datagram[3] + datagram[4])[0]


def physical(position: int, offset: int) -> int:
    """The address field of a physical command: auto-increment position or station address, and
    register.
    """
    return (position & 0xFFFF) | (offset << 16)
