"""NPZ files of numpy: arrays by name. Nothing in them is run: arrays of objects are refused."""

import math
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import IO

import numpy as np

from epa_rt.logs.importers.table import (
    ImportRefused,
    Table,
    element_of,
    matrix_column,
    numbers,
    shown,
    why,
)
from epa_rt.logs.importers.unpacked import TooLarge, check_unpacked

_LARGEST = 1 << 31
_MOST_ARRAYS = 10_000
_ALWAYS_TAKEN = 64 << 20
_LARGEST_RATIO = 40.0
"""Unpacked to packed: recorded numbers pack to a half or a tenth, commands that stand to less."""
_LONGEST_HEADER = 10_000
_PLAIN = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def read_npz(
    path: Path,
    wanted: Sequence[str | int],
    constants: Sequence[str] = (),
    missing: Sequence[str] = (),
) -> tuple[Table, dict[str, float]]:
    """The wanted arrays as columns: 'q', 'q[2]' (column 2 of a matrix, from 0), 'log.q' (a field of
    a structured array); and scalars.

    Raises ImportRefused for the first thing that does not fit, with file, array and index.
    """
    columns: dict[str | int, np.ndarray] = {}
    with NpzFile(path) as file:
        for column in wanted:
            columns[column] = _column(path, file, column, missing)
        found = {name: _scalar(path, file, name) for name in constants}
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        said = ", ".join(f"{name} {len(values)}" for name, values in columns.items())
        raise ImportRefused(
            f"{path}: found arrays of different lengths ({said[:200]}), expected one length"
        )
    return Table(str(path), columns, lambda row: f"{path}, index {row}"), found


class NpzFile:
    """An open NPZ file that gives arrays by name, each within bounds, and pickles none."""

    def __init__(self, path: Path) -> None:
        """Raises ImportRefused for what is no NPZ file."""
        self.path = path
        self._held: dict[str, np.ndarray] = {}
        self._unpacked = 0
        try:
            self._size = path.stat().st_size
            if self._size > _LARGEST:
                raise ImportRefused(f"{path}: found more than 2 GB, expected a smaller file")
            self._zip = zipfile.ZipFile(path)
            self._members = {
                info.filename.removesuffix(".npy"): info
                for info in self._zip.infolist()[:_MOST_ARRAYS]
                if info.filename.endswith(".npy")
            }
        except OSError as error:
            raise ImportRefused(f"{path}: found {why(error)}, expected an NPZ file") from None
        except (zipfile.BadZipFile, ValueError, NotImplementedError, LookupError) as error:
            raise ImportRefused(
                f"{path}: found a file that is no whole NPZ file ({str(error)[:80]}), expected one"
            ) from None

    def __enter__(self) -> "NpzFile":
        return self

    def __exit__(self, *_: object) -> None:
        self._zip.close()

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._members)

    def array(self, name: str) -> np.ndarray:
        """An array. Raises ImportRefused where it is not there, damaged, pickled or too large."""
        if name in self._held:
            return self._held[name]
        if name not in self._members:
            names = ", ".join(shown(one) for one in sorted(self._members)[:20])
            raise ImportRefused(
                f"{self.path}: found no array {shown(name)}, expected it among {names or 'none'}"
            )
        info = self._members[name]
        if info.compress_type not in _PLAIN or info.flag_bits & 1:
            raise ImportRefused(
                f"{self.path}: array {shown(name)}: found it packed as numpy packs none, expected"
                " what numpy.savez or savez_compressed writes"
            )
        self._unpacked += info.file_size
        try:
            check_unpacked(self._unpacked, self._size, _ALWAYS_TAKEN, _LARGEST_RATIO)
        except TooLarge as error:
            raise ImportRefused(
                f"{self.path}: array {shown(name)}: found {error}, expected an NPZ file of a"
                " recording (numpy.savez writes it unpacked)"
            ) from None
        try:
            with self._zip.open(info) as member:
                values = self._parse(name, member, info.file_size)
        except ImportRefused:
            raise
        except Exception as error:  # a damaged file makes zipfile and numpy raise nearly anything
            raise ImportRefused(
                f"{self.path}: array {shown(name)}: found one that cannot be read"
                f" ({type(error).__name__}: {' '.join(str(error).split())[:80]}), expected a whole"
                " NPZ file"
            ) from None
        self._held[name] = values
        return values

    def _parse(self, name: str, member: IO[bytes], size: int) -> np.ndarray:
        form = np.lib.format
        version = form.read_magic(member)
        read = {(1, 0): form.read_array_header_1_0, (2, 0): form.read_array_header_2_0}.get(version)
        if read is None:
            raise ValueError(f"version {version} of its format")
        shape, by_columns, kind = read(member, max_header_size=_LONGEST_HEADER)
        if kind.hasobject:
            raise ImportRefused(
                f"{self.path}: array {shown(name)}: found pickled objects, which may run code when"
                " they are read, expected numbers (in numpy: save arrays of dtype float)"
            )
        count = math.prod(shape)
        if count * kind.itemsize > size:
            raise ValueError(f"its head says {shape}, more than there is")
        data = member.read(count * kind.itemsize)
        if len(data) != count * kind.itemsize or member.read(1):
            raise ValueError(f"its head says {shape}, another number than there is")
        return np.frombuffer(data, kind).reshape(shape, order="F" if by_columns else "C")


def _variable(file: NpzFile, name: str) -> np.ndarray:
    """An array, or a field of a structured one."""
    head, dot, field = name.rpartition(".")
    if name not in file.names and dot and head in file.names:
        values = file.array(head)
        if values.dtype.names is None or field not in values.dtype.names:
            raise ImportRefused(
                f"{file.path}: array {shown(head)}: found no field {shown(field)}, expected one of"
                f" {', '.join(values.dtype.names or ()) or 'a structured array'}"
            )
        return values[field]
    return file.array(name)


def _column(path: Path, file: NpzFile, column: str | int, missing: Sequence[str]) -> np.ndarray:
    if isinstance(column, int):
        raise ImportRefused(
            f"{path}: found column {column} by its number, expected the name of an array"
        )
    name, element = (column, None) if column in file.names else element_of(column)
    values = _variable(file, name)
    if values.dtype.kind in "mM":
        values = values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64)
    if values.dtype.kind not in "fiub":
        raise ImportRefused(
            f"{path}: array {shown(name)}: found {values.dtype.name[:40]}, expected numbers"
        )
    if element is not None:
        values = matrix_column(values, element, f"{path}: array {shown(name)}")
    elif values.ndim == 2 and values.shape[1] == 1:
        values = values[:, 0]
    if values.ndim != 1 or not len(values):
        raise ImportRefused(
            f"{path}: array {shown(name)}: found the shape {values.shape}, expected a vector (a"
            f" matrix's column is '{name}[0]')"
        )
    return numbers(values, lambda row: f"{path}: array {shown(name)}, index {row}", missing)


def _scalar(path: Path, file: NpzFile, name: str) -> float:
    values = _variable(file, name)
    if values.size != 1 or values.dtype.kind not in "fiu":
        raise ImportRefused(
            f"{path}: array {shown(name)}: found the shape {values.shape} of"
            f" {values.dtype.name[:40]}, expected one number"
        )
    value = float(values.reshape(-1)[0])
    if not math.isfinite(value) or value == 0.0:
        raise ImportRefused(
            f"{path}: array {shown(name)}: found {value}, expected a number other than zero"
        )
    return value
