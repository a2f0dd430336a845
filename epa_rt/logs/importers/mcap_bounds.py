"""Whether the chunks of an MCAP file say sizes that can be unpacked; nothing is unpacked for it."""

from __future__ import annotations

import struct
from typing import BinaryIO

import zstandard

_RECORD_HEAD = struct.Struct("<BQ")
_CHUNK = 6
_CHUNK_FIXED = struct.Struct("<QQQII")  # times, size unpacked, checksum, length of the name
_LONGEST_NAME = 16
_FRAME_HEAD_BYTES = 18  # of zstd, at most
_MAGIC_BYTES = 8
LARGEST_CHUNK = 64 << 20
"""Bytes of a chunk unpacked; writers cut theirs at one to four million."""


def oversized_chunk(file: BinaryIO, size: int) -> str | None:
    """What is wrong with the first chunk that is too large, to follow 'found'; None where none is.

    ``size``: the file's, in bytes. What is damaged otherwise is left to the reader.
    """
    at = _MAGIC_BYTES
    while at + _RECORD_HEAD.size <= size:
        file.seek(at)
        opcode, length = _RECORD_HEAD.unpack(file.read(_RECORD_HEAD.size))
        if opcode == _CHUNK and length >= _CHUNK_FIXED.size:
            unpacked = _unpacked_bytes(file)
            if unpacked > LARGEST_CHUNK:
                return (
                    f"a chunk at byte {at} of {unpacked} bytes unpacked, more than"
                    f" {LARGEST_CHUNK >> 20} MB"
                )
        at += _RECORD_HEAD.size + length
    return None


def _unpacked_bytes(file: BinaryIO) -> int:
    """What the head of a chunk says, or the frame in it where that says more."""
    head = file.read(_CHUNK_FIXED.size)
    if len(head) < _CHUNK_FIXED.size:
        return 0
    _, _, said, _, name_length = _CHUNK_FIXED.unpack(head)
    if file.read(min(name_length, _LONGEST_NAME)) != b"zstd":
        return said
    try:
        packed = zstandard.frame_content_size(file.read(8 + _FRAME_HEAD_BYTES)[8:])
    except zstandard.ZstdError:
        return said
    return max(said, packed)
