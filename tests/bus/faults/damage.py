"""Ways to damage an EtherCAT frame; a source of random ones. No IO."""

import random
from struct import pack_into

ETHERNET_HEADER, FIRST_DATAGRAM, DATAGRAM_HEADER = 14, 16, 10


def flipped(frame: bytes, choice: random.Random) -> bytes:
    raw = bytearray(frame)
    for _ in range(choice.randrange(1, 6)):
        raw[choice.randrange(12, len(raw))] ^= 1 << choice.randrange(8)
    return bytes(raw)


def truncated(frame: bytes, choice: random.Random) -> bytes:
    return frame[: choice.randrange(1, len(frame))]


def lengthened(frame: bytes, choice: random.Random) -> bytes:
    return frame + choice.randbytes(choice.randrange(1, 1514 - len(frame)))


def other_index(frame: bytes, choice: random.Random) -> bytes:
    raw = bytearray(frame)
    raw[FIRST_DATAGRAM + 1] = choice.randrange(256)
    return bytes(raw)


def other_length(frame: bytes, choice: random.Random) -> bytes:
    raw = bytearray(frame)
    pack_into(
        "<H", raw, choice.choice((ETHERNET_HEADER, FIRST_DATAGRAM + 6)), choice.randrange(0x10000)
    )
    return bytes(raw)


def other_counter(frame: bytes, choice: random.Random) -> bytes:
    raw = bytearray(frame)
    length = (raw[FIRST_DATAGRAM + 6] | raw[FIRST_DATAGRAM + 7] << 8) & 0x07FF
    at = min(FIRST_DATAGRAM + DATAGRAM_HEADER + length, len(raw) - 2)
    pack_into("<H", raw, at, choice.randrange(0x10000))
    return bytes(raw)


def alien(frame: bytes, choice: random.Random) -> bytes:
    raw = bytearray(frame)
    raw[12:14] = choice.choice(
        (b"\x08\x00", b"\x86\xdd", b"\x08\x06", b"\x88\xcc", b"\x81\x00", choice.randbytes(2))
    )
    return bytes(raw)


def noise(frame: bytes, choice: random.Random) -> bytes:
    body = choice.randbytes(choice.randrange(1, 1500))
    return frame[:14] + body if choice.random() < 0.7 else choice.randbytes(14) + body


WAYS = {
    "bits flipped": flipped,
    "truncated": truncated,
    "lengthened": lengthened,
    "another index": other_index,
    "another length": other_length,
    "another working counter": other_counter,
    "alien type": alien,
    "noise": noise,
}


def damaged(frame: bytes, choice: random.Random) -> tuple[str, bytes]:
    """The way, and the frame."""
    way = choice.choice(tuple(WAYS))
    return way, WAYS[way](frame, choice)
