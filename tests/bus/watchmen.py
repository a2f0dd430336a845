"""How long a core let no ordinary process run, seen by processes that do nothing but wake up, one
pinned to each core.
"""

import mmap
import os
import signal
import struct
import time

from sim_backend.bus.namespace import die_with_parent

_TICK_S, _SEEN_S = 0.005, 0.030
_ROWS = 4096
_SLOT = 16 * (1 + _ROWS)  # (last wake-up, number of gaps), then (end, length) of the last gaps


class Watchmen:
    """Watches from its making until this process ends."""

    def __init__(self):
        self._cores = sorted(os.sched_getaffinity(0))
        self._seen = mmap.mmap(-1, _SLOT * len(self._cores))
        for i in range(len(self._cores)):
            struct.pack_into("dq", self._seen, i * _SLOT, time.monotonic(), 0)
        self.numbers = [self._begin_watch(i * _SLOT, core) for i, core in enumerate(self._cores)]

    def close(self) -> None:
        """Ends the watch; otherwise it ends with this process."""
        for number in self.numbers:
            os.kill(number, signal.SIGKILL)
            os.waitpid(number, 0)

    def _begin_watch(self, slot: int, core: int) -> int:
        number = os.fork()
        if number == 0:
            self._watch(slot, core)
        return number

    def _watch(self, slot: int, core: int) -> None:
        try:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            die_with_parent()
            os.sched_setaffinity(0, {core})
            last_s, count = time.monotonic(), 0
            while True:
                time.sleep(_TICK_S)
                now_s = time.monotonic()
                gap_s, last_s = now_s - last_s - _TICK_S, now_s
                if gap_s > _SEEN_S:
                    struct.pack_into(
                        "dd", self._seen, slot + 16 * (1 + count % _ROWS), now_s, gap_s
                    )
                    count += 1
                struct.pack_into("dq", self._seen, slot, now_s, count)
        finally:
            os._exit(0)

    def longest_s(self, since_s: float) -> float:
        """The longest time, ending after ``since_s`` of the monotonic clock, for which a watchman
        was not let run; also one that still waits.
        """
        longest_s, now_s = 0.0, time.monotonic()
        for i in range(len(self._cores)):
            last_s, count = struct.unpack_from("dq", self._seen, i * _SLOT)
            longest_s = max(longest_s, now_s - last_s - _TICK_S)
            for row in range(max(0, count - _ROWS), count):
                end_s, gap_s = struct.unpack_from(
                    "dd", self._seen, i * _SLOT + 16 * (1 + row % _ROWS)
                )
                if end_s >= since_s:
                    longest_s = max(longest_s, gap_s)
        return longest_s
