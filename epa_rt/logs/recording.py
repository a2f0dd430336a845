"""Ring slots to a log file: what the recorder process does with what it reads, free of process and
ring.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.mcap_file import CLOSING_BYTES, McapFile
from epa_rt.logs.ring import EVENT_HEAD, KIND_EVENT_END, KIND_SAMPLE
from epa_rt.logs.rows import RowBlock, loose_messages
from epa_rt.logs.schema import (
    CHANNEL_IDS,
    EVENT,
    TIMING,
    cycle_topics,
    descriptor_set,
    event_topic,
    message_class,
    timing_topic,
)
from epa_rt.logs.timing import TimingWindows

SAMPLES_PER_CHUNK = 2000
EVENTS_PER_CHUNK = 2000
_LOOSE_BYTES_PER_CHUNK = 4 << 20  # long texts cut a chunk earlier: a reader takes 64 MB at most
END_KIND = "end"
_STAMP_MAX = 2**64 - 1
_MOST_DIGITS = 20
LAYOUT_METADATA, OUTCOME_METADATA = "layout", "outcome"


@dataclass
class Ending:
    """How a recorded run ended; the log's `outcome` metadata. `failure`: what kept the recorder
    from recording all, '' where nothing did.
    """

    outcome: str
    cause: str
    lost_samples: int = 0
    lost_events: int = 0
    failure: str = ""
    end: str = ""  # how the rig was left, as measured


def ending_from(values: Mapping[str, str]) -> Ending:
    """The ending of a log's `outcome` metadata. Raises ValueError where it says none."""
    counts = {}
    for name in ("lost_samples", "lost_events"):
        text = values.get(name, "")
        if not (text.isascii() and text.isdigit() and len(text) < _MOST_DIGITS):
            raise ValueError(f"outcome: {name}: found {text!r:.40}, expected a number")
        counts[name] = int(text)
    if "outcome" not in values or "cause" not in values:
        raise ValueError("outcome: found no outcome or no cause, expected both")
    return Ending(
        values["outcome"],
        values["cause"],
        **counts,
        failure=values.get("failure", ""),
        end=values.get("end", ""),
    )


def ending_values(ending: Ending, samples: int, events: int) -> dict[str, str]:
    """The `outcome` metadata of a log that holds so many samples and events."""
    values = {key: str(value) for key, value in vars(ending).items()}
    return values | {"samples": str(samples), "events": str(events)}


@dataclass
class Counts:
    """What the file holds so far."""

    samples: int = 0
    events: int = 0
    last_cycle: int = 0
    last_t_ns: int = 0
    last_state: int = -1
    last_phase: int = -1
    pending: int = 0


class Tap(Protocol):
    """Who is given what a recording takes, in its order; a live view."""

    def rows(self, slots: np.ndarray) -> None: ...

    def event(self, cycle: int, t_ns: int, kind: str, text: str, data: dict[str, Any]) -> None: ...


