"""A file that is written whole or not at all, and over nothing that was there."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO

_NO_LINKS = (errno.EPERM, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK)


def write_new(path: Path, write: Callable[[IO[bytes]], None], replace: bool = False) -> None:
    """Writes under another name in the same folder, then gives it its name.

    Raises FileExistsError where there is a file (not with ``replace``), OSError where the disk
    refuses; both leave no trace.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if not replace and os.path.lexists(path):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(descriptor, "wb") as file:
            write(file)
            file.flush()
            os.fchmod(file.fileno(), 0o644)
            os.fsync(file.fileno())
        if replace:
            os.replace(name, path)
        else:
            _take_name(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _take_name(temporary: str, path: Path) -> None:
    """As a rename that refuses to write over a file, also one that came while this one grew."""
    try:
        os.link(temporary, path)
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644))
        os.replace(temporary, path)
    else:
        os.unlink(temporary)
