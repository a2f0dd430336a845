"""JSON lines: an object on each line, read line by line and refused with its line."""

import json
from array import array
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO

from epa_rt.logs.importers.columns import FieldColumns
from epa_rt.logs.importers.mapping import Format
from epa_rt.logs.importers.table import ImportRefused, Table, shown, why

_LARGEST = 1 << 30  # bytes of a file
_LONGEST_LINE = 1 << 20  # bytes; a message of a hundred joints takes a hundredth of it
_MOST_ROWS = 50_000_000
_MARK = b"\xef\xbb\xbf"


def read_jsonl(
    path: Path, form: Format, wanted: Sequence[str | int], most_rows: int | None = None
) -> Table:
    """The wanted fields: 'force', 'imu.gyro.x', 'position[2]', 'position[knee]' (by the list
    'name'); of the first ``most_rows`` lines, or of all.

    Raises ImportRefused for the first thing that does not fit, with file, line and field.
    """
    try:
        columns = FieldColumns(wanted, form.missing)
    except ImportRefused as error:
        raise ImportRefused(f"{path}:1: {error}") from None
    lines = array("q")
    for number, content in islice(objects(path), most_rows):
        columns.add(lambda number=number: f"{path}:{number}", content, {})
        lines.append(number)
    if not lines:
        raise ImportRefused(f"{path}:1: found no line, expected a JSON object on each")
    return Table(str(path), columns.arrays(), lambda row: f"{path}:{lines[row]}")


def objects(path: Path) -> Iterator[tuple[int, dict[str, Any]]]:
    """Number of a line, from 1, and its object. Raises ImportRefused for a line that is none."""
    try:
        if path.stat().st_size > _LARGEST:
            raise ImportRefused(
                f"{path}:1: found more than {_LARGEST >> 30} GB, expected a smaller file"
            )
        with path.open("rb") as file:
            yield from _lines(path, file)
    except (OSError, ValueError) as error:
        raise ImportRefused(f"{path}:1: found {why(error)}, expected JSON lines") from None


def _lines(path: Path, file: BinaryIO) -> Iterator[tuple[int, dict[str, Any]]]:
    number = 0
    while line := file.readline(_LONGEST_LINE + 1):
        number += 1
        if number > _MOST_ROWS:
            raise ImportRefused(
                f"{path}:{number}: found more than {_MOST_ROWS} lines, expected fewer"
            )
        if len(line) > _LONGEST_LINE:
            raise ImportRefused(
                f"{path}:{number}: found a line of over {_LONGEST_LINE >> 20} MB, expected one"
                " object on each line"
            )
        if number == 1:
            line = line.removeprefix(_MARK)
        if not line.strip():
            continue
        yield number, _object(path, number, line)


def _object(path: Path, number: int, line: bytes) -> dict[str, Any]:
    try:
        content = json.loads(line)
    except RecursionError:
        raise ImportRefused(
            f"{path}:{number}: found brackets nested too deep, expected a JSON object"
        ) from None
    except ValueError as error:  # no JSON, no UTF-8, or a whole number of thousands of digits
        cut = "" if line.endswith(b"\n") else "; it is the last line, the file may be cut"
        raise ImportRefused(
            f"{path}:{number}: found a line that is not JSON ({str(error)[:80]}), expected an"
            f" object{cut}"
        ) from None
    if not isinstance(content, dict):
        raise ImportRefused(
            f"{path}:{number}: found {shown(str(content))}, expected a JSON object with the"
            " columns' names"
        )
    return content
