"""A file written whole or not at all, and on the disk before the call returns."""

import os
import tempfile
from pathlib import Path


def write_synced(path: Path, text: str) -> None:
    """Writes the text under another name, then takes the file's name; file and name outlive the
    power. Makes the folder. Raises OSError, and then leaves the former file as it was.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
