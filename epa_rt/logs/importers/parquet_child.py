"""The process that reads a Parquet file: runs pyarrow within bounds (apart.py)."""

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from epa_rt.logs.importers.address import Element, NoSuchPlace, steps_of
from epa_rt.logs.importers.apart import Answer, serve
from epa_rt.logs.importers.table import ImportRefused, may_be_missing, missing_hint, numbers, shown
from epa_rt.logs.importers.unpacked import TooLarge, check_unpacked

_BATCH_ROWS = 1 << 14
_ALWAYS_TAKEN = 64 << 20
_LARGEST_RATIO = 40.0
_MOST_FIELDS = 1000
_MOST_LISTED = 64  # elements of a list that are worth a column each


def answer(request: dict[str, Any]) -> Answer:
    """``list``: names and units of what the file has; else the columns ``wanted``."""
    path = Path(request["path"])
    with pq.ParquetFile(path, memory_map=False, pre_buffer=False) as file:
        if request.get("list"):
            return _listed(file)
        return {}, _columns(path, file, request)


def _columns(path: Path, file: pq.ParquetFile, request: dict[str, Any]) -> dict[str, np.ndarray]:
    wanted, missing, most_rows = (request[key] for key in ("wanted", "missing", "most_rows"))
    known = dict.fromkeys(file.schema_arrow.names)
    tops = {column: _top(path, known, column) for column in wanted}
    rows = min(file.metadata.num_rows, most_rows or file.metadata.num_rows)
    try:
        check_unpacked(8 * rows * len(wanted), path.stat().st_size, _ALWAYS_TAKEN, _LARGEST_RATIO)
    except TooLarge as error:
        raise ImportRefused(
            f"{path}: found {error}, expected a Parquet file of a recording"
        ) from None
    pieces: dict[str, list[np.ndarray]] = {column: [] for column in wanted}
    at = 0
    names = sorted({top for top, _ in tops.values()})
    for batch in file.iter_batches(_BATCH_ROWS, columns=names, use_threads=False):
        batch = batch.slice(0, rows - at) if most_rows else batch
        for column, (top, steps) in tops.items():
            pieces[column].append(_numbers(path, batch.column(top), column, steps, at, missing))
        at += batch.num_rows
        if at > rows or most_rows and at == rows:
            break
    if at != rows or not rows:
        raise ImportRefused(
            f"{path}: found {at} rows, expected {rows or 'some'} as its footer says"
        )
    return {column: _joined(found) for column, found in pieces.items()}


def _joined(pieces: list[np.ndarray]) -> np.ndarray:
    """Whole numbers stay whole where all pieces are."""
    if any(piece.dtype.kind == "f" for piece in pieces):
        pieces = [piece.astype(np.float64) for piece in pieces]
    return np.concatenate(pieces)


def _top(path: Path, known: dict[str, None], column: str) -> tuple[str, tuple[Any, ...]]:
    """The column of the file, and the steps from there to the numbers."""
    if column in known:
        return column, ()
    try:
        head, *steps = steps_of(column)
    except NoSuchPlace:
        head, steps = column, []
    if head not in known:
        names = ", ".join(shown(name) for name in list(known)[:20])
        raise ImportRefused(
            f"{path}: found no column {shown(column)}, expected it among {names or 'none at all'}"
        )
    return head, tuple(steps)


def _numbers(
    path: Path, values: pa.Array, column: str, steps: tuple, first: int, missing: list[str]
) -> np.ndarray:
    def place(row: int) -> str:
        return f"{path}: column {shown(column)}, row {first + row}"

    for step in steps:
        values = _stepped(values, step, place)
    if pa.types.is_dictionary(values.type):
        values = values.dictionary_decode()
    kind = values.type
    if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
        to = pa.timestamp("ns", kind.tz) if pa.types.is_timestamp(kind) else pa.duration("ns")
        values = pc.cast(values, to).cast(pa.int64())
    elif pa.types.is_decimal(kind):
        values = pc.cast(values, pa.float64())
    elif pa.types.is_boolean(kind):
        values = pc.cast(values, pa.int8())
    elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind)):
        raise ImportRefused(f"{place(0)}: found {shown(str(kind))}, expected numbers")
    if values.null_count:
        if not may_be_missing("null", missing):
            row = int(np.argmax(values.is_null().to_numpy(zero_copy_only=False)))
            raise ImportRefused(
                f"{place(row)}: found no value (null), expected a number{missing_hint('null')}"
            )
        gone = values.is_null().to_numpy(zero_copy_only=False)
        found = pc.fill_null(values, 0).to_numpy(zero_copy_only=False)
        found = numbers(found, place, missing).astype(np.float64)
        found[gone] = np.nan
        return found
    return numbers(values.to_numpy(zero_copy_only=False), place, missing)


def _stepped(values: pa.Array, step: Any, place: Any) -> pa.Array:
    kind = values.type
    if isinstance(step, str):
        if pa.types.is_struct(kind) and kind.get_field_index(step) >= 0:
            return pc.struct_field(values, step)
        raise ImportRefused(f"{place(0)}: found no field {shown(step)}, expected one")
    is_list = (
        pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind)
    )
    if isinstance(step, Element) or not is_list:
        raise ImportRefused(
            f"{place(0)}: found {shown(str(kind))}, expected a list with elements by number"
        )
    lengths = pc.fill_null(pc.list_value_length(values), 0).to_numpy(zero_copy_only=False)
    short = lengths <= step
    if short.any():
        row = int(short.argmax())
        raise ImportRefused(
            f"{place(row)}: found a list of {lengths[row]}, expected an element {step}, counted"
            " from 0"
        )
    return pc.list_element(values, step)


def _listed(file: pq.ParquetFile) -> Answer:
    fields = list(file.schema_arrow)[:_MOST_FIELDS]
    lists = [field.name for field in fields if pa.types.is_nested(field.type)]
    batches = file.iter_batches(1, columns=lists, use_threads=False) if lists else iter(())
    first = next(iter(batches), None)
    found: list[dict[str, str]] = []
    for field in fields:
        unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")[:40]
        is_read = first is not None and field.name in lists
        value = first.column(field.name)[0].as_py() if is_read else None
        found += _flat(field.name, field.type, value, unit)
    return {"listed": found, "rows": file.metadata.num_rows}, {}


def _flat(name: str, kind: pa.DataType, value: Any, unit: str) -> list[dict[str, str]]:
    if pa.types.is_struct(kind):
        return [
            one
            for i in range(min(kind.num_fields, _MOST_LISTED))
            for one in _flat(
                f"{name}.{kind.field(i).name}",
                kind.field(i).type,
                (value or {}).get(kind.field(i).name),
                unit,
            )
        ]
    if isinstance(value, list):
        return [
            one
            for i in range(min(len(value), _MOST_LISTED))
            for one in _flat(f"{name}[{i}]", kind.value_type, value[i], unit)
        ]
    is_stamp = pa.types.is_timestamp(kind) or pa.types.is_duration(kind)
    return [{"name": name, "kind": str(kind)[:60], "unit": "ns" if is_stamp else unit}]


if __name__ == "__main__":
    serve(answer)
