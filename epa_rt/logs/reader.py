"""Reads a log back: columns as arrays, events, timing, and in sentences what is missing."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from epa_rt.logs.chunk_store import ChunkStore
from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.messages import Event, decode_event, decode_timing
from epa_rt.logs.recording import LAYOUT_METADATA, OUTCOME_METADATA, Ending
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

    def __init__(self, path: str | os.PathLike) -> None:
        self.path = os.fspath(path)
        self._store = ChunkStore(self.path)
        self.layout = self._read_layout()
        self._store.set_layout(self.layout)
        self.attachments: dict[str, bytes] = self._store.scan.attachments
        self.metadata: dict[str, dict[str, str]] = self._store.scan.metadata

    @property
    def ending(self) -> Ending | None:
        """How the run ended and what the recording lost; None where the file does not say."""
        found = self.metadata.get(OUTCOME_METADATA)
        if found is None:
            return None
        return Ending(
            found["outcome"],
            found["cause"],
            int(found["lost_samples"]),
            int(found["lost_events"]),
            found.get("end", ""),
        )

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
                topic, [name for name in body.names if not name.startswith(".")], names
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
        """All events in order."""
        return [decode_event(t_ns, data) for t_ns, data in self._store.loose(CHANNEL_IDS[EVENT])]

    def timing(self) -> dict[str, np.ndarray]:
        """The statistics of each second of samples: N values each, histograms as [N, buckets]."""
        return decode_timing([data for _, data in self._store.loose(CHANNEL_IDS[TIMING])])

    @property
    def missing(self) -> list[str]:
        """What a whole log would hold and this one does not, a sentence each; empty for a whole
        log.

        Checks every checksum of the file, so it takes as long as reading it.
        """
        sentences, ending = self._store.missing(), self.ending
        if ending and (ending.lost_samples or ending.lost_events):
            lost = f"{ending.lost_samples} samples and {ending.lost_events} events"
            sentences.append(f"{lost} were lost while recording: the recorder could not keep up")
        return sentences

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
