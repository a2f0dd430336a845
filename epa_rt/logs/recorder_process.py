"""The recorder process: empties the ring into the log until the loop closes it, or dies.

Started by `Recorder.open` with the ring's descriptor; the job comes over standard input, which
stays open as long as the loop lives. Exit codes: 0 the log is complete, 3 the disk refused, 1
anything else.
"""

from __future__ import annotations

import contextlib
import json
import os
import struct
import sys

from epa_rt.logs.recorder_loop import RecorderLoop
from epa_rt.logs.ring import STATUS, STATUS_FAILED, Ring
from epa_rt.realtime.signal_sets import ignore_all

NICE_REAL_TIME = 10
_STDIN = 0


def step_aside(nice: int) -> None:
    """Leave the loop's scheduling class and core, both of which a child inherits."""
    ignore_all()  # the loop's end is the recorder's, and it sees that by the pipe
    if os.sched_getscheduler(0) in (os.SCHED_FIFO, os.SCHED_RR):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        others = set(range(os.cpu_count() or 1)) - os.sched_getaffinity(0)
        with contextlib.suppress(OSError):  # there may be no other core to go to
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
    step_aside(0 if job["lossless"] else NICE_REAL_TIME)
    attachments = {name: read_exactly(length) for name, length in job["attachments"]}
    ring = Ring(job["ring_fd"], job["slots"], job["slot_bytes"])
    ring.close_fd()
    try:
        return RecorderLoop(job, ring, job["pid"]).run(attachments, job["metadata"])
    except BaseException as error:
        ring.failure = f"recorder error: {type(error).__name__}: {error}"
        ring.words[STATUS] = STATUS_FAILED
        raise


if __name__ == "__main__":
    sys.exit(main())
