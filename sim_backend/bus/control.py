"""The control channel: a Unix socket that takes one JSON object per line and answers with one.

    {"do": "status"}   {"do": "truth"}   {"do": "rewind"}   {"do": "stop"}
    {"do": "fault", "kind": "frames_lost", "cycles": 3, ...}   {"do": "clear"}   {"do": "faults"}

Every answer has "ok"; where that is false, "error" is one sentence.
"""

import errno
import json
import os
import socket
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

_LINE_MAX = 65536


class ControlServer:
    """Listens at a path; ``handlers`` (of the Server) is where it registers its descriptors.

    Raises OSError where something else is at the path: any file that is no socket, or a socket at
    which somebody answers.
    """

    def __init__(
        self,
        path: Path,
        handlers: dict[int, Callable[[], None]],
        answer: Callable[[dict[str, Any]], dict[str, Any]],
    ):
        self.path, self._handlers, self._answer = path, handlers, answer
        _clear_left_over(path)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._listener.bind(str(path))
        except OSError:
            self._listener.close()
            raise
        self._inode = path.lstat().st_ino
        os.chmod(path, 0o600)
        self._listener.listen(8)
        self._listener.setblocking(False)
        self._buffers: dict[int, tuple[socket.socket, bytearray]] = {}
        handlers[self._listener.fileno()] = self._accept

    def close(self) -> None:
        for connection, _ in self._buffers.values():
            connection.close()
        self._listener.close()
        if self.path.is_socket() and self.path.lstat().st_ino == self._inode:
            self.path.unlink()

    def _accept(self) -> None:
        connection, _ = self._listener.accept()
        connection.setblocking(True)
        connection.settimeout(1.0)
        number = connection.fileno()
        self._buffers[number] = connection, bytearray()
        self._handlers[number] = lambda: self._readable(number)

    def _readable(self, number: int) -> None:
        connection, buffer = self._buffers[number]
        try:
            data = connection.recv(_LINE_MAX)
            buffer += data
            while b"\n" in buffer:
                line, _, rest = bytes(buffer).partition(b"\n")
                buffer[:] = rest
                connection.sendall(json.dumps(self._one(line)).encode() + b"\n")
        except OSError:
            data = b""
        if not data or len(buffer) > _LINE_MAX:
            del self._handlers[number], self._buffers[number]
            connection.close()

    def _one(self, line: bytes) -> dict[str, Any]:
        try:
            request = json.loads(line)
            if not isinstance(request, dict):
                raise ValueError("found no JSON object, expected one with 'do'")
            return {"ok": True, **self._answer(request)}
        except (ValueError, KeyError, TypeError) as error:
            return {"ok": False, "error": str(error)}


def _clear_left_over(path: Path) -> None:
    """Removes the socket of an emulator that has died. Raises OSError for anything else."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(mode):
        raise FileExistsError(
            errno.EEXIST, f"{path}: found a file that is no socket, expected a free path"
        )
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(1.0)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
    raise OSError(
        errno.EADDRINUSE, f"{path}: found a socket at which somebody answers, expected a free path"
    )


class ControlError(Exception):
    """The emulator refused a request, or is not there; one sentence."""


class ControlClient:
    """Talks to a running emulator. ``ask`` raises ControlError."""

    def __init__(self, path: Path | str, timeout_s: float = 5.0):
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(timeout_s)
        try:
            self._socket.connect(str(path))
        except OSError as error:
            self._socket.close()
            raise ControlError(
                f"{path}: no emulated bus answers here ({error.strerror or error})"
            ) from None
        self._file = self._socket.makefile("rb")

    def __enter__(self) -> "ControlClient":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._file.close()
        self._socket.close()

    def ask(self, do: str, **more: Any) -> dict[str, Any]:
        """One request; returns the answer without 'ok'."""
        try:
            self._socket.sendall(json.dumps({"do": do, **more}).encode() + b"\n")
            line = self._file.readline()
        except OSError as error:
            raise ControlError(f"the emulated bus does not answer ({error})") from None
        if not line:
            raise ControlError("the emulated bus closed the control channel")
        answer = json.loads(line)
        if not answer.pop("ok"):
            raise ControlError(answer["error"])
        return answer
