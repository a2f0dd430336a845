"""Whether somebody still writes a log: its writer holds a lock, which ends with its process."""

from __future__ import annotations

import contextlib
import fcntl
import os


def hold(descriptor: int) -> None:
    """Lock a file that is open for writing. A file system without locks is written all the same."""
    with contextlib.suppress(OSError):
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def is_held(path: str) -> bool:
    """Whether a writer has the file open now; False where nobody can know."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return False
