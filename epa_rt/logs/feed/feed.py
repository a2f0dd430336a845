"""Rows and events of a recording to the viewers that are connected, beside the log.

Nothing of it waits: the recorder's first work is the log. Without a viewer it keeps the events and
does nothing else.
"""

from __future__ import annotations

import contextlib
import functools
import os
import select
import socket
import struct
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Concatenate, ParamSpec

import numpy as np

from epa_rt.logs.feed.client import Client, GivenUp, Gone
from epa_rt.logs.feed.place import own_folder, socket_name, sockets
from epa_rt.logs.feed.wire import (
    ANSWER,
    END,
    EVENT,
    HELLO,
    MARK,
    STATUS,
    WireError,
    packed,
    request,
    unpacked,
)

BATCH_S = 0.02
"""Rows are given in batches this old: a screen needs no more, and each costs three processes."""

STATUS_S = 0.5
BATCH_BYTES = 256 << 10
MOST_CLIENTS = 8
MOST_EVENTS, MOST_EVENT_BYTES = 2000, 4 << 20
"""Kept for viewers that come later: of a longer run the first and the newest half of them."""

MARK_S, STOP_S = 0.1, 0.05  # a hand is slower; what comes sooner is refused
LAST_ROWS_S, LAST_WORDS_S, TAKES_NOTHING_S = 2.0, 0.5, 1.0
"""After the log is closed viewers have so long at most, first for all that waits, then for events
and the end without rows. Who takes nothing has less: a busy machine runs a viewer within that.
"""

_CREDENTIALS = struct.Struct("3i")

Given = ParamSpec("Given")


def _costs_only_the_view(
    method: Callable[Concatenate[Feed, Given], None],
) -> Callable[Concatenate[Feed, Given], None]:
    """An error of the feed's own ends the feed and never reaches the log."""

    @functools.wraps(method)
    def guarded(self: Feed, /, *given: Given.args, **named: Given.kwargs) -> None:
        try:
            method(self, *given, **named)
        except Exception as error:
            self.failure = f"{type(error).__name__}: {error}"
            self.give_up()

    return guarded


