"""One viewer of a feed: what waits for it, what it was not given, and what it asks."""

from __future__ import annotations

import socket
from collections import deque

from epa_rt.logs.feed.wire import HEAD, LONGEST_LINE_BYTES, ROWS

ROWS_WAITING_BYTES = 2 << 20
"""Of rows, at most so much waits for a viewer: some four seconds of a rig with forty signals."""

REST_WAITING_BYTES = 8 << 20
"""Of all else; a viewer that leaves that much is given up."""

_READ_BYTES = 4096
_FLOOD_LINES = 100  # between two looks at the clock of FLOOD_S; a hand sends two
FLOOD_S = 1.0


class Gone(Exception):
    """The viewer went away by itself."""


class GivenUp(Gone):
    """The viewer is to be given up; the words say why."""


class Client:
    """A connected viewer. Nothing here waits: what the socket does not take at once stays in the
    queue, and rows that find it full are skipped and counted.
    """

    def __init__(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        self.socket = connection
        self.skipped_rows = 0
        self.on_screen = False
        self._queue: deque[tuple[memoryview, int]] = deque()  # what is left of a message; its rows
        self._is_amid = False  # the first message of the queue is sent in part
        self._waiting = {True: 0, False: 0}  # bytes in the queue: rows, all else
        self._line = b""
        self._lines, self._since_s = 0, 0.0

    @property
    def has_more(self) -> bool:
        """Whether something waits to be sent."""
        return bool(self._queue)

    def give_rows(self, content: bytes, rows: int) -> None:
        """Queue and send rows, or count them as skipped. Raises Gone."""
        if self._waiting[True] + len(content) > ROWS_WAITING_BYTES:
            self.skipped_rows += rows
            return
        self._give(ROWS, content, rows)

    def give(self, kind: int, content: bytes) -> None:
        """Queue and send what must not be lost. Raises Gone."""
        if self._waiting[False] + len(content) > REST_WAITING_BYTES:
            raise GivenUp("it takes nothing")
        self._give(kind, content, 0)

    def skip_rows(self) -> None:
        """Take the rows out of the queue and count them, so that what must not be lost is next."""
        kept = deque([self._queue.popleft()] if self._is_amid else [])
        for part, rows in self._queue:
            self.skipped_rows += rows
            self._waiting[True] -= len(part) if rows else 0
            if not rows:
                kept.append((part, rows))
        self._queue = kept

    def send_more(self) -> None:
        """Send what waits, as far as the socket takes it. Raises Gone."""
        queue = self._queue
        try:
            while queue:
                part, rows = queue[0]
                sent = self.socket.send(part)
                self._waiting[rows > 0] -= sent
                self._is_amid = self._is_amid or sent > 0
                if sent < len(part):
                    queue[0] = (part[sent:], rows)
                    return
                queue.popleft()
                self._is_amid = False
        except BlockingIOError:
            return
        except OSError:
            raise Gone from None

    def lines(self, now_s: float) -> list[bytes]:
        """The whole lines that it sent. Raises Gone, also where it sends too much."""
        try:
            data = self.socket.recv(_READ_BYTES)
        except BlockingIOError:
            return []
        except OSError:
            raise Gone from None
        if not data:
            raise Gone
        *lines, self._line = (self._line + data).split(b"\n")
        if now_s - self._since_s > FLOOD_S:
            self._lines, self._since_s = 0, now_s
        self._lines += len(lines)
        longest = max(map(len, (*lines, self._line)))
        if self._lines > _FLOOD_LINES or longest > LONGEST_LINE_BYTES:
            raise GivenUp("it sends too much")
        return [line for line in lines if line.strip()]

    def close(self) -> None:
        """Give the connection back."""
        self.socket.close()

    def _give(self, kind: int, content: bytes, rows: int) -> None:
        message = HEAD.pack(kind, len(content), self.skipped_rows) + content
        self._queue.append((memoryview(message), rows))
        self._waiting[rows > 0] += len(message)
        self.send_more()
