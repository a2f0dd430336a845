"""The loop's end of the recording: one pack into shared memory per cycle, and nothing that waits
for a disk.
"""

from __future__ import annotations

import json
import os
import struct
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.progress import ProgressSpec
from epa_rt.logs.recorder_child import RecorderChild
from epa_rt.logs.ring import (
    BYTES,
    EVENT_HEAD,
    EVENTS,
    FAILURE_BYTES,
    HEAD,
    HEADER_BYTES,
    KIND_EVENT_END,
    KIND_EVENT_PART,
    KIND_SAMPLE,
    LOST_EVENTS,
    LOST_SAMPLES,
    SAMPLES,
    TAIL,
    Ring,
    sample_format,
)

if TYPE_CHECKING:
    from epa_rt.logs.dead_recorder import Left

DEFAULT_SLOTS = 16384
RESERVED_METADATA = ("layout", "outcome")
_LIVENESS_EVERY = 64
_WAIT_S = 0.0002
_STUCK_AFTER_S = 60.0
_CACHE_LINE_BYTES = 64


class RecorderError(Exception):
    """The log could not be opened."""


@dataclass(frozen=True)
class LogSummary:
    """What became of a recording. `samples` and `events` are those in the file, `lost_samples` and
    `lost_events` those that found no room in the ring or on the disk; `size_bytes` is the file's
    size.
    """

    path: str
    outcome: str
    cause: str
    samples: int
    events: int
    lost_samples: int
    lost_events: int
    size_bytes: int
    failure: str | None


