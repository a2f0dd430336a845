"""Finds the records of an MCAP file from front to back, in whole, cut and damaged files alike."""

from __future__ import annotations

import io
import mmap
import struct
import zlib
from dataclasses import dataclass, field

import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from epa_rt.logs.damage import Damage

_RECORD_HEAD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQII4sQ")
_INDEX_HEAD = struct.Struct("<HI")
_OPCODES = {int(opcode) for opcode in Opcode}
# What every chunk has at the same place of its head: it finds the next chunk after damage.
_CHUNK_MARK = struct.pack("<I", 4) + b"zstd"
_CHUNK_MARK_AT = _RECORD_HEAD.size + 8 + 8 + 8 + 4
_INDEX_ENTRY_BYTES = 16
_CRC_BYTES, _FOOTER_BYTES = 4, 20
LARGEST_CONTENT = 64 << 20  # bytes of a chunk unpacked; the recorder's have one or two million
_LARGEST_ATTACHED = 64 << 20  # bytes of all attachments and metadata; the recorder's have some 1e5
_FRAME_HEAD_BYTES = 18  # of zstd, at most


class LogError(Exception):
    """The file cannot be read as a log; the message names file, found and expected."""


@dataclass
class ChunkEntry:
    """Where a chunk lies (bytes), when its messages were (ns), and how many each channel has where
    that is known.

    ``wrong``: why its head, which no checksum of its own covers, cannot be believed; '' where it
    can. Nothing is made by ``content_bytes`` before that.
    """

    begin: int
    data_begin: int
    data_bytes: int
    content_bytes: int
    content_crc: int
    begin_ns: int
    end_ns: int
    wrong: str = ""
    counts: dict[int, int] = field(default_factory=dict)


@dataclass
class Scan:
    """All that a file holds but the chunks' content. `damage` says what was passed over."""

    chunks: list[ChunkEntry] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    damage: Damage = field(default_factory=Damage)
    torn_at: int | None = None
    data_end_at: int | None = None
    data_crc: int = 0
    footer_at: int | None = None
    attached_bytes: int = 0

    @property
    def has_footer(self) -> bool:
        return self.footer_at is not None


def scan(view: mmap.mmap | bytes) -> Scan:
    """Walk the records of a file that begins with the MCAP magic."""
    found = Scan()
    at = len(MCAP0_MAGIC)
    while at < len(view) and not found.has_footer:
        end = _record_end(view, at)
        if end is None:
            chunk_at = _next_chunk(view, at + 1)
            if chunk_at is None:
                found.torn_at = at
                break
            found.damage.add(
                at, f"{chunk_at - at} bytes from byte {at} on are damaged and were passed over"
            )
            at = chunk_at
            continue
        try:
            _take(found, view, at, end)
        except (ValueError, struct.error, EndOfFile):
            found.damage.add(
                at, f"the record of {end - at} bytes at byte {at} is damaged and was passed over"
            )
        at = end
    return found


def unpack(view: mmap.mmap | bytes, chunk: ChunkEntry) -> bytes:
    """A chunk's content. Raises ValueError, with the reason, where the chunk is damaged."""
    if chunk.wrong:
        raise ValueError(chunk.wrong)
    data = view[chunk.data_begin : chunk.data_begin + chunk.data_bytes]
    try:
        content = zstandard.ZstdDecompressor().decompress(data, max_output_size=chunk.content_bytes)
    except (zstandard.ZstdError, MemoryError):
        raise ValueError("it cannot be unpacked") from None
    if len(content) != chunk.content_bytes or zlib.crc32(content) != chunk.content_crc:
        raise ValueError("its checksum differs")
    return content


