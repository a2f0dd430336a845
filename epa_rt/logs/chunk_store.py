"""The chunks of a log, unpacked when asked for; remembers which are damaged."""

from __future__ import annotations

import mmap
import os
import stat
import zlib
from collections.abc import Iterator

import numpy as np
from mcap.writer import MCAP0_MAGIC

from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.messages import messages_of
from epa_rt.logs.scan import ChunkEntry, LogError, scan, unpack
from epa_rt.logs.schema import CHANNEL_IDS, CYCLE, cycle_topics, row_dtype

_SAMPLES = CHANNEL_IDS[CYCLE]


class ChunkStore:
    """A scanned file. Raises LogError where there is none, or where it is not an MCAP file."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.view = _map(path)
        self.scan = scan(self.view)
        self._damaged: dict[int, str] = {}
        self._unpacked: set[int] = set()

    def set_layout(self, layout: SampleLayout) -> None:
        """Tell what a row of samples looks like."""
        self.topics = {topic.name: topic for topic in cycle_topics(layout)}
        self.row = row_dtype(list(self.topics.values()))
        self._prefix = np.zeros(1, self.row)
        first = self._prefix[CYCLE]["head"]
        first["opcode"], first["channel_id"], first["length"] = (
            5,
            _SAMPLES,
            self.row[CYCLE].itemsize - 9,
        )

    def rows_at_most(self) -> int:
        """A bound on the number of samples, without unpacking."""
        return sum(
            chunk.content_bytes // self.row.itemsize
            for chunk in self._with_samples()
            if not chunk.wrong
        )

    def rows(self) -> Iterator[np.ndarray]:
        """The samples, an array of rows for each chunk that is whole."""
        for chunk in self._with_samples():
            content = self._content(chunk)
            if content is not None:
                yield self._rows_of(content)

    def loose(self, channel_id: int) -> Iterator[tuple[int, bytes]]:
        """The messages of a channel that is not per cycle: `(t_ns, data)` each."""
        for chunk in self.scan.chunks:
            if _SAMPLES not in chunk.counts:
                content = self._content(chunk)
                if content is not None:
                    yield from messages_of(content, channel_id)

    def missing(self) -> list[str]:
        """What the file lacks, a sentence each. Checks all checksums."""
        for chunk in self.scan.chunks:
            if chunk.begin not in self._unpacked:
                self._content(chunk)
        sentences = [*self.scan.damage, *(self._damaged[begin] for begin in sorted(self._damaged))]
        end = self.scan.data_end_at
        if not sentences and end is not None and not self._data_section_whole(end):
            sentences.append(
                "a byte outside the chunks is damaged: the checksum of the data section differs"
            )
        return sentences if self.scan.has_footer else [*sentences, self._cut_sentence()]

    def _data_section_whole(self, end: int) -> bool:
        with memoryview(self.view) as view:
            return zlib.crc32(view[:end]) == self.scan.data_crc

    def _with_samples(self) -> list[ChunkEntry]:
        # A chunk whose index was cut off says nothing of its channels: it is looked into.
        return [chunk for chunk in self.scan.chunks if _SAMPLES in chunk.counts or not chunk.counts]

    def _content(self, chunk: ChunkEntry) -> bytes | None:
        self._unpacked.add(chunk.begin)
        try:
            return unpack(self.view, chunk)
        except ValueError as error:
            samples = chunk.counts.get(_SAMPLES)
            lost = (
                f"{samples} samples"
                if samples
                else "events and timing"
                if chunk.counts
                else "content unknown"
            )
            self._damaged[chunk.begin] = (
                f"the chunk at byte {chunk.begin} ({chunk.data_bytes} bytes: {lost} from"
                f" {_seconds(chunk.begin_ns)} to {_seconds(chunk.end_ns)}) is damaged and was left"
                f" out: {error}"
            )
            return None

    def _rows_of(self, content: bytes) -> np.ndarray:
        rows = np.frombuffer(content, self.row, len(content) // self.row.itemsize)
        heads, first = rows[CYCLE]["head"], self._prefix[CYCLE]["head"]
        fits = np.logical_and.reduce(
            [heads[name] == first[name] for name in ("opcode", "channel_id", "length")]
        )
        return rows if fits.all() else rows[: int(np.argmin(fits))]

    def _cut_sentence(self) -> str:
        size, torn_at, end = len(self.view), self.scan.torn_at, self.scan.data_end_at
        if end is not None:
            return (
                f"no footer: the file ends at byte {size}, within its summary; all messages are"
                " there"
            )
        torn = "it ends between two records"
        if torn_at is not None:
            torn = f"the last {size - torn_at} bytes, from byte {torn_at} on, are no whole record"
        last = self._last_sample()
        after = (
            f"after cycle {last[0]} (t = {_seconds(last[1])})"
            if last
            else "from the first cycle on"
        )
        return (
            f"no footer: the file was cut at byte {size}; {torn}; what was recorded {after} is"
            " missing"
        )

    def _last_sample(self) -> tuple[int, int] | None:
        for chunk in reversed(self._with_samples()):
            content = self._content(chunk)
            rows = self._rows_of(content) if content is not None else ()
            if len(rows):
                last = rows[-1][CYCLE]["body"]
                return int(last["cycle"]), int(last["t_ns"])
        return None


def _map(path: str) -> mmap.mmap:
    try:
        if stat.S_ISFIFO(os.stat(path).st_mode):  # opening it would wait for somebody to write
            raise LogError(f"{path}: found a pipe, expected a log that lies in a file")
        with open(path, "rb") as file:
            found = file.read(len(MCAP0_MAGIC))
            if found == MCAP0_MAGIC:
                return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except OSError as error:
        raise LogError(
            f"{path}: found {(error.strerror or str(error)).lower()}, expected a log"
        ) from None
    what = f"a file that begins with {found!r}" if found else "an empty file"
    raise LogError(f"{path}: found {what}, expected an MCAP log (it begins with {MCAP0_MAGIC!r})")


def _seconds(t_ns: int) -> str:
    return f"{t_ns / 1e9:.3f} s"