class Feed:
    """The feed of one run. `hello`: what a viewer is told first. `asks`: the socket on which the
    loop takes requests, or None.
    """

    def __init__(self, log: str, hello: dict[str, Any], asks: socket.socket | None = None) -> None:
        self._hello = packed(hello | {"takes_requests": asks is not None})
        self._log, self._asks = log, asks
        self._clients: list[Client] = []
        self._events: list[bytes] = []
        self._said = self._event_bytes = 0  # events so far; bytes of those kept
        self._held: list[bytes] = []
        self._held_rows = self._held_bytes = 0
        self._batch_due_s = self._status_due_s = 0.0
        self._asked_s = {MARK: 0.0}
        self.dropped = 0
        self.failure = ""  # an error of its own, in words
        self.listener: socket.socket | None = None
        self._path: Path | None = None

    def open(self) -> None:
        """Listen. Raises OSError where no private place is to be had; the feed then stays
        silent.
        """
        folder = own_folder()
        sockets()  # takes away what killed recorders left
        path = folder / socket_name(os.stat(self._log), os.getpid())
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK)
        mask = os.umask(0o177)
        try:
            path.unlink(missing_ok=True)
            listener.bind(os.fspath(path))
            listener.listen(MOST_CLIENTS)
        except OSError:
            listener.close()
            raise
        finally:
            os.umask(mask)
        self.listener, self._path = listener, path

    @property
    def readers(self) -> list[socket.socket]:
        """What a select waits for: new viewers and their requests."""
        if self.listener is None:
            return []
        return [self.listener, *(client.socket for client in self._clients)]

    @property
    def writers(self) -> list[socket.socket]:
        """Viewers for which something waits."""
        return [client.socket for client in self._clients if client.has_more]

    @property
    def has_screen(self) -> bool:
        """Whether a viewer has the terminal of the run."""
        return any(client.on_screen for client in self._clients)

    @_costs_only_the_view
    def rows(self, slots: np.ndarray) -> None:
        """Samples of the ring, valid only during the call."""
        if not self._clients or not len(slots):
            return
        content = slots.tobytes()
        self._held.append(content)
        self._held_rows += len(slots)
        self._held_bytes += len(content)
        if self._held_bytes >= BATCH_BYTES:
            self._give_rows()

    @_costs_only_the_view
    def event(self, cycle: int, t_ns: int, kind: str, text: str, data: dict[str, Any]) -> None:
        """Something that happened: kept for viewers that come later, given to those that are
        there.
        """
        self._said += 1
        found = {"number": self._said, "cycle": cycle, "t_ns": t_ns, "kind": kind, "text": text}
        message = packed(found | {"data": data})
        self._events.append(message)
        self._event_bytes += len(message)
        while len(self._events) > MOST_EVENTS or self._event_bytes > MOST_EVENT_BYTES:
            self._event_bytes -= len(self._events.pop(len(self._events) // 2))
        self._give_rows()  # what came before it is seen before it
        self._each(lambda client: client.give(EVENT, message), self._clients)

    @_costs_only_the_view
    def serve(self, readable: Iterable[object], writable: Iterable[object]) -> None:
        """Do what a select found to be due."""
        for found in readable:
            if found is self.listener:
                self._accept()
        clients = {id(client.socket): client for client in self._clients}
        read = [clients[id(found)] for found in readable if id(found) in clients]
        write = [clients[id(found)] for found in writable if id(found) in clients]
        self._each(self._hear, read)
        self._each(Client.send_more, write)

    @_costs_only_the_view
    def tick(self, status: Callable[[], dict[str, Any]]) -> None:
        """Give the rows of a batch that is old enough, and now and then a status."""
        if not self._clients:
            return
        now_s = time.monotonic()
        if now_s >= self._batch_due_s:
            self._batch_due_s = now_s + BATCH_S
            self._give_rows()
        if now_s >= self._status_due_s:
            self._status_due_s = now_s + STATUS_S
            found = {"viewers": len(self._clients), "dropped_viewers": self.dropped}
            message = packed(status() | found)
            self._each(lambda client: client.give(STATUS, message), self._clients)

    @_costs_only_the_view
    def close(self) -> None:
        """Say the end and go, as LAST_ROWS_S says."""
        if self.listener is None:
            return
        self._give_rows()
        self._send_for(LAST_ROWS_S)
        message = packed({"log": self._log})
        for client in self._clients:
            client.skip_rows()
        self._each(lambda client: client.give(END, message), self._clients)
        self._send_for(LAST_WORDS_S)
        self.give_up()

    def _send_for(self, longest_s: float) -> None:
        """Send what waits, for so long at most, as long as somebody takes it."""
        end_s = time.monotonic() + longest_s
        while self.writers and (left_s := end_s - time.monotonic()) > 0.0:
            ready = select.select([], self.writers, [], min(left_s, TAKES_NOTHING_S))[1]
            if not ready:
                return
            self.serve((), ready)

    def give_up(self) -> None:
        """Let all viewers go, and listen no more."""
        for client in self._clients:
            client.close()
        self._clients = []
        self._held, self._held_rows, self._held_bytes = [], 0, 0
        if self.listener is not None:
            self.listener.close()
            self.listener = None
        if self._path is not None:
            with contextlib.suppress(OSError):
                self._path.unlink(missing_ok=True)

    def _accept(self) -> None:
        assert self.listener is not None
        try:
            connection, _ = self.listener.accept()
        except OSError:  # it went away already, or there is no descriptor left
            return
        size = _CREDENTIALS.size
        peer = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, size)
        is_own = _CREDENTIALS.unpack(peer)[1] in (os.getuid(), 0)
        if not is_own or len(self._clients) >= MOST_CLIENTS:
            self.dropped += 1
            connection.close()
            return
        client = Client(connection)
        self._give_rows()  # to those who were there before
        self._clients.append(client)
        self._status_due_s = 0.0
        self._each(lambda one: one.give(HELLO, self._hello), [client])
        self._each(self._give_history, [client])

    def _give_history(self, client: Client) -> None:
        for message in self._events:
            client.give(EVENT, message)

    def _hear(self, client: Client) -> None:
        now_s = time.monotonic()
        for line in client.lines(now_s):
            with contextlib.suppress(WireError):
                if unpacked(line).get("on_screen") is True:
                    client.on_screen = True
                    continue
            why = self._pass_on(line, now_s)
            client.give(ANSWER, packed({"taken": not why, "why": why}))

    def _pass_on(self, line: bytes, now_s: float) -> str:
        """Hand a request to the loop; why not, or nothing."""
        try:
            asked = request(line)
        except WireError as error:
            return str(error)
        if self._asks is None:
            return "the run takes no requests from viewers"
        ask = asked["ask"]
        if now_s - self._asked_s.get(ask, -1.0) < (MARK_S if ask == MARK else STOP_S):
            return "too soon after the one before"
        self._asked_s[ask] = now_s
        try:
            self._asks.send(packed(asked), socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
        except OSError:
            return "the run does not take it"
        return ""

    def _give_rows(self) -> None:
        if not self._held:
            return
        content, rows = b"".join(self._held), self._held_rows
        self._held, self._held_rows, self._held_bytes = [], 0, 0
        self._each(lambda client: client.give_rows(content, rows), self._clients)

    def _each(self, act: Callable[[Client], None], clients: list[Client]) -> None:
        """`act` on each; those that are to be given up are closed and counted."""
        for client in list(clients):
            try:
                act(client)
            except Gone as gone:
                self.dropped += isinstance(gone, GivenUp)
                client.close()
                if client in self._clients:
                    self._clients.remove(client)
