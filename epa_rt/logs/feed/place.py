"""Where the socket of a run's feed lies: in a folder of the user's own, found from the log.

The name holds device and inode of the log, so that any path to it finds the same run, and the
recorder's process, so that what a killed recorder left can be told and taken away.
"""

from __future__ import annotations

import contextlib
import os
import socket
import stat
from collections.abc import Iterator
from pathlib import Path

_FOLDER = "epa_rt"
_LONGEST = 100  # bytes of a path that a Unix socket can have, less a few


def folders() -> list[Path]:
    """The places looked into, best first; they need not exist."""
    user = os.getuid()
    given = os.environ.get("XDG_RUNTIME_DIR")
    found = [Path(given, _FOLDER)] if given else []
    found += [Path(f"/run/user/{user}", _FOLDER), Path(f"/tmp/{_FOLDER}-{user}")]
    return [path for path in dict.fromkeys(found) if path.is_absolute()]


def is_private(folder: Path) -> bool:
    """Whether it is a folder of this user's that nobody else may enter."""
    try:
        found = os.lstat(folder)
    except OSError:
        return False
    closed = not found.st_mode & 0o077
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and closed


def own_folder(longest_name: int = 64) -> Path:
    """The first of `folders` that can be made and is private. Raises OSError where none is."""
    for folder in folders():
        if len(os.fsencode(folder)) + longest_name > _LONGEST:
            continue
        with contextlib.suppress(OSError):
            os.mkdir(folder, 0o700)
        if is_private(folder):
            return folder
    raise OSError(f"none of {', '.join(map(str, folders()))} is a folder of this user alone")


def socket_name(log: os.stat_result, pid: int) -> str:
    """The name for a log, as `os.stat` knows it, and the recorder's process."""
    return f"{_prefix(log)}{pid}.sock"


def sockets(log: Path | None = None) -> list[Path]:
    """The feeds of the runs that are on, newest first; with `log` the one of that log. Those whose
    recorder is gone are removed.
    """
    prefix = "" if log is None else _prefix(os.stat(log))
    found = [path for path in _all() if path.name.startswith(prefix) and _is_alive(path)]
    return sorted(found, key=_made, reverse=True)


def _prefix(log: os.stat_result) -> str:
    return f"{log.st_dev:x}-{log.st_ino:x}."


def _all() -> Iterator[Path]:
    for folder in folders():
        if is_private(folder):
            yield from folder.glob("*-*.*.sock")


def _made(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


def _is_alive(path: Path) -> bool:
    """Whether the recorder that made it is there; what is left of another is removed."""
    number = path.name.split(".")[-2]
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:  # or it is in a container, with numbers of its own
        return _answers(path)
    except (ValueError, OverflowError, PermissionError):
        return False
    return True


def _answers(path: Path) -> bool:
    """Whether somebody listens; a socket without is removed."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(1.0)
        try:
            probe.connect(os.fspath(path))
        except ConnectionRefusedError:
            with contextlib.suppress(OSError):
                path.unlink()
            return False
        except OSError:
            return False
    return True
