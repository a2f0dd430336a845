"""The tables of a file that is being guessed at."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Seen:
    """One table: ``columns`` (N,) float64 or int64 by address, NaN where there is no value.

    ``type``: of a ROS topic; ``units``: as the file itself says them; ``texts``: columns without
    numbers; ``hints``: names of columns that are addressed by number; ``scalars``: single numbers
    beside the columns; ``missing``: what the mapping has to allow;
    ``of_many``: one of several files, whose name says something.
    """

    path: Path
    topic: str | None
    columns: dict[str | int, np.ndarray]
    type: str = ""
    units: dict[str | int, str] = field(default_factory=dict)
    texts: tuple[str, ...] = ()
    hints: dict[str | int, str] = field(default_factory=dict)
    scalars: dict[str, float] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    of_many: bool = False

    def also_missing(self, word: str) -> "Seen":
        return replace(self, missing=(*self.missing, word))

    def with_scalars(self, scalars: dict[str, float]) -> "Seen":
        return replace(self, scalars=scalars)

    def name(self, column: str | int) -> str:
        """What a person calls a column."""
        return self.hints.get(column) or (column if isinstance(column, str) else f"col{column}")


@dataclass(frozen=True)
class Survey:
    """A file: its ``kind``, the ``form`` that a mapping's format needs, tables, and what is unsure
    about its writing, in words.
    """

    kind: str
    form: dict[str, Any]
    tables: tuple[Seen, ...]
    unsure: tuple[str, ...] = ()


def numbered(values: np.ndarray) -> np.ndarray:
    """Whole numbers as int64, all others as float64."""
    if values.dtype.kind == "i" or values.dtype.kind == "u" and values.dtype.itemsize < 8:
        return values.astype(np.int64)
    return values.astype(np.float64)
