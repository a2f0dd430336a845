"""What viewers of a run ask for, on its way from the recorder's process to the loop's requests.

A signal says that something has come, so that a cycle in which nothing comes looks at nothing; and
no thread could hold the interpreter while the loop wants it.
"""

import fcntl
import json
import os
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from epa_rt.loop.requests import OperatorRequests

_LARGEST = 4096


class ViewerRequests:
    """The loop's end of the path. ``recorders_fd``: the end for the recorder, to be given to it
    before ``taken``.
    """

    def __init__(self, requests: OperatorRequests) -> None:
        self._requests = requests
        self._here, self._there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._here.setblocking(False)

    @property
    def recorders_fd(self) -> int:
        return self._there.fileno()

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Requests are taken inside, in the main thread; both ends are closed after."""
        before = signal.signal(signal.SIGIO, self._on_signal)
        try:
            self._there.close()  # the recorder has it now; its death is then seen as an end
            self._watch(True)
            self._take_all()  # what came before the first signal could
            yield
        finally:
            self._watch(False)
            signal.signal(signal.SIGIO, before)
            self.close()

    def close(self) -> None:
        self._here.close()
        self._there.close()

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self._take_all()

    def _take_all(self) -> None:
        with suppress(OSError):
            while data := self._here.recv(_LARGEST):
                self._take(data)
            self._watch(False)  # no data is the end: the recorder is gone

    def _take(self, data: bytes) -> None:
        """One request, checked by the recorder already; an unknown one is dropped."""
        asked = json.loads(data)
        who = asked["who"] or "a viewer"
        if asked["ask"] == "mark":
            self._requests.say("mark", asked["text"] or "mark", who=who)
        elif (
            asked["ask"] == "stop" and not self._requests.is_stopping
        ):  # a key held never escalates
            self._requests.say("request", f"stop, asked by {who}", who=who)
            self._requests.ask(who)
        elif asked["ask"] == "stop_at_once":
            self._requests.say("request", f"stop at once, asked by {who}", who=who)
            self._requests.ask_at_once(who)

    def _watch(self, on: bool) -> None:
        """Whether the kernel sends SIGIO to this process when something comes."""
        number = self._here.fileno()
        if on:
            fcntl.fcntl(number, fcntl.F_SETOWN, os.getpid())
        flags = fcntl.fcntl(number, fcntl.F_GETFL)
        fcntl.fcntl(number, fcntl.F_SETFL, flags | os.O_ASYNC if on else flags & ~os.O_ASYNC)
