"""The recorder process: empties the ring into the log until the loop closes it, or dies.

Started by `Recorder.open` with the ring's descriptor; the job comes over standard input, which stays open as long as
the loop lives. Exit codes: 0 the log is complete, 3 the disk refused, 1 anything else.
"""

from __future__ import annotations

import json
import os
import select
import signal
import struct
import sys
import time

import numpy as np

from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.mcap_file import McapFile
from epa_rt.logs.progress import ProgressLine, ProgressSpec
from epa_rt.logs.recorder_child import EXIT_DISK
from epa_rt.logs.recording import Ending, Recording
from epa_rt.logs.ring import (
    BYTES, CLOSING, EVENTS, HEAD, HEADER_BYTES, SAMPLES, STATUS, STATUS_CLOSED, STATUS_FAILED, STATUS_OPEN, TAIL, Ring,
    slot_dtype,
)  # fmt: skip

POLL_REAL_TIME_S, POLL_LOSSLESS_S = 0.02, 0.001
FLUSH_AFTER_S = 1.0
BATCH_SLOTS = 4096
_STDIN = 0


class RecorderProcess:
    """One run of the recorder: `job` as `Recorder` wrote it, the ring already mapped."""

    def __init__(self, job: dict, ring: Ring, parent_pid: int) -> None:
        self._ring, self._parent_pid = ring, parent_pid
        self._lossless: bool = job["lossless"]
        self._path: str = job["path"]
        self._layout = SampleLayout.from_json(job["layout"])
        dtype = _padded(slot_dtype(self._layout), ring.slot_bytes)
        self._slots = np.frombuffer(ring.memory, dtype, offset=HEADER_BYTES)
        self._pipe_open = True
        self._pending_since_s: float | None = None
        spec = ProgressSpec(**job["progress"]) if job["progress"] else None
        self._progress = None
        if spec and spec.enabled:
            self._progress = ProgressLine(spec, self._layout.states, self._layout.phases, sys.stderr)

    def run(self, attachments: dict[str, bytes], metadata: dict[str, dict[str, str]]) -> int:
        """Record until the end; gives the exit code."""
        try:
            self._file = McapFile(self._path, sync=not self._lossless)
            self._recording = Recording(self._file, self._layout)
            Recording.begin(self._file, self._layout, attachments, metadata)
        except OSError as error:
            return self._fail(error, f"cannot write {self._path}")
        self._ring.words[STATUS] = STATUS_OPEN
        try:
            self._record()
            self._recording.finish()
        except OSError as error:
            code = self._fail(error, f"while writing {self._path}")
            self._leave_readable()
            self._drain_to_nowhere()
            return code
        finally:
            self._publish()
            self._file.close()
            if self._progress:
                self._progress.finish()
        self._ring.words[STATUS] = STATUS_CLOSED
        return 0

    def _record(self) -> None:
        while True:
            alive = self._producer_alive()  # asked first: what is published before the end is then read after it
            if not self._take():
                if not alive:
                    break
                self._wait()
            self._flush_if_old()
            self._publish()
        if self._recording.ending is None or not self._ring.words[CLOSING]:
            self._note_death()

    def _take(self) -> bool:
        """Write one batch from the ring; False if it was empty."""
        words, slots = self._ring.words, self._ring.slots
        tail = words[TAIL]
        begin = tail % slots
        count = min(words[HEAD] - tail, slots - begin, BATCH_SLOTS)
        if count:
            self._recording.feed(self._slots[begin : begin + count])
            words[TAIL] = tail + count
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
        if self._progress and counts.last_phase >= 0:
            fill = (words[HEAD] - words[TAIL]) / self._ring.slots
            self._progress.update(time.monotonic(), counts.last_cycle, counts.last_state, counts.last_phase, fill)

    def _producer_alive(self) -> bool:
        # The pipe alone is not enough: a child that the loop's process forked may hold its other end open.
        if self._pipe_open and select.select([_STDIN], [], [], 0)[0]:
            self._pipe_open = bool(os.read(_STDIN, 1))
        return self._pipe_open and os.getppid() == self._parent_pid

    def _wait(self) -> None:
        poll_s = POLL_LOSSLESS_S if self._lossless else POLL_REAL_TIME_S
        select.select([_STDIN] if self._pipe_open else [], [], [], poll_s)

    def _note_death(self) -> None:
        counts = self._recording.counts
        text = f"loop process died; the last recorded cycle is {counts.last_cycle}"
        self._recording.event(counts.last_cycle, counts.last_t_ns, "trip", text, {"outcome": "died"})
        self._recording.ending = Ending("died", text)

    def _fail(self, error: OSError, doing: str) -> int:
        reason = (error.strerror or str(error)).lower()
        self._ring.failure = f"{reason} {doing}" if "while" in doing else f"{doing}: {reason}"
        self._ring.words[STATUS] = STATUS_FAILED
        return EXIT_DISK

    def _leave_readable(self) -> None:
        """Cut the torn record off, which may free room enough for the outcome and the summary."""
        for last_try in (False, True):
            try:
                self._file.drop_partial_record()
                if not last_try:
                    self._recording.ending = Ending("failed", f"recorder: {self._ring.failure}")
                    self._recording.write_ending()
                    return
            except OSError:
                continue

    def _drain_to_nowhere(self) -> None:
        # The loop must never find the ring full while it brings the rig to its safe state.
        words = self._ring.words
        while self._producer_alive():
            words[TAIL] = words[HEAD]
            self._wait()


def _padded(dtype: np.dtype, slot_bytes: int) -> np.dtype:
    """The slot type as wide as the ring's slots."""
    names = list(dtype.fields)
    offsets = [dtype.fields[name][1] for name in names]
    formats = [dtype.fields[name][0] for name in names]
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": slot_bytes})


def step_aside(nice: int) -> None:
    """Leave the loop's scheduling class and core, both of which a child inherits."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # the loop's end is the recorder's, and it sees that by the pipe
    if os.sched_getscheduler(0) in (os.SCHED_FIFO, os.SCHED_RR):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        others = set(range(os.cpu_count() or 1)) - os.sched_getaffinity(0)
        if others:
            os.sched_setaffinity(0, others)
    os.nice(nice)


def read_exactly(length: int) -> bytes:
    """`length` bytes from standard input. Raises EOFError where it ends before."""
    parts: list[bytes] = []
    while length:
        part = os.read(_STDIN, min(length, 1 << 20))
        if not part:
            raise EOFError("recorder: the loop process went away before the log was open")
        parts.append(part)
        length -= len(part)
    return b"".join(parts)


def main() -> int:
    job = json.loads(read_exactly(struct.unpack("<Q", read_exactly(8))[0]))
    step_aside(0 if job["lossless"] else 10)
    attachments = {name: read_exactly(length) for name, length in job["attachments"]}
    ring = Ring(job["ring_fd"], job["slots"], job["slot_bytes"])
    ring.close_fd()
    try:
        return RecorderProcess(job, ring, job["pid"]).run(attachments, job["metadata"])
    except BaseException as error:
        ring.failure = f"recorder error: {type(error).__name__}: {error}"
        ring.words[STATUS] = STATUS_FAILED
        raise


if __name__ == "__main__":
    sys.exit(main())
