"""The work of the recorder process: ring to file, until the loop says that all is said, or dies."""

from __future__ import annotations

import contextlib
import os
import select
import socket
import sys
import time
from typing import Any

from epa_rt.logs.feed.feed import Feed
from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.mcap_file import McapFile
from epa_rt.logs.progress import ProgressLine, ProgressSpec
from epa_rt.logs.recorder_child import EXIT_DISK
from epa_rt.logs.recording import Ending, Recording
from epa_rt.logs.ring import (
    BYTES,
    CLOSING,
    EVENTS,
    HEAD,
    LOST_EVENTS,
    LOST_SAMPLES,
    SAMPLES,
    STATUS,
    STATUS_CLOSED,
    STATUS_FAILED,
    STATUS_OPEN,
    TAIL,
    Ring,
)

POLL_S = 0.005
FLUSH_AFTER_S = 1.0
BATCH_SLOTS = 4096
_STDIN = 0


class RecorderLoop:
    """One run of the recorder: `job` as `Recorder` wrote it, the ring already mapped."""

    def __init__(self, job: dict[str, Any], ring: Ring, parent_pid: int) -> None:
        self._job, self._ring, self._parent_pid = job, ring, parent_pid
        self._lossless: bool = job["lossless"]
        self._path: str = job["path"]
        self._layout = SampleLayout.from_json(job["layout"])
        self._slots = ring.slots_of(self._layout)
        self._pipe_open = True
        self._pending_since_s: float | None = None
        spec = ProgressSpec(**job["progress"]) if job["progress"] else None
        self._progress = None
        if spec and spec.enabled and sys.stderr is not None:  # None: it was closed
            self._progress = ProgressLine(
                spec, self._layout.states, self._layout.phases, sys.stderr
            )

    def run(self, attachments: dict[str, bytes], metadata: dict[str, dict[str, str]]) -> int:
        """Record until the end; gives the exit code."""
        self._feed = self._feed_of(attachments, metadata)
        try:
            self._file = McapFile(self._path, sync=not self._lossless)
            self._recording = Recording(self._file, self._layout, self._feed)
            Recording.begin(self._file, self._layout, attachments, metadata)
        except OSError as error:
            return self._fail(error, f"cannot write {self._path}")
        with contextlib.suppress(OSError):  # without a place for it the run goes on unseen
            self._feed.open()
        self._ring.words[STATUS] = STATUS_OPEN
        try:
            self._record()
            self._recording.finish()
        except OSError as error:
            code = self._fail(error, f"while writing {self._path}")
            self._file.drop_partial_record()
            self._drain_to_nowhere()
            self._leave_readable()
            return code
        finally:
            self._publish()
            self._file.close()
            if self._progress:
                self._progress.finish()
            self._feed.close()
        self._ring.words[STATUS] = STATUS_CLOSED
        return 0

    def _feed_of(self, attachments: dict[str, bytes], metadata: dict[str, dict[str, str]]) -> Feed:
        """The feed, with what a viewer has to know of the run."""
        progress, asks = self._job["progress"], self._job.get("asks_fd")
        hello = {
            "log": self._path,
            "layout": self._job["layout"],
            "slot_bytes": self._ring.slot_bytes,
            "loop_pid": self._parent_pid,
            "total_cycles": progress["total_cycles_estimate"] if progress else 0,
            "run": metadata.get("run", {}),
            "rig": attachments.get("rig.yaml", b"").decode("utf-8", "replace"),
        }
        return Feed(self._path, hello, None if asks is None else socket.socket(fileno=asks))

    def _status(self) -> dict[str, object]:
        """What a viewer is told of the recording now and then."""
        words = self._ring.words
        return {
            "ring_ratio": (words[HEAD] - words[TAIL]) / self._ring.slots,
            "log_bytes": self._file.size,
            "failure": self._ring.failure or "",
        }

    def _record(self) -> None:
        while True:
            alive = (
                self._producer_alive()
            )  # asked first: what is published before the end is then read after it
            if not self._take():
                if not alive:
                    break
                self._wait()
            self._flush_if_old()
            self._publish()
            self._feed.tick(self._status)
        if self._recording.ending is None or not self._ring.words[CLOSING]:
            self._note_death()

    def _take(self) -> bool:
        """Write one batch from the ring; False if it was empty."""
        words, slots = self._ring.words, self._ring.slots
        tail = words[TAIL]
        begin = tail % slots
        count = min(words[HEAD] - tail, slots - begin, BATCH_SLOTS)
        if count:
            before = self._recording.slots_taken
            try:
                self._recording.feed(self._slots[begin : begin + count])
            finally:  # where the disk refuses, the rest is still to come
                words[TAIL] = tail + self._recording.slots_taken - before
        return count > 0

    def _flush_if_old(self) -> None:
        # Only in real time: a simulated run must give the same chunks whatever the clock says.
        if self._lossless:
            return
        now_s = time.monotonic()
        if not self._recording.counts.pending:
            self._pending_since_s = None
        elif self._pending_since_s is None:
            self._pending_since_s = now_s
        elif now_s - self._pending_since_s >= FLUSH_AFTER_S:
            self._recording.flush()
            self._pending_since_s = None

    def _publish(self) -> None:
        words, counts = self._ring.words, self._recording.counts
        words[SAMPLES], words[EVENTS], words[BYTES] = counts.samples, counts.events, self._file.size
        if self._ring.failure:
            words[LOST_SAMPLES] = self._recording.samples_unsaved
            words[LOST_EVENTS] = self._recording.events_unsaved
        if self._progress and counts.last_state >= 0 and not self._feed.has_screen:
            fill_ratio = (words[HEAD] - words[TAIL]) / self._ring.slots
            cycles = counts.last_cycle + 1
            self._progress.update(
                time.monotonic(), cycles, counts.last_state, counts.last_phase, fill_ratio
            )

    def _producer_alive(self) -> bool:
        # The pipe alone is not enough: a child that the loop's process forked may hold its other
        # end open.
        readers = [_STDIN, *self._feed.readers] if self._pipe_open else self._feed.readers
        readable, writable, _ = select.select(readers, self._feed.writers, [], 0)
        if _STDIN in readable:
            self._pipe_open = bool(os.read(_STDIN, 1))
        if readable or writable:
            self._feed.serve(readable, writable)
        return self._pipe_open and os.getppid() == self._parent_pid

    def _wait(self) -> None:
        readers = [_STDIN, *self._feed.readers] if self._pipe_open else self._feed.readers
        select.select(readers, self._feed.writers, [], POLL_S)

    def _note_death(self) -> None:
        counts = self._recording.counts
        text = f"loop process died; the last recorded cycle is {counts.last_cycle}"
        self._recording.event(
            counts.last_cycle, counts.last_t_ns, "trip", text, {"outcome": "died"}
        )
        self._recording.ending = Ending("died", text)

    def _fail(self, error: OSError, doing: str) -> int:
        reason = (error.strerror or str(error)).lower()
        self._ring.failure = f"{reason} {doing}" if "while" in doing else f"{doing}: {reason}"
        self._ring.words[STATUS] = STATUS_FAILED
        return EXIT_DISK

    def _leave_readable(self) -> None:
        """Write the end of the log, with what is lost, into the room that was kept for it."""
        if self._recording.ending is None or not self._ring.words[CLOSING]:
            self._note_death()
        try:
            self._recording.write_ending_after(self._ring.failure or "")
        except OSError:
            # No room was kept: what was written before stays, and reads as a cut file.
            self._file.drop_partial_record()

    def _drain_to_nowhere(self) -> None:
        """Take what comes until the loop closes the log, and count it: the loop must never find the
        ring full while it brings the rig to its safe state.
        """
        words, slots = self._ring.words, self._ring.slots
        self._recording.discard(self._slots[:0])  # nothing more goes out before the end
        while True:
            alive = self._producer_alive()
            self._feed.tick(self._status)
            tail = words[TAIL]
            begin = tail % slots
            count = min(words[HEAD] - tail, slots - begin)
            if count:
                self._recording.discard(self._slots[begin : begin + count])
                words[TAIL] = tail + count
            elif not alive:
                return
            else:
                self._wait()