class Recording:
    """Takes slots in order and writes them to `file` in chunks of a fixed number of samples.

    What is written depends on the slots and on nothing else, so equal runs give equal bytes; only
    `flush`, which the caller may call at any time, cuts a chunk short. Raises OSError where the
    disk does not take the bytes.
    """

    def __init__(self, file: McapFile, layout: SampleLayout, tap: Tap | None = None) -> None:
        self._file = file
        self._block = RowBlock(layout, SAMPLES_PER_CHUNK)
        self._event_class = message_class(event_topic())
        self._event_parts: list[bytes] = []
        self._loose: list[tuple[int, int, int, bytes]] = []
        self._loose_events = self._loose_bytes = 0
        self._timing = TimingWindows()
        self.counts = Counts()
        self.ending: Ending | None = None
        self.slots_taken = 0
        self._samples_taken = self._events_taken = 0
        self._is_discarding = False
        self._tap = tap

    @staticmethod
    def begin(
        file: McapFile,
        layout: SampleLayout,
        attachments: Mapping[str, bytes],
        metadata: Mapping[str, dict[str, str]],
    ) -> None:
        """Write all that comes before the first chunk, so that a cut file still explains itself."""
        for topic in [*cycle_topics(layout), event_topic(), timing_topic()]:
            file.channel(topic.channel_id, topic.name, topic.message_name, descriptor_set(topic))
        file.metadata(LAYOUT_METADATA, {"json": layout.to_json()})
        for name, values in metadata.items():
            file.metadata(name, values)
        for name, data in attachments.items():
            file.attachment(name, data)

    def feed(self, slots: np.ndarray) -> None:
        """Take slots from the ring: a structured array, valid only during the call."""
        begin = 0
        for other in np.flatnonzero(slots["kind"] != KIND_SAMPLE).tolist():
            self._samples(slots[begin:other])
            self.slots_taken += 1
            self._event_slot(slots[other : other + 1])
            begin = other + 1
        self._samples(slots[begin:])
        self.counts.pending = self._block.count + len(self._loose)

    def discard(self, slots: np.ndarray) -> None:
        """Take slots after the disk has refused: samples are counted as lost, events are kept for
        `write_ending_after`.
        """
        kinds = slots["kind"]
        is_sample = kinds == KIND_SAMPLE
        self._samples_taken += int(np.count_nonzero(is_sample))
        if self._tap is not None:  # the rig is still to be seen
            self._tap.rows(slots[is_sample])
        self._is_discarding = True
        for other in np.flatnonzero(kinds != KIND_SAMPLE).tolist():
            self._event_slot(slots[other : other + 1])
        self.slots_taken += len(slots)

    def event(self, cycle: int, t_ns: int, kind: str, text: str, data: dict[str, Any]) -> None:
        """Add an event to the current chunk."""
        if kind == END_KIND:
            # The loop says it after its last sample, and does not say when that was.
            cycle, t_ns = self.counts.last_cycle, self.counts.last_t_ns
            self.ending = Ending(
                str(data["outcome"]),
                text,
                int(data["lost_samples"]),
                int(data["lost_events"]),
                end=str(data["end"]),
            )
        # A stamp that protobuf cannot hold (cycle -1, before the first) must not cost the log.
        cycle, t_ns = (min(max(stamp, 0), _STAMP_MAX) for stamp in (cycle, t_ns))
        encoded = json.dumps(data)
        # A lone surrogate has no place in a protobuf string.
        kind, text = (value.encode(errors="replace").decode() for value in (kind, text))
        if self._tap is not None:
            self._tap.event(cycle, t_ns, kind, text, data)
        message = self._event_class(cycle=cycle, kind=kind, text=text, data=encoded)
        message_bytes = message.SerializeToString(deterministic=True)
        self._loose.append((CHANNEL_IDS[EVENT], cycle & 0xFFFFFFFF, t_ns, message_bytes))
        self._loose_events += 1
        self._loose_bytes += len(message_bytes)
        self._events_taken += 1
        if self._is_discarding:
            return
        if self._loose_events == EVENTS_PER_CHUNK or self._loose_bytes > _LOOSE_BYTES_PER_CHUNK:
            self.flush()

    def flush(self) -> None:
        """Write the samples taken so far as one chunk, and the events and timing as another, small
        one.

        Apart, because a reader that wants only the events then need not unpack the samples.
        """
        samples = self._block.samples
        self._add_timing(self._timing.add(samples))
        if len(samples):
            self._file.chunk(*self._block.messages())
            self.counts.samples += len(samples)
        self._block.clear()
        if self._loose:
            self._file.chunk(*loose_messages(self._loose))
            self.counts.events += self._loose_events
        self._file.sync()
        self._loose, self._loose_events, self._loose_bytes = [], 0, 0
        self.counts.pending = 0

    def finish(self) -> None:
        """Write what is left, the outcome, the summary and the footer."""
        self.flush()
        self._add_timing(self._timing.finish())
        self.flush()
        self.write_ending()

    def write_ending_after(self, failure: str) -> None:
        """Close the file after the disk refused: the newest events, and an outcome that says how
        many samples and events the file lacks and why. Raises OSError where no room was kept.
        """
        self._file.use_reserve()
        last = self._newest_events()
        if last:
            self._file.chunk(*loose_messages(last))
            self.counts.events += len(last)
        ending = self.ending or Ending("failed", f"recorder: {failure}")
        ending.lost_samples += self.samples_unsaved
        ending.lost_events += self.events_unsaved
        ending.failure = failure
        self.ending = ending
        self.write_ending()

    @property
    def samples_unsaved(self) -> int:
        """Samples taken and not in the file."""
        return self._samples_taken - self.counts.samples

    @property
    def events_unsaved(self) -> int:
        """Events taken and not in the file."""
        return self._events_taken - self.counts.events

    def _newest_events(self) -> list[tuple[int, int, int, bytes]]:
        """Those not in the file, as many as find room in what is kept for the end of it."""
        last: list[tuple[int, int, int, bytes]] = []
        room = CLOSING_BYTES // 2
        for message in reversed(self._loose):
            room -= len(message[3]) + 64  # with its head and its place in the index
            if room < 0:
                break
            if message[0] == CHANNEL_IDS[EVENT]:
                last.append(message)
        return last[::-1]

    def write_ending(self) -> None:
        """The outcome, the summary and the footer alone."""
        self._file.use_reserve()
        if self.ending is not None:
            values = ending_values(self.ending, self.counts.samples, self.counts.events)
            self._file.metadata(OUTCOME_METADATA, values)
        self._file.finish()

    def _samples(self, slots: np.ndarray) -> None:
        if len(slots):
            last, counts = slots[-1], self.counts
            counts.last_cycle, counts.last_t_ns = int(last["cycle"]), int(last["t_ns"])
            counts.last_state, counts.last_phase = int(last["state"]), int(last["phase"])
            if self._tap is not None:
                self._tap.rows(slots)
        while len(slots):
            taken = self._block.take(slots)
            slots = slots[taken:]
            self.slots_taken += taken
            self._samples_taken += taken
            if self._block.count == SAMPLES_PER_CHUNK:
                self.flush()

    def _event_slot(self, slot: np.ndarray) -> None:
        content = slot.tobytes()
        kind, length = EVENT_HEAD.unpack_from(content)
        self._event_parts.append(content[EVENT_HEAD.size : EVENT_HEAD.size + length])
        if kind == KIND_EVENT_END:
            encoded, self._event_parts = b"".join(self._event_parts), []
            # Not-a-number and infinity become their names: JSON proper, which other readers insist
            # on, has neither.
            cycle, t_ns, event_kind, text, data = json.loads(encoded, parse_constant=str)
            self.event(cycle, t_ns, event_kind, text, data)

    def _add_timing(self, messages: list[tuple[int, bytes]]) -> None:
        for t_ns, data in messages:
            self._loose.append((CHANNEL_IDS[TIMING], 0, t_ns, data))