def _record_end(view: mmap.mmap | bytes, at: int) -> int | None:
    """Where the record ends; None where there is no whole and credible record."""
    if at + _RECORD_HEAD.size > len(view):
        return None
    opcode, length = _RECORD_HEAD.unpack_from(view, at)
    end: int = at + _RECORD_HEAD.size + length
    if opcode not in _OPCODES or end > len(view):
        return None
    if opcode == Opcode.CHUNK:
        credible = (
            length >= _CHUNK_HEAD.size
            and view[at + _CHUNK_MARK_AT : at + _CHUNK_MARK_AT + 8] == _CHUNK_MARK
        )
        if (
            not credible
            or _CHUNK_HEAD.unpack_from(view, at + _RECORD_HEAD.size)[-1] + _CHUNK_HEAD.size
            != length
        ):
            return None
    return end


def _next_chunk(view: mmap.mmap | bytes, at: int) -> int | None:
    mark = at + _CHUNK_MARK_AT
    while (mark := view.find(_CHUNK_MARK, mark)) >= 0:
        begin = mark - _CHUNK_MARK_AT
        if view[begin] == Opcode.CHUNK and _record_end(view, begin) is not None:
            return begin
        mark += 1
    return None


def _take(found: Scan, view: mmap.mmap | bytes, at: int, end: int) -> None:
    body = at + _RECORD_HEAD.size
    opcode = view[at]
    if opcode == Opcode.CHUNK:
        begin_ns, end_ns, content_bytes, crc, _, _, data_bytes = _CHUNK_HEAD.unpack_from(view, body)
        data_begin = body + _CHUNK_HEAD.size
        wrong = _wrong_size(
            view[data_begin : min(data_begin + _FRAME_HEAD_BYTES, end)], content_bytes
        )
        found.chunks.append(
            ChunkEntry(at, data_begin, data_bytes, content_bytes, crc, begin_ns, end_ns, wrong)
        )
    elif opcode == Opcode.MESSAGE_INDEX and found.chunks:
        channel_id, index_bytes = _INDEX_HEAD.unpack_from(view, body)
        found.chunks[-1].counts[channel_id] = index_bytes // _INDEX_ENTRY_BYTES
    elif opcode == Opcode.ATTACHMENT:
        _count_attached(found, end - body)
        if zlib.crc32(view[body : end - 4]) != int.from_bytes(view[end - 4 : end], "little"):
            raise ValueError("checksum differs")
        attachment = records.Attachment.read(_stream(view, body, end))
        found.attachments[attachment.name] = attachment.data
    elif opcode == Opcode.METADATA:
        _count_attached(found, end - body)
        record = records.Metadata.read(_stream(view, body, end))
        found.metadata[record.name] = record.metadata
    elif opcode == Opcode.DATA_END:
        if end - body != _CRC_BYTES:
            raise ValueError("not as long as a data end")
        found.data_end_at, found.data_crc = at, int.from_bytes(view[body:end], "little")
    elif opcode == Opcode.FOOTER:
        if end - body != _FOOTER_BYTES:
            raise ValueError("not as long as a footer")
        if view[end : end + len(MCAP0_MAGIC)] == MCAP0_MAGIC:
            found.footer_at = at


def _count_attached(found: Scan, record_bytes: int) -> None:
    """Raises ValueError where the records that are kept would fill the memory."""
    if found.attached_bytes + record_bytes > _LARGEST_ATTACHED:
        raise ValueError("more than any log carries")
    found.attached_bytes += record_bytes


def _wrong_size(frame: bytes, content_bytes: int) -> str:
    """Why a chunk cannot have as many bytes as its head says; '' where it can. ``frame``: the
    beginning of what is packed.
    """
    try:
        packed = zstandard.frame_content_size(frame)  # -1 where the frame does not say it
    except zstandard.ZstdError:
        return "it cannot be unpacked"
    if packed not in (-1, content_bytes):
        return f"its head says {content_bytes} bytes, what is packed in it says {packed}"
    return (
        f"its head says {content_bytes} bytes, more than any chunk has"
        if content_bytes > LARGEST_CONTENT
        else ""
    )


def _stream(view: mmap.mmap | bytes, begin: int, end: int) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(view[begin:end]))
