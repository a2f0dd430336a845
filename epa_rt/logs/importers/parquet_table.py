"""Parquet files: columns by name, fields of structures, elements of lists."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from epa_rt.config.kinds import begun
from epa_rt.logs.importers.apart import Answer, Unreadable, read_apart
from epa_rt.logs.importers.table import ImportRefused, Table, why

_MAGIC = b"PAR1"
_LARGEST = 1 << 31
_OWN_BYTES = 300 << 20  # for pyarrow itself, beside three copies of what is in the file
_LARGEST_HELD = 512 << 20


def read_parquet(
    path: Path,
    wanted: Sequence[str | int],
    missing: Sequence[str] = (),
    most_rows: int | None = None,
) -> Table:
    """The wanted columns: 'q', 'joint.q' (a field), 'q[2]' (an element of a list, from 0); of the
    first ``most_rows`` rows, or of all. Stamps of the file's own types count in ns.

    Raises ImportRefused for the first thing that does not fit, with file, column and row.
    """
    by_number = next((column for column in wanted if isinstance(column, int)), None)
    if by_number is not None:
        raise ImportRefused(
            f"{path}: found column {by_number} by its number, expected the name of a column"
        )
    request = {"path": str(path.absolute()), "wanted": list(wanted), "missing": list(missing)}
    request["most_rows"] = most_rows
    _, columns = _ask(path, request)
    return Table(str(path), dict(columns), lambda row: f"{path}, row {row}")


def listed(path: Path) -> list[dict[str, str]]:
    """Name, kind and unit of every column, as the file says them. Raises ImportRefused."""
    facts, _ = _ask(path, {"path": str(path.absolute()), "list": True})
    found: list[dict[str, str]] = facts["listed"]
    return found


def _ask(path: Path, request: dict[str, Any]) -> Answer:
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(len(_MAGIC))
            file.seek(max(size - len(_MAGIC), 0))
            tail = file.read()
    except (OSError, ValueError) as error:
        raise ImportRefused(f"{path}: found {why(error)}, expected a Parquet file") from None
    if head != _MAGIC or size > _LARGEST:
        found = "more than 2 GB" if head == _MAGIC else begun(head)
        raise ImportRefused(f"{path}: found {found}, expected a Parquet file")
    if tail != _MAGIC:
        raise ImportRefused(
            f"{path}: found a file that was cut at byte {size} (its last bytes are missing),"
            " expected a whole Parquet file"
        )
    try:
        return read_apart("parquet_child", request, _OWN_BYTES + 3 * min(size, _LARGEST_HELD))
    except Unreadable as error:
        raise ImportRefused(
            f"{path}: found a file that is no whole Parquet file ({error}), expected one"
        ) from None
    except ImportRefused as error:
        raise ImportRefused(str(error).replace(request["path"], str(path))) from None
