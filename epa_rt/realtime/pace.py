"""Waiting for the next cycle edge without drift: edges are start + n x period, never 'now +
period'.
"""

import time


class Pace:
    """Cycle edges on the monotonic clock. A late cycle does not shift the edges after it."""

    def __init__(self, period_s: float):
        self._period_ns = round(period_s * 1e9)
        self._next_ns = 0
        self._mark_ns = 0

    def start(self) -> None:
        self._next_ns = time.monotonic_ns() + self._period_ns
        self._mark_ns = time.monotonic_ns()

    def wait(self) -> tuple[int, int]:
        """Sleeps to the next edge. Returns lateness at wake-up and the busy time since ``mark``,
        both in ns.

        Where an edge has passed already it returns at once; edges that were missed whole are
        skipped, so that the loop does not run after them at full speed.
        """
        now_ns = time.monotonic_ns()
        busy_ns = now_ns - self._mark_ns
        edge_ns = self._next_ns
        if now_ns < edge_ns:
            time.sleep((edge_ns - now_ns) * 1e-9)
            now_ns = time.monotonic_ns()
        lateness_ns = now_ns - edge_ns
        self._next_ns = edge_ns + self._period_ns * (1 + max(0, lateness_ns) // self._period_ns)
        return lateness_ns, busy_ns

    def mark(self) -> None:
        """The exchange is done: busy time of everything above counts from here."""
        self._mark_ns = time.monotonic_ns()
