"""How many bytes a MAT file holds once it is unpacked, counted without keeping them."""

from __future__ import annotations

import os
import struct
import zlib
from typing import BinaryIO

from epa_rt.logs.importers.unpacked import check_unpacked

_HEADER_BYTES, _TAG_BYTES = 128, 8
_COMPRESSED = 15  # miCOMPRESSED of MAT version 5 to 7
_PIECE = 1 << 20
_ALWAYS_TAKEN = 32 << 20
_LARGEST_RATIO = 100.0
"""Unpacked to packed. Recorded numbers pack to a half or a tenth, zeros alone to a thousandth."""


def unpacked_bytes(file: BinaryIO) -> int:
    """Bytes of all elements of an open MAT file, packed ones as they are when unpacked.

    A file of another make or a damaged one is counted as far as it goes. Raises TooLarge.
    """
    size = file.seek(0, os.SEEK_END)
    file.seek(124)
    order = {b"IM": "<", b"MI": ">"}.get(file.read(4)[2:])
    if order is None:  # version 4 packs nothing
        return size
    at, total = _HEADER_BYTES, 0
    while at + _TAG_BYTES <= size:
        file.seek(at)
        kind, length = struct.unpack(order + "II", file.read(_TAG_BYTES))
        at += _TAG_BYTES + length
        total += (
            _inflated(file, min(length, size), total, size)
            if kind == _COMPRESSED
            else min(length, size)
        )
    return total


def _inflated(file: BinaryIO, length: int, before: int, size: int) -> int:
    unpacker, total = zlib.decompressobj(), 0
    while length > 0 and not unpacker.eof:
        piece = file.read(min(length, _PIECE))
        if not piece:
            break
        length -= len(piece)
        while piece and not unpacker.eof:
            try:
                total += len(unpacker.decompress(piece, _PIECE))
            except zlib.error:
                return total
            check_unpacked(before + total, size, _ALWAYS_TAKEN, _LARGEST_RATIO)
            piece = unpacker.unconsumed_tail
    return total
