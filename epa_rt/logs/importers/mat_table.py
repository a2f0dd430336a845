"""MAT files up to version 7 (scipy.io): vectors, columns of matrices, fields of structures,
scalars.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.logs.importers.mat_child import MatError, load_apart
from epa_rt.logs.importers.mat_size import unpacked_bytes
from epa_rt.logs.importers.table import (
    ImportRefused,
    Table,
    element_of,
    matrix_column,
    may_be_missing,
    shown,
    why,
)
from epa_rt.logs.importers.unpacked import TooLarge

_LARGEST = 1 << 31
_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_mat(
    path: Path,
    wanted: Sequence[str | int],
    constants: Sequence[str] = (),
    missing: Sequence[str] = (),
) -> tuple[Table, dict[str, float]]:
    """The wanted variables as columns: 'qm', 'data.q' (a field), 'q[2]' (column 2 of a matrix, from
    0); and scalars.

    Raises ImportRefused for the first thing that does not fit, with file, variable and index.
    """
    content = load_mat(path)
    columns = {column: _column(path, content, column, missing) for column in wanted}
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        said = ", ".join(f"{name} {len(values)}" for name, values in columns.items())
        raise ImportRefused(
            f"{path}: found variables of different lengths ({said}), expected one length"
        )
    found = {name: _scalar(path, content, name) for name in constants}
    return Table(str(path), columns, lambda row: f"{path}, index {row}"), found


def load_mat(path: Path) -> dict[str, Any]:
    """All variables of a file by name, structures as dicts. Raises ImportRefused."""
    try:
        with path.open("rb") as file:
            head = file.read(600)
        size = path.stat().st_size
    except (OSError, ValueError) as error:
        raise ImportRefused(f"{path}: found {why(error)}, expected a MAT file") from None
    if not head or size > _LARGEST:
        raise ImportRefused(
            f"{path}: found {'an empty file' if not head else 'more than 2 GB'}, expected a MAT"
            " file"
        )
    if _HDF5 in (head[:8], head[512:520]):
        raise ImportRefused(
            f"{path}: found a MAT file of version 7.3 (HDF5), expected version 7 or older (in"
            " MATLAB: save(..., '-v7'))"
        )
    try:
        with path.open("rb") as file:
            held = unpacked_bytes(file)
    except TooLarge as error:
        raise ImportRefused(f"{path}: found {error}, expected a MAT file") from None
    try:
        return load_apart(path, held)
    except MatError as error:
        raise ImportRefused(
            f"{path}: found a file that is no whole MAT file ({error}), expected version 4 to 7"
        ) from None


def _variable(path: Path, content: dict[str, Any], name: str) -> Any:
    value: Any = content
    for part in name.split("."):
        if not isinstance(value, dict) or part not in value:
            names = ", ".join(sorted(n for n in content if not n.startswith("__"))[:20])
            raise ImportRefused(
                f"{path}: found no variable {shown(name)}, expected it among"
                f" {names or 'none at all'}"
            )
        value = value[part]
    return value


def _column(
    path: Path, content: dict[str, Any], column: str | int, missing: Sequence[str]
) -> np.ndarray:
    if isinstance(column, int):
        raise ImportRefused(
            f"{path}: found column {column} by its number, expected the name of a variable"
        )
    name, element = (column, None) if column in content else element_of(column)
    value = _variable(path, content, name)
    values = np.asarray(value) if not isinstance(value, (dict, list, str)) else np.asarray(None)
    if values.dtype.kind not in "fiub":
        raise ImportRefused(
            f"{path}: variable {shown(name)}: found {_kind(value)}, expected numbers"
        )
    if element is not None:
        values = matrix_column(values, element, f"{path}: variable {shown(name)}")
    elif values.ndim != 1 or not len(values):
        found = (
            "a single number"
            if values.ndim == 0
            else "nothing"
            if not values.size
            else f"the shape {values.shape}"
        )
        raise ImportRefused(
            f"{path}: variable {shown(name)}: found {found}, expected a vector (a matrix's column"
            f" is '{name}[0]')"
        )
    values = values.astype(np.float64)
    is_missing = np.isnan(values) & may_be_missing("nan", missing)
    bad = np.flatnonzero(~np.isfinite(values) & ~is_missing)
    if len(bad):
        raise ImportRefused(
            f"{path}: variable {shown(name)}, index {bad[0]}: found {values[bad[0]]}, expected a"
            f" number ({len(bad)} of {len(values)} are none)"
        )
    return values


def _scalar(path: Path, content: dict[str, Any], name: str) -> float:
    value = _variable(path, content, name)
    is_number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or value == 0:
        raise ImportRefused(
            f"{path}: variable {shown(name)}: found {_kind(value) if not is_number else value},"
            " expected a number other than zero"
        )
    return float(value)


def _kind(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array of {value.dtype.name}, shape {value.shape}"
    return {"dict": "a structure", "str": "text", "list": "a cell array"}.get(
        type(value).__name__, type(value).__name__
    )
