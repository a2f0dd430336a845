"""A viewer's end of a run's feed: finding it, reading its messages, asking the run."""

from __future__ import annotations

import contextlib
import os
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.logs.feed.place import folders, sockets
from epa_rt.logs.feed.wire import ANSWER, END, EVENT, HEAD, HELLO, ROWS, STATUS, packed, unpacked
from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.ring import slot_dtype

LARGEST_BYTES = 64 << 20
_READ_BYTES = 1 << 18


class NotOn(Exception):
    """There is no run to look at; one sentence."""


@dataclass(frozen=True)
class RunFacts:
    """What a feed says of its run at first. `rig`: the rig file's text."""

    log: str
    layout: SampleLayout
    slot_bytes: int
    loop_pid: int
    total_cycles: int
    run: dict[str, str]
    rig: str
    takes_requests: bool

    @property
    def period_s(self) -> float:
        """Time of a cycle; 1 ms where the run does not say."""
        try:
            found = float(self.run.get("period_s", ""))
        except ValueError:
            return 0.001
        return found if 1e-6 < found < 10.0 else 0.001


@dataclass(frozen=True)
class Rows:
    """Cycles in order, as the ring holds them (`epa_rt.logs.ring.slot_dtype`)."""

    slots: np.ndarray


@dataclass(frozen=True)
class Happened:
    """An event of the log. `number` counts from 1 without a gap."""

    number: int
    cycle: int
    t_ns: int
    kind: str
    text: str
    data: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Status:
    """How the recording goes: share of the ring that is full, size of the log, what failed."""

    ring_ratio: float
    log_bytes: int
    failure: str
    viewers: int
    dropped_viewers: int


@dataclass(frozen=True)
class Answer:
    """Whether a request was passed on to the loop, and why not."""

    taken: bool
    why: str


@dataclass(frozen=True)
class Over:
    """The feed has ended. `is_said`: the recorder said so; else it went away."""

    is_said: bool


Message = Rows | Happened | Status | Answer | Over


def find(path: Path | None) -> Path:
    """The socket of a run: of a log, of the newest run that writes into a folder, of the only one.

    Raises NotOn where there is none, or where several runs are on and none was named.
    """
    if path is None:
        return _only()
    if path.is_dir():
        for log in sorted(path.glob("*.mcap"), key=lambda log: log.stat().st_mtime, reverse=True):
            if found := sockets(log):
                return found[0]
        raise NotOn(f"{path}: found no log in it of a run that is on")
    try:
        found = sockets(path)
    except OSError as error:
        raise NotOn(f"{path}: found no such log ({error.strerror})") from None
    if not found:
        raise NotOn(f"{path}: the run is over, or is another user's; epa info says how it ended")
    return found[0]


def _only() -> Path:
    found = sockets()
    if not found:
        places = ", ".join(map(str, folders()))
        raise NotOn(f"found no run that is on (looked into {places})")
    if len(found) > 1:
        logs = []
        for one in found:
            with contextlib.suppress(NotOn), Attached(one) as attached:
                logs.append(attached.facts.log)
        raise NotOn(f"found {len(found)} runs that are on, expected one: name {' or '.join(logs)}")
    return found[0]


class Attached:
    """A connection to a run's feed; `facts` are there at once. Raises NotOn where the run ends
    before it has said them.
    """

    def __init__(self, path: Path, on_screen: bool = False, timeout_s: float = 10.0) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._buffer = bytearray()
        self._facts: RunFacts | None = None
        self.skipped_rows = 0
        self.is_over = False
        try:
            self._socket.settimeout(timeout_s)
            self._socket.connect(os.fspath(path))
            if on_screen:
                self._socket.sendall(packed({"on_screen": True}) + b"\n")
            while self._facts is None:
                if not self._read():
                    raise NotOn("the run has ended, or has as many viewers as it takes")
                self._take_hello()
        except OSError as error:
            self._socket.close()
            raise NotOn(f"{path}: the run does not answer ({error})") from None
        except BaseException:
            self._socket.close()
            raise
        self._dtype: np.dtype = self._slot_dtype()

    @property
    def facts(self) -> RunFacts:
        assert self._facts is not None
        return self._facts

    def fileno(self) -> int:
        return self._socket.fileno()

    def messages(self, wait_s: float) -> Iterator[Message]:
        """Wait for the feed at most so long; all messages that are whole. The last one of a feed is
        Over.
        """
        self._socket.settimeout(max(wait_s, 1e-4))
        yield from self._whole()
        try:
            is_on = self._read()
        except (TimeoutError, BlockingIOError):
            return
        except OSError:
            is_on = False
        for message in self._whole():
            yield message
            if isinstance(message, Over):
                return
        if not is_on:
            self.is_over = True
            yield Over(False)

    def ask(self, ask: str, text: str = "", who: str = "") -> None:
        """Ask the run: `stop`, `stop_at_once` or `mark`. The answer comes among the messages.
        Raises OSError where the feed is gone.
        """
        self._socket.settimeout(1.0)
        self._socket.sendall(packed({"ask": ask, "text": text, "who": who}) + b"\n")

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> Attached:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _read(self) -> bool:
        """Take what is there; False at the end of the feed. Raises OSError."""
        data = self._socket.recv(_READ_BYTES)
        self._buffer += data
        return bool(data)

    def _frames(self) -> Iterator[tuple[int, bytes]]:
        """Kind and content of the whole messages in the buffer."""
        buffer, at = self._buffer, 0
        try:
            while len(buffer) - at >= HEAD.size:
                kind, length, skipped = HEAD.unpack_from(buffer, at)
                end = at + HEAD.size + length
                if length > LARGEST_BYTES or len(buffer) < end:
                    return
                content = bytes(buffer[at + HEAD.size : end])
                at, self.skipped_rows = end, skipped
                yield kind, content
        finally:
            del buffer[:at]

    def _take_hello(self) -> None:
        for kind, content in self._frames():
            if kind == HELLO:
                found = unpacked(content)
                self._facts = RunFacts(
                    log=found["log"],
                    layout=SampleLayout.from_json(found["layout"]),
                    slot_bytes=found["slot_bytes"],
                    loop_pid=found["loop_pid"],
                    total_cycles=found["total_cycles"],
                    run=found["run"],
                    rig=found["rig"],
                    takes_requests=found["takes_requests"],
                )
                return

    def _whole(self) -> Iterator[Message]:
        for kind, content in self._frames():
            if kind == ROWS:
                yield Rows(np.frombuffer(content, self._dtype))
            elif kind == EVENT:
                yield Happened(**unpacked(content))
            elif kind == STATUS:
                yield Status(**unpacked(content))
            elif kind == ANSWER:
                yield Answer(**unpacked(content))
            elif kind == END:
                self.is_over = True
                yield Over(True)

    def _slot_dtype(self) -> np.dtype:
        fields: Any = slot_dtype(self.facts.layout).fields
        names = list(fields)
        return np.dtype(
            {
                "names": names,
                "formats": [fields[name][0] for name in names],
                "offsets": [fields[name][1] for name in names],
                "itemsize": self.facts.slot_bytes,
            }
        )


def attach_soon(log: Path, on_screen: bool, wait_s: float) -> Attached:
    """The feed of a log whose run is about to begin. Raises NotOn where it does not come."""
    end_s = time.monotonic() + wait_s
    while True:
        try:
            return Attached(find(log), on_screen)
        except NotOn:
            if time.monotonic() > end_s:
                raise
        time.sleep(0.05)
