"""What is due later: state changes, mailbox answers, held-back frames. Time is the caller's, in
nanoseconds.
"""

import heapq
from collections.abc import Callable
from itertools import count


class Agenda:
    """Actions by due time. ``now_ns`` is the time of the last ``advance_to``."""

    def __init__(self):
        self.now_ns = 0
        self._queue: list[tuple[int, int, Callable[[], None]]] = []
        self._number = count()

    def after(self, delay_ns: int, action: Callable[[], None]) -> None:
        heapq.heappush(self._queue, (self.now_ns + delay_ns, next(self._number), action))

    @property
    def next_ns(self) -> int | None:
        """When the next action is due; None where nothing is."""
        return self._queue[0][0] if self._queue else None

    def advance_to(self, now_ns: int) -> None:
        """Does everything that is due; each action sees its own due time as now."""
        queue = self._queue
        if not queue:
            self.now_ns = now_ns
            return
        while queue and queue[0][0] <= now_ns:
            due_ns, _, action = heapq.heappop(queue)
            self.now_ns = max(self.now_ns, due_ns)
            action()
        self.now_ns = now_ns