class Recorder:
    """Records samples and events to an MCAP file at `path` through a process of its own.

    `attachments` are files by name, `metadata` are string tables by name (`layout` and `outcome`
    are taken). With `lossless` the recorder waits when the ring is full, as a simulation may;
    without, it drops the sample, counts it, and reports a `failure`. `may_wait`: it waits there
    too, for a simulation in real time, whose plant stands still meanwhile. `asks_fd`: a socket on
    which the recorder passes on what viewers of the run ask for. Raises ValueError for a metadata
    name that is taken.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        layout: SampleLayout,
        attachments: Mapping[str, bytes],
        metadata: Mapping[str, Mapping[str, str]],
        lossless: bool,
        progress: ProgressSpec | None = None,
        *,
        slots: int = DEFAULT_SLOTS,
        asks_fd: int | None = None,
        may_wait: bool = False,
    ) -> None:
        for name in RESERVED_METADATA:
            if name in metadata:
                raise ValueError(
                    f"recorder: found metadata {name!r}, expected another name: the log uses it"
                    " itself"
                )
        self._path, self._waits, self._attachments = (
            os.path.abspath(path),
            lossless or may_wait,
            dict(attachments),
        )
        self._job = {
            "path": self._path,
            "layout": layout.to_json(),
            "lossless": lossless,
            "metadata": {name: dict(values) for name, values in metadata.items()},
            "progress": asdict(progress) if progress else None,
            "asks_fd": asks_fd,
        }
        packing = struct.Struct(sample_format(layout))
        self._pack = packing.pack_into
        self._inputs_bytes, self._outputs_bytes = layout.inputs_bytes, layout.outputs_bytes
        self._slots = slots
        self._slot_bytes = -(-packing.size // _CACHE_LINE_BYTES) * _CACHE_LINE_BYTES
        self._head = self._limit = 0
        self._lost_samples = self._lost_events = 0
        self._events = self._event_slots = 0
        self._stuck = False
        self._failure: str | None = None
        self._countdown = _LIVENESS_EVERY
        self._summary: LogSummary | None = None

    def open(self) -> None:
        """Start the recorder process and wait until the file is open. Raises RecorderError.

        To be called before the loop's process takes real-time priority: starting a process is slow.
        """
        try:
            self._ring = Ring.create(self._slots, self._slot_bytes)
            self._memory, self._words, self._limit = (
                self._ring.memory,
                self._ring.words,
                self._slots,
            )
            self._child = RecorderChild(self._ring, self._job, self._attachments)
        except OSError as error:
            raise RecorderError(f"recorder: cannot start: {error.strerror or error}") from None
        trouble = self._child.wait_until_open()
        if trouble:
            self._child.finish()
            raise RecorderError(trouble)

    def sample(
        self,
        cycle: int,
        t_ns: int,
        flags: int,
        state: int,
        phase: int,
        lateness_ns: int,
        busy_ns: int,
        invalid_mask: int,
        stale_mask: int,
        inputs_raw: bytes,
        outputs_raw: bytes,
        measured: Mapping[str, float],
        reference: Mapping[str, float],
        command: Mapping[str, float],
        estimate: Mapping[str, float],
    ) -> None:
        """Record one cycle. The mappings hold the layout's names in the layout's order.

        Raises ValueError where a raw image has not the layout's size, struct.error where the number
        of values or the range of an integer does not fit.
        """
        if len(inputs_raw) != self._inputs_bytes or len(outputs_raw) != self._outputs_bytes:
            raise ValueError(
                f"recorder: found raw images of {len(inputs_raw)} and {len(outputs_raw)} bytes, "
                f"expected {self._inputs_bytes} and {self._outputs_bytes}"
            )
        head = self._head
        if head >= self._limit and not self._has_room(1, self._waits):
            self._lost_samples += 1
            self._countdown = 0  # looked at when the loop asks next
            return
        self._pack(
            self._memory,
            HEADER_BYTES + head % self._slots * self._slot_bytes,
            KIND_SAMPLE,
            flags,
            state,
            phase,
            cycle,
            t_ns,
            lateness_ns,
            busy_ns,
            invalid_mask,
            stale_mask,
            inputs_raw,
            outputs_raw,
            *measured.values(),
            *reference.values(),
            *command.values(),
            *estimate.values(),
        )
        # Published last: the recorder never sees half a slot.
        self._head = self._words[HEAD] = head + 1

    def event(self, cycle: int, t_ns: int, kind: str, text: str, /, **data: object) -> None:
        """Record something that happened, at `t_ns` of the run's clock.

        `data` becomes JSON: numpy numbers and arrays as numbers and lists, what JSON has no form
        for as a string.
        """
        self._post_event(cycle, t_ns, kind, text, data, self._waits)

    @property
    def pid(self) -> int:
        """The recorder's process."""
        return self._child.pid

    @property
    def failure(self) -> str | None:
        """What is wrong with the recording, or None. Meant to be read every cycle; stays once it is
        set.
        """
        if self._failure is None:
            self._countdown -= 1
            if self._countdown <= 0 or self._words[FAILURE_BYTES]:
                self._countdown = _LIVENESS_EVERY
                self._failure = self._child.trouble() or self._lost_text()
        return self._failure

    def close(self, outcome: str, cause: str, end: str = "") -> LogSummary:
        """Write the end of the log and wait for it. May be called twice: the first call's summary
        is given again. ``end``: how the rig was left, in words.
        """
        if self._summary is None:
            lost = {"lost_samples": self._lost_samples, "lost_events": self._lost_events}
            self._post_event(0, 0, "end", cause, {"outcome": outcome, "end": end, **lost}, True)
            trouble = self._child.finish()
            lost["lost_samples"] += self._words[LOST_SAMPLES]
            lost["lost_events"] += self._words[LOST_EVENTS]
            failure = trouble or self._lost_text() or self._failure
            samples, events, size_bytes = (self._words[word] for word in (SAMPLES, EVENTS, BYTES))
            if self._child.died:
                left = self._tell_ending(outcome, cause, failure or "", end)
                ending, samples, events, size_bytes = left
                lost = {"lost_samples": ending.lost_samples, "lost_events": ending.lost_events}
            self._summary = LogSummary(
                path=self._path,
                outcome=outcome,
                cause=cause,
                samples=samples,
                events=events,
                **lost,
                size_bytes=size_bytes,
                failure=failure,
            )
        return self._summary

    def _tell_ending(self, outcome: str, cause: str, failure: str, end: str) -> Left:
        """The recorder died and left a cut log: this process says in it how the run ended, and
        what is lost.
        """
        from epa_rt.logs.dead_recorder import tell_ending
        from epa_rt.logs.recording import Ending

        ending = Ending(outcome, cause, failure=failure, end=end)
        samples = self._head - self._event_slots + self._lost_samples
        return tell_ending(self._path, ending, samples, self._events + self._lost_events)

    def _has_room(self, slots: int, wait: bool) -> bool:
        """Whether that many slots are free. With `wait` the answer is no only where the recorder is
        dead or stuck.
        """
        deadline_s = 0.0
        while True:
            self._limit = self._words[TAIL] + self._slots
            if self._head + slots <= self._limit:
                return True
            if not wait or self._stuck or self._child.trouble():
                return False
            deadline_s = deadline_s or time.monotonic() + _STUCK_AFTER_S
            if time.monotonic() > deadline_s:
                self._stuck = True
                return False
            time.sleep(_WAIT_S)

    def _post_event(
        self, cycle: int, t_ns: int, kind: str, text: str, data: dict[str, object], wait: bool
    ) -> None:
        encoded = json.dumps([cycle, t_ns, kind, text, data], default=_plain).encode()
        part_bytes = self._slot_bytes - EVENT_HEAD.size
        parts = [
            encoded[begin : begin + part_bytes] for begin in range(0, len(encoded), part_bytes)
        ]
        # Where nothing waits, an event goes in whole or not at all.
        if not wait and not self._has_room(len(parts), False):
            self._lost_events += 1
            self._countdown = 0
            return
        for number, part in enumerate(parts, start=1):
            if not self._has_room(1, wait):
                self._lost_events += 1
                self._countdown = 0
                return
            begin = HEADER_BYTES + self._head % self._slots * self._slot_bytes
            kind_of_slot = KIND_EVENT_END if number == len(parts) else KIND_EVENT_PART
            EVENT_HEAD.pack_into(self._memory, begin, kind_of_slot, len(part))
            self._memory[begin + EVENT_HEAD.size : begin + EVENT_HEAD.size + len(part)] = part
            self._head = self._words[HEAD] = self._head + 1
            self._event_slots += 1
        self._events += 1

    def _lost_text(self) -> str | None:
        if not self._lost_samples and not self._lost_events:
            return None
        counts = (("sample", self._lost_samples), ("event", self._lost_events))
        lost = " and ".join(f"{count} {noun}{'s' * (count > 1)}" for noun, count in counts if count)
        return f"recorder lost {lost}: its buffer was full"


def _plain(value: object) -> object:
    return value.tolist() if hasattr(value, "tolist") else str(value)
