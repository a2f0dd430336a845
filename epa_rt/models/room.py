"""A room whose files each add something by being there: what they hold, or what is wrong with
them.
"""

import importlib
import traceback
from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

from epa_rt.config.source import ConfigError

Kind = TypeVar("Kind")


def held(
    room: str, folders: Iterable[str], name: str, kind: type[Kind], how: str
) -> list[tuple[Path, Kind]]:
    """File and constant ``name``, a ``kind``, of every module of the package ``room`` in
    ``folders``, in order of the files' names. ``how``: what makes such a constant.

    Raises ConfigError, with file and line, for one that cannot be imported or has no such constant.
    """
    found = []
    files = (file for folder in folders for file in Path(folder).glob("*.py"))
    for file in sorted(files, key=lambda one: one.stem):
        if file.stem == "__init__":
            continue
        try:
            constant = vars(importlib.import_module(f"{room}.{file.stem}")).get(name)
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
            raise ConfigError(file, _line(error, file), "", said, "Python that runs") from error
        if not isinstance(constant, kind):
            raise ConfigError(file, 1, "", f"no {name}", f"{name} = {how}")
        found.append((file, constant))
    return found


def _line(error: Exception, file: Path) -> int:
    """The last line of the file that led to an error, 1 where none did."""
    if isinstance(error, SyntaxError) and error.filename == str(file):
        return error.lineno or 1
    frames = traceback.extract_tb(error.__traceback__)
    return next((f.lineno or 1 for f in reversed(frames) if f.filename == str(file)), 1)
