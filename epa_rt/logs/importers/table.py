"""What every kind of foreign file becomes: columns of numbers, and where in the file each row
stands.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


class ImportRefused(Exception):
    """Why a file cannot be imported: one sentence, ``FILE:LINE: where: found X, expected Y``."""


class Key(NamedTuple):
    """A column that is wanted: of which file (its path), of which topic (None but in MCAP), which
    column.
    """

    path: str
    topic: str | None
    column: str | int


@dataclass(frozen=True)
class Table:
    """The columns wanted of one file or topic, (N,) float64 each, or int64 where all are whole;
    NaN only where the mapping allows it.

    ``says``: what a reader has to tell of it, in words. ``place(row)`` says where a row stands:
    'a.csv:12', or 'a.mat, index 11'.
    """

    source: str
    columns: dict[str | int, np.ndarray]
    place: Callable[[int], str]
    says: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        return len(next(iter(self.columns.values())))


def element_of(column: str) -> tuple[str, int | None]:
    """('positions', 2) of 'positions[2]'; (name, None) of a plain name."""
    head, bracket, rest = column.rpartition("[")
    if bracket and rest.endswith("]") and rest[:-1].isascii() and rest[:-1].isdigit() and head:
        return head, int(rest[:-1])
    return column, None


def matrix_column(values: np.ndarray, element: int, where: str) -> np.ndarray:
    """Column ``element`` of a matrix (N, M): (N,). Raises ImportRefused, beginning with ``where``,
    where it is none or has no such column.
    """
    if values.ndim != 2 or element >= values.shape[1]:
        raise ImportRefused(
            f"{where}: found the shape {values.shape}, expected a matrix with a column {element},"
            " counted from 0"
        )
    column: np.ndarray = values[:, element]
    return column


def shown(text: str, longest: int = 40) -> str:
    """Text of a file as part of a sentence: one line, cut where long."""
    text = "".join(c if c.isprintable() else " " for c in text[: longest + 1])
    return repr(text if len(text) <= longest else text[:longest] + "...")


def why(error: Exception) -> str:
    """Why a file could not be opened, to follow 'found'."""
    if isinstance(error, IsADirectoryError):
        return "a folder"
    return (getattr(error, "strerror", None) or str(error)).lower()


def may_be_missing(word: str, missing: Sequence[str]) -> bool:
    """Whether a mapping's ``missing`` names 'nan' or 'null', in whatever letters."""
    return word in {text.lower() for text in missing}


def missing_hint(word: str) -> str:
    """How a mapping says that 'nan' or 'null' means no value; nothing for other words."""
    return (
        f'; where that means no value, name it in the mapping: format: {{missing: ["{word}"]}}'
        if word
        else ""
    )


def numbers(values: np.ndarray, place: Callable[[int], str], missing: Sequence[str]) -> np.ndarray:
    """Numbers of a binary file, integers as int64 and all else as float64.

    Raises ImportRefused for one that is infinite, or no number where ``missing`` does not allow it.
    """
    if values.dtype.kind == "i" or values.dtype.kind == "u" and values.dtype.itemsize < 8:
        return values.astype(np.int64)
    values = values.astype(np.float64)
    bad = ~np.isfinite(values)
    if may_be_missing("nan", missing):
        bad &= ~np.isnan(values)
    if bad.any():
        row = int(bad.argmax())
        word = "nan" if np.isnan(values[row]) else ""
        raise ImportRefused(
            f"{place(row)}: found {values[row]}, expected a number"
            f" ({int(bad.sum())} of {len(values)} are none){missing_hint(word)}"
        )
    return values
