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


class ControlError(Exception):
    """The emulator refused a request, or is not there; one sentence."""


def _identity(path: Path) -> tuple[int, int, int] | None:
    """Device, number and last change of the file at a path; None where there is none."""
    try:
        found = os.lstat(path)
    except OSError:
        return None
    return found.st_dev, found.st_ino, found.st_ctime_ns


def _bind(listener: socket.socket, path: Path) -> None:
    """Raises ControlError where the path is taken or cannot be one."""
    try:
        try:
            listener.bind(str(path))
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            _remove_left_behind(path)
            listener.bind(str(path))
    except OSError as error:
        raise ControlError(
            f"{path}: no control channel can be made here ({error.strerror or error})"
        ) from None


def _remove_left_behind(path: Path) -> None:
    """Raises ControlError where the file is not a socket that an emulator left behind."""
    found = os.lstat(path)
    if not stat.S_ISSOCK(found.st_mode):
        raise ControlError(f"{path}: found a file, expected a name that is free or a socket")
    if found.st_uid != os.geteuid():
        raise ControlError(f"{path}: found a socket of another user, expected a name that is free")
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(1.0)
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()
            return
        except OSError:  # a socket of another kind, or one whose owner is busy
            pass
    raise ControlError(f"{path}: found a socket in use, expected a name that is free")


class ControlServer:
    """Listens at a path; ``handlers`` (of the Server) is where it registers its descriptors.

    A file at the path stays as it is. Only a socket of this user on which nobody answers, which an
    emulator that was killed leaves behind, is replaced. Raises ControlError for anything else.
    """

    def __init__(
        self,
        path: Path,
        handlers: dict[int, Callable[[], None]],
        answer: Callable[[dict[str, Any]], dict[str, Any]],
    ):
        self.path, self._handlers, self._answer = path, handlers, answer
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            _bind(self._listener, path)
        except BaseException:
            self._listener.close()
            raise
        os.chmod(path, 0o600)
        self._own = _identity(path)
        self._listener.listen(8)
        self._listener.setblocking(False)
        self._buffers: dict[int, tuple[socket.socket, bytearray]] = {}
        handlers[self._listener.fileno()] = self._accept

    def close(self) -> None:
        for connection, _ in self._buffers.values():
            connection.close()
        self._listener.close()
        if _identity(self.path) == self._own:  # somebody may have put another file there
            self.path.unlink(missing_ok=True)

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
