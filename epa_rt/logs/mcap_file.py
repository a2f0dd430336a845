"""An MCAP file written front to back: records, chunks given whole, and the summary at the end.

The `mcap` package encodes every record that there are few of. A chunk and its message indexes go
out in one write, so that a file cut anywhere holds whole chunks up to there.
"""

from __future__ import annotations

import errno
import os
import struct
import zlib
from collections.abc import Sequence

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from epa_rt.logs.disk_reserve import DiskReserve
from epa_rt.logs.held import hold

# Measured on a knee rig's samples: a sixth smaller than level 1, and a recorder still several times
# fast enough.
ZSTD_LEVEL = 2
CLOSING_BYTES = 65536
"""Kept for the last events, the outcome, and the summary's records that there is one of."""
_CHUNK_HEAD = struct.Struct("<BQQQQII4sQ")
_INDEX_HEAD = struct.Struct("<BQHI")


class McapFile:
    """Writes to `path`, which must be new or empty. Without `sync` the method of that name does
    nothing.

    All methods, and the making, raise OSError where the disk does not take the bytes.

    Room for the end of the file is kept on the disk all the time. After an OSError
    `drop_partial_record` cuts the file back to its last whole record; after `use_reserve` it may
    then be finished, with CLOSING_BYTES more than the summary.
    """

    def __init__(self, path: str, *, sync: bool) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o644)
        if os.fstat(self._fd).st_size:
            os.close(self._fd)
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), path)
        hold(self._fd)
        self._sync = sync
        self._reserve = DiskReserve(self._fd)
        self._is_closing = False
        self._summary_bytes = 0
        self.size = 0
        self._crc = 0
        self._schemas: list[records.Schema] = []
        self._channels: list[records.Channel] = []
        self._attachments: list[records.AttachmentIndex] = []
        self._metadata: list[records.MetadataIndex] = []
        self._chunks: list[records.ChunkIndex] = []
        self._message_counts: dict[int, int] = {}
        self._zstd = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
        self._append(MCAP0_MAGIC + _encode(records.Header(profile="", library="epa_rt")))

    def channel(
        self, channel_id: int, topic: str, message_name: str, descriptor_set: bytes
    ) -> None:
        """Declare a protobuf channel; its schema takes the channel's number."""
        schema = records.Schema(
            id=channel_id, data=descriptor_set, encoding="protobuf", name=message_name
        )
        channel = records.Channel(
            id=channel_id,
            topic=topic,
            message_encoding="protobuf",
            metadata={},
            schema_id=channel_id,
        )
        encoded = _encode(schema) + _encode(channel)
        self._summary_bytes += len(encoded)
        self._append(encoded)
        self._schemas.append(schema)
        self._channels.append(channel)

    def attachment(self, name: str, data: bytes) -> None:
        media_type = (
            "application/yaml" if name.endswith((".yaml", ".yml")) else "application/octet-stream"
        )
        # Times are zero: a reading of the clock would make two runs of one seed differ.
        encoded = _encode(records.Attachment(0, 0, name, media_type, data))
        index = records.AttachmentIndex(self.size, len(encoded), 0, 0, len(data), name, media_type)
        self._summary_bytes += len(_encode(index))
        self._append(encoded)
        self._attachments.append(index)

    def metadata(self, name: str, values: dict[str, str]) -> None:
        encoded = _encode(records.Metadata(name, values))
        index = records.MetadataIndex(self.size, len(encoded), name)
        self._summary_bytes += len(_encode(index))
        self._append(encoded)
        self._metadata.append(index)

    def chunk(self, content: bytes | memoryview, indexes: dict[int, np.ndarray]) -> None:
        """Write messages as one chunk. `indexes`: for each channel its messages' log_time and
        offset in `content`.
        """
        data = self._zstd.compress(content)
        begin_ns = min(int(index["log_time"].min()) for index in indexes.values())
        end_ns = max(int(index["log_time"].max()) for index in indexes.values())
        length = _CHUNK_HEAD.size - 9 + len(data)
        crc = zlib.crc32(content)
        head = _CHUNK_HEAD.pack(
            Opcode.CHUNK, length, begin_ns, end_ns, len(content), crc, 4, b"zstd", len(data)
        )
        parts = [head, data]
        offset = self.size + len(head) + len(data)
        offsets = {}
        for channel_id, index in indexes.items():
            offsets[channel_id] = offset
            parts += [
                _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + index.nbytes, channel_id, index.nbytes)
            ]
            parts += [index.tobytes()]
            offset += _INDEX_HEAD.size + index.nbytes
        chunk_bytes = len(head) + len(data)
        index_bytes = offset - self.size - chunk_bytes
        entry = records.ChunkIndex(
            chunk_bytes,
            self.size,
            "zstd",
            len(data),
            end_ns,
            index_bytes,
            offsets,
            begin_ns,
            len(content),
        )
        self._summary_bytes += len(_encode(entry))
        self._append(b"".join(parts))
        self._chunks.append(entry)
        for channel_id, index in indexes.items():
            self._message_counts[channel_id] = self._message_counts.get(channel_id, 0) + len(index)

    def sync(self) -> None:
        """Have the disk keep what was written, so that a power cut takes only what came later."""
        if self._sync:
            os.fdatasync(self._fd)

    def use_reserve(self) -> None:
        """From here on the end of the file is written: take the room that was kept for it."""
        self._is_closing = True

    def finish(self) -> None:
        """Write the summary and the footer."""
        self.use_reserve()
        data_end = _encode(records.DataEnd(self._crc))
        begin = self.size + len(data_end)
        summary, offsets = b"", []
        for opcode, group in self._summary_groups():
            encoded = b"".join(_encode(record) for record in group)
            if encoded:
                offsets.append(records.SummaryOffset(opcode, begin + len(summary), len(encoded)))
                summary += encoded
        offset_begin = begin + len(summary)
        summary += b"".join(_encode(offset) for offset in offsets)
        crc = zlib.crc32(summary + struct.pack("<BQQQ", Opcode.FOOTER, 20, begin, offset_begin))
        footer = _encode(records.Footer(begin, offset_begin, crc))
        self._append(data_end + summary + footer + MCAP0_MAGIC)
        self._reserve.give_back(self.size)
        self.sync()

    def drop_partial_record(self) -> None:
        """Cut off what a failed write left behind."""
        os.ftruncate(self._fd, self.size)
        os.lseek(self._fd, self.size, os.SEEK_SET)

    def close(self) -> None:
        """Give the descriptor back. May be called twice."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def _summary_groups(self) -> list[tuple[int, Sequence[records.McapRecord]]]:
        times = [(chunk.message_start_time, chunk.message_end_time) for chunk in self._chunks] or [
            (0, 0)
        ]
        statistics = records.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._message_counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._message_counts.values()),
            message_end_time=max(end for _, end in times),
            message_start_time=min(begin for begin, _ in times),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )
        return [
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ]

    def _append(self, data: bytes) -> None:
        if not self._is_closing:
            end = self.size + len(data) + self._summary_bytes + CLOSING_BYTES
            self._reserve.hold(self.size, end)
        view = memoryview(data)
        while view:
            view = view[os.write(self._fd, view) :]
        self.size += len(data)
        self._crc = zlib.crc32(data, self._crc)


def _encode(record: records.McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
