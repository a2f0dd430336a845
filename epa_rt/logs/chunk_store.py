"""The chunks of a log, unpacked when asked for; remembers what is damaged."""

from __future__ import annotations

import mmap
import os
import stat
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from mcap.writer import MCAP0_MAGIC

from epa_rt.config.kinds import begun, named
from epa_rt.config.near_names import did_you_mean
from epa_rt.logs.file_end import data_section_damage, end_damage
from epa_rt.logs.held import is_held
from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.messages import MessageError, messages_of
from epa_rt.logs.scan import ChunkEntry, LogError, scan, unpack
from epa_rt.logs.schema import CHANNEL_IDS, CYCLE, EVENT, TIMING, cycle_topics, row_dtype

_SAMPLES = CHANNEL_IDS[CYCLE]
_CHANNEL_AT = 9  # bytes of a message before its channel's number


class ChunkStore:
    """A scanned file. Raises LogError where there is none, or where it is not an MCAP file.

    ``is_held``: its writer was still there as it was scanned.
    """

    def __init__(self, path: str) -> None:
        self.path = path
        self.is_held = is_held(path)
        self.view = _map(path)
        self.scan = scan(self.view)

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
                yield self._rows_of(chunk, content)

    def loose(self, channel_id: int) -> Iterator[tuple[int, int, bytes]]:
        """The messages of a channel that is not per cycle: `(place, t_ns, data)` each. `place` is
        the byte where its chunk begins, for `damaged`.
        """
        for chunk in self.scan.chunks:
            if _SAMPLES not in chunk.counts:
                content = self._content(chunk)
                if content is not None:
                    yield from self._loose_of(chunk, content, channel_id)

    def damaged(self, place: int, error: MessageError) -> None:
        """Note that a message of the chunk at that byte cannot be used, and why."""
        self.scan.damage.add(place, f"the chunk at byte {place} {error}")

    def counted(self) -> dict[int, int]:
        """Messages by channel, as the chunks' indexes say; where a chunk has none, by looking."""
        counts: dict[int, int] = {}
        for chunk in self.scan.chunks:
            if not chunk.wrong:
                known = {} if self._index_is_cut(chunk) else chunk.counts
                for channel_id, count in (known or self._counts_in(chunk)).items():
                    counts[channel_id] = counts.get(channel_id, 0) + count
        return counts

    def check_content(self) -> dict[int, int]:
        """Unpack every chunk, compare its checksum and its index; gives the messages by channel
        that are there. What is wrong is in `lacks` afterwards.
        """
        counts: dict[int, int] = {}
        for chunk in self.scan.chunks:
            there = self._counts_in(chunk)
            known = {} if self._index_is_cut(chunk) else chunk.counts
            if known and there and there != known:
                self.scan.damage.add(
                    chunk.begin,
                    f"the index of the chunk at byte {chunk.begin} is damaged: it lists other"
                    " messages than the chunk holds",
                )
            for channel_id, count in there.items():
                counts[channel_id] = counts.get(channel_id, 0) + count
        return counts

    def lacks(self, checksums: bool) -> list[str]:
        """What is wrong with the file, a sentence each, as far as it has been read; with
        `checksums` also those of the data section.
        """
        sentences = [*self.scan.damage.sentences(), *end_damage(self.view, self.scan)]
        if checksums and not sentences:
            sentences = data_section_damage(self.view, self.scan)
        return sentences if self.scan.has_footer else [*sentences, self._cut_sentence()]

    def _index_is_cut(self, chunk: ChunkEntry) -> bool:
        """Whether the file was cut, perhaps among the records of this chunk's index."""
        return self.scan.data_end_at is None and chunk is self.scan.chunks[-1]

    def _counts_in(self, chunk: ChunkEntry) -> dict[int, int]:
        content = self._content(chunk)
        if content is None:
            return {}
        if self._begins_samples(content):
            rows = len(self._rows_of(chunk, content))
            return {topic.channel_id: rows for topic in self.topics.values()}
        counts = {}
        for channel_id in (CHANNEL_IDS[EVENT], CHANNEL_IDS[TIMING]):
            count = sum(1 for _ in self._loose_of(chunk, content, channel_id))
            if count:
                counts[channel_id] = count
        return counts

    def _loose_of(
        self, chunk: ChunkEntry, content: bytes, channel_id: int
    ) -> Iterator[tuple[int, int, bytes]]:
        if self._begins_samples(content):
            return
        try:
            for t_ns, data in messages_of(content, channel_id):
                yield chunk.begin, t_ns, data
        except MessageError as error:
            self.damaged(chunk.begin, error)

    def _begins_samples(self, content: bytes) -> bool:
        """Whether the first message is of `/cycle`."""
        return content[_CHANNEL_AT : _CHANNEL_AT + 2] == _SAMPLES.to_bytes(2, "little")

    def _with_samples(self) -> list[ChunkEntry]:
        # A chunk whose index was cut off says nothing of its channels: it is looked into.
        return [chunk for chunk in self.scan.chunks if _SAMPLES in chunk.counts or not chunk.counts]

    def _content(self, chunk: ChunkEntry) -> bytes | None:
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
            self.scan.damage.add(
                chunk.begin,
                f"the chunk at byte {chunk.begin} ({chunk.data_bytes} bytes: {lost} from"
                f" {_seconds(chunk.begin_ns)} to {_seconds(chunk.end_ns)}) is damaged and was left"
                f" out: {error}",
            )
            return None

    def _rows_of(self, chunk: ChunkEntry, content: bytes) -> np.ndarray:
        """The samples that a chunk holds; a chunk of events and timing holds none."""
        rows = np.frombuffer(content, self.row, len(content) // self.row.itemsize)
        heads, first = rows[CYCLE]["head"], self._prefix[CYCLE]["head"]
        fits = np.logical_and.reduce(
            [heads[name] == first[name] for name in ("opcode", "channel_id", "length")]
        )
        samples = rows if fits.all() else rows[: int(np.argmin(fits))]
        is_loose = not self._begins_samples(content)
        if len(samples) * self.row.itemsize != len(content) and not is_loose:
            self.scan.damage.add(
                chunk.begin,
                f"the chunk at byte {chunk.begin} holds bytes that are no sample, from byte"
                f" {len(samples) * self.row.itemsize} of what was packed on",
            )
        return samples

    def _cut_sentence(self) -> str:
        size, torn_at, end = len(self.view), self.scan.torn_at, self.scan.data_end_at
        if self.is_held:
            last = self._last_sample()
            until = f"up to cycle {last[0]} (t = {_seconds(last[1])})" if last else "no cycle yet"
            return f"still being recorded: {until} is read here, the file goes on"
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
            rows = None if content is None else self._rows_of(chunk, content)
            if rows is not None and len(rows):
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
        near = did_you_mean(Path(path)) if isinstance(error, FileNotFoundError) else ""
        is_folder = isinstance(error, IsADirectoryError)
        found_there = "a folder" if is_folder else (error.strerror or str(error)).lower()
        raise LogError(f"{path}: found {found_there}, expected a log{near}") from None
    what = (found and named(Path(path))) or begun(found)
    raise LogError(
        f"{path}: found {what}, expected an MCAP log; epa import makes one of other files"
    )


def _seconds(t_ns: int) -> str:
    return f"{t_ns / 1e9:.3f} s"
