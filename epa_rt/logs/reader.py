"""Reads a log back: columns as arrays, events, timing, and in sentences what is missing."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from epa_rt.logs.chunk_store import ChunkStore
from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.messages import Event, MessageError, decode_event, decode_timing, timing_columns
from epa_rt.logs.recording import LAYOUT_METADATA, OUTCOME_METADATA, Ending, ending_from
from epa_rt.logs.scan import LogError
from epa_rt.logs.schema import CHANNEL_IDS, CYCLE, EVENT, TIMING

__all__ = ["Event", "LogError", "LogReader", "RecordedCycle"]


class RecordedCycle(NamedTuple):
    """One cycle as a replay wants it."""

    cycle: int
    t_ns: int
    flags: int
    lateness_ns: int
    busy_ns: int
    inputs_raw: bytes
    outputs_raw: bytes


class LogReader:
    """A log at `path`: whole, cut at any byte, or damaged. Raises LogError where it is no log.

    `layout`: the SampleLayout. `attachments`: bytes by name. `metadata`: string tables by name.
    Chunks are unpacked when they are asked for; those that are damaged are left out, and `missing`
    says so.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = os.fspath(path)
        self._store = ChunkStore(self.path)
        self.layout = self._read_layout()
        self._store.set_layout(self.layout)
        self.attachments: dict[str, bytes] = self._store.scan.attachments
        self.metadata: dict[str, dict[str, str]] = self._store.scan.metadata

    @property
    def ending(self) -> Ending | None:
        """How the run ended and what the recording lost; None where the file does not say, or not
        in words that can be read.
        """
        found = self.metadata.get(OUTCOME_METADATA)
        try:
            return None if found is None else ending_from(found)
        except ValueError:
            return None

    @property
    def outcome(self) -> str | None:
        """The word for how the run ended; None where the file does not say."""
        return self.ending.outcome if self.ending else None

    @property
    def topics(self) -> tuple[str, ...]:
        """The topics that have columns."""
        return (*self._store.topics, TIMING)

    def columns(self, topic: str, names: Sequence[str] | None = None) -> dict[str, np.ndarray]:
        """The columns of one topic, all or those named: N values each, raw images as uint8[N,
        bytes].

        Raises LogError for a topic or a name that the log does not have.
        """
        if topic != TIMING:
            return self.tables({topic: names})[topic]
        timing = self.timing()
        return {name: timing[name] for name in self._chosen(topic, timing, names)}

    def tables(
        self, wanted: Mapping[str, Sequence[str] | None]
    ) -> dict[str, dict[str, np.ndarray]]:
        """The columns of several per-cycle topics in one pass over the file; otherwise like
        `columns`.
        """
        rows_at_most = self._store.rows_at_most()
        tables: dict[str, dict[str, np.ndarray]] = {}
        for topic, names in wanted.items():
            body = self._body(topic)
            chosen = self._chosen(
                topic, [name for name in body.names or () if not name.startswith(".")], names
            )
            tables[topic] = {
                name: np.empty((rows_at_most, *body[name].shape), body[name].base)
                for name in chosen
            }
        filled = 0
        for rows in self._store.rows():
            for topic, columns in tables.items():
                for name, column in columns.items():
                    column[filled : filled + len(rows)] = rows[topic]["body"][name]
            filled += len(rows)
        return {
            topic: {name: column[:filled] for name, column in columns.items()}
            for topic, columns in tables.items()
        }

    def raw(self) -> tuple[np.ndarray, np.ndarray]:
        """The raw process images: inputs uint8[N, inputs_bytes] and outputs uint8[N,
        outputs_bytes].
        """
        columns = self.columns(CYCLE, ["inputs_raw", "outputs_raw"])
        return columns["inputs_raw"], columns["outputs_raw"]

    def iterate_cycles(self) -> Iterator[RecordedCycle]:
        """Every recorded cycle in order, with one chunk in memory at a time."""
        for rows in self._store.rows():
            body = rows[CYCLE]["body"]
            numbers = [body[name].tolist() for name in RecordedCycle._fields[:5]]
            images = [
                [image.tobytes() for image in body[name]] for name in RecordedCycle._fields[5:]
            ]
            yield from map(RecordedCycle, *numbers, *images)

    def events(self) -> list[Event]:
        """All events in order; those that cannot be decoded are left out, and `missing` says so."""
        found = []
        for place, t_ns, data in self._store.loose(CHANNEL_IDS[EVENT]):
            try:
                found.append(decode_event(t_ns, data))
            except MessageError as error:
                self._store.damaged(place, error)
        return found

    def timing(self) -> dict[str, np.ndarray]:
        """The statistics of each second of samples: N values each, histograms as [N, buckets]."""
        found = []
        for place, _, data in self._store.loose(CHANNEL_IDS[TIMING]):
            try:
                found.append(decode_timing(data))
            except MessageError as error:
                self._store.damaged(place, error)
        return timing_columns(found)

    def counts(self) -> dict[str, int]:
        """Messages by topic, as the chunks' indexes say."""
        counted = self._store.counted()
        return {topic: counted.get(CHANNEL_IDS[topic], 0) for topic in self._declared()}

    @property
    def has_end(self) -> bool:
        """Whether the file has the footer of a log that was closed."""
        return self._store.scan.has_footer

    @property
    def is_being_recorded(self) -> bool:
        """Whether the log had no end yet and its writer was there as it was opened."""
        return self._store.is_held and not self.has_end

    @property
    def torn_at(self) -> int | None:
        """The byte from which on there is no whole record; None where the last one is whole."""
        return self._store.scan.torn_at

    @property
    def missing(self) -> list[str]:
        """What a whole log would hold and this one does not, a sentence each; empty for a whole
        log.

        Checks every checksum of the file, so it takes as long as reading it.
        """
        self.events()  # first, as every verb reads them first: of a chunk the first sentence stands
        self.timing()
        there = self._store.check_content()
        sentences = self._store.lacks(checksums=True)
        return [*(sentences or self._other_counts(there)), *self._lost()]

    @property
    def missing_at_a_glance(self) -> list[str]:
        """As `missing`, as far as heads, summary and ending tell it; unpacks no samples."""
        return [*self._store.lacks(checksums=False), *self._lost()]

    def _lost(self) -> list[str]:
        """What the file says of its own ending: what the recorder lost."""
        ending = self.ending
        if ending is None and not self.has_end:
            return []  # that it was cut is said already
        if ending is None:
            known = OUTCOME_METADATA in self.metadata
            return [
                "the log says how the run ended in words that cannot be read"
                if known
                else "the log does not say how the run ended"
            ]
        if not (ending.lost_samples or ending.lost_events):
            return []
        lost = f"{ending.lost_samples} samples and {ending.lost_events} events"
        why = ending.failure or "the recorder could not keep up"
        return [f"{lost} were lost while recording: {why}"]

    def _other_counts(self, there: dict[int, int]) -> list[str]:
        """Whether as many samples and events are there as the file says that it was given."""
        said = self.metadata.get(OUTCOME_METADATA, {})
        for noun, topic in (("samples", CYCLE), ("events", EVENT)):
            found = there.get(CHANNEL_IDS[topic], 0)
            if said.get(noun, str(found)) != str(found):
                return [f"{found} {noun} are there, the log says itself {said[noun]:.20}"]
        return []

    def _declared(self) -> tuple[str, ...]:
        return (*self._store.topics, EVENT, TIMING)

    def close(self) -> None:
        """Give the file back; arrays already read stay valid."""
        self._store.view.close()

    def __enter__(self) -> LogReader:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _read_layout(self) -> SampleLayout:
        try:
            return SampleLayout.from_json(self._store.scan.metadata[LAYOUT_METADATA]["json"])
        except (KeyError, ValueError, TypeError):
            torn = self._store.scan.torn_at is not None or self._store.scan.damage
            found = (
                "a file cut or damaged in its head"
                if torn
                else "an MCAP file of another make, without a layout"
            )
            raise LogError(f"{self.path}: found {found}, expected a log of epa_rt") from None

    def _body(self, topic: str) -> np.dtype:
        if topic in self._store.topics:
            return self._store.row[topic]["body"]
        if topic in CHANNEL_IDS and topic not in (EVENT, TIMING):
            return np.dtype([])  # a group without signals
        raise LogError(
            f"{self.path}: found no columns for {topic!r}, expected one of {', '.join(self.topics)}"
        )

    def _chosen(self, topic: str, known: Iterable[str], names: Sequence[str] | None) -> list[str]:
        known = list(known)
        for name in names or ():
            if name not in known:
                raise LogError(
                    f"{self.path}: {topic}: found no column {name!r}, expected one of"
                    f" {', '.join(known)}"
                )
        return list(known if names is None else names)
