"""When a frame came in, on the monotonic clock: the kernel's stamp, not when this process got round
to reading it.

A slave controller works on a frame when it arrives. An emulator that was not let run does so later;
it answers as of the time of arrival all the same, so that the answer is late and nothing else is.
"""

import fcntl
import socket
import time
from struct import Struct

_LAST_STAMP = (
    0x8907  # SIOCGSTAMPNS, asm-generic/sockios.h: when the packet read last came in, in real time
)
_TIMESPEC = Struct("qq")
_LONG_AGO_NS = (
    5_000_000  # older than this: look again how the two clocks stand, somebody may have set one
)


class Arrivals:
    """``of_last(now_ns)`` right after a packet has been read from the socket."""

    def __init__(self, packets: socket.socket):
        self._descriptor = packets.fileno()
        self._stamp = bytearray(_TIMESPEC.size)
        self._ahead_ns = 0
        self._compare_clocks()
        self._ask()  # the first question switches stamps on

    def _compare_clocks(self) -> None:
        """Real time less monotonic time, from the quickest of a few readings."""
        quickest_ns = None
        for _ in range(5):
            before_ns, real_ns, after_ns = time.monotonic_ns(), time.time_ns(), time.monotonic_ns()
            if quickest_ns is None or after_ns - before_ns < quickest_ns:
                quickest_ns, self._ahead_ns = (
                    after_ns - before_ns,
                    real_ns - (before_ns + after_ns) // 2,
                )

    def _ask(self) -> int | None:
        try:
            fcntl.ioctl(self._descriptor, _LAST_STAMP, self._stamp)
        except OSError:
            return None
        seconds, nanoseconds = _TIMESPEC.unpack(self._stamp)
        return seconds * 1_000_000_000 + nanoseconds

    def of_last(self, now_ns: int) -> int:
        """Monotonic, ns; ``now_ns`` where the kernel does not tell."""
        stamp_ns = self._ask()
        if stamp_ns is None:
            return now_ns
        came_ns = stamp_ns - self._ahead_ns
        if not now_ns - _LONG_AGO_NS < came_ns <= now_ns:
            self._compare_clocks()
            came_ns = min(now_ns, stamp_ns - self._ahead_ns)
        return came_ns
