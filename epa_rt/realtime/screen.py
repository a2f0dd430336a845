"""A line on the screen from a process that must not wait: what cannot be taken is dropped."""

from __future__ import annotations

import contextlib
import os
import select
import stat
import sys
from typing import TextIO


class DroppingStream:
    """A stream's descriptor, on which what cannot be taken at once is dropped.

    Terminals and pipes are opened once more with O_NONBLOCK, which belongs to the open file and
    must not be set on the one that the shell has, too: select alone says that there is room, and
    not for how much. Where that is refused (a terminal of another user), and on sockets and files,
    it is all there is.
    """

    def __init__(self, descriptor: int, encoding: str | None) -> None:
        self._descriptor, self._encoding = descriptor, encoding or "utf-8"
        self._own = False
        if os.isatty(descriptor) or stat.S_ISFIFO(os.fstat(descriptor).st_mode):
            with contextlib.suppress(OSError):
                self._descriptor = os.open(
                    f"/proc/self/fd/{descriptor}",
                    os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC,
                )
                self._own = True

    @staticmethod
    def of(stream: TextIO) -> DroppingStream | TextIO:
        """Of a stream without a descriptor, the stream itself: nothing waits there."""
        try:
            return DroppingStream(stream.fileno(), stream.encoding)
        except (OSError, ValueError, AttributeError):
            return stream

    def write(self, text: str) -> None:
        if select.select([], [self._descriptor], [], 0)[1]:
            with contextlib.suppress(BlockingIOError):
                os.write(self._descriptor, text.encode(self._encoding, "backslashreplace"))

    def flush(self) -> None: ...

    def close(self) -> None:
        """Give back what was opened here; the stream's own descriptor stays open."""
        if self._own:
            os.close(self._descriptor)
            self._own = False


class Notice:
    """Sentences for the operator on standard error, each on a line of its own.

    Meant for signal handlers of the loop's process. A screen that was stopped (Ctrl-S) or went away
    costs the sentence and nothing else. ``close`` gives the descriptor back.
    """

    def __init__(self) -> None:
        self._stream = None if sys.stderr is None else DroppingStream.of(sys.stderr)

    def say(self, sentence: str) -> None:
        if self._stream is None:
            return
        try:
            self._stream.write(f"\n{sentence}\n")
            self._stream.flush()
        except (OSError, ValueError):  # the terminal is gone
            self._stream = None

    def close(self) -> None:
        if isinstance(self._stream, DroppingStream):
            self._stream.close()
        self._stream = None
