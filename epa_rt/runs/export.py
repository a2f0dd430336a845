"""Tables as files of other programs: CSV, Parquet, MAT. Every number keeps its last bit."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from epa_rt.runs.table import SCHEMA, Named, Table

if TYPE_CHECKING:
    import pyarrow as pa

_MAT_NAME = 63  # characters of a name in MATLAB
_MAT_BYTES = 2**31 - 1  # of one array in a MAT file of version 5
_ROWS = 65_536  # of one group of rows


class ExportError(Exception):
    """The table does not fit the format; one sentence."""


def write_csv(table: Table, file: IO[bytes]) -> None:
    """Names in the first line, NaN as nan. Units are in the names and in the file beside it."""
    from pyarrow import csv

    found = _arrow(table)
    with csv.CSVWriter(
        file, found.schema, write_options=csv.WriteOptions(quoting_style="needed")
    ) as writer:
        for batch in found.to_batches(_ROWS):
            writer.write_batch(batch)


def write_parquet(table: Table, file: IO[bytes]) -> None:
    """Units as metadata of each column; all that the log says besides under the keys 'epa_rt' and
    'PANDAS_ATTRS', from which pandas fills ``attrs``.
    """
    from pyarrow import parquet

    with parquet.ParquetWriter(file, _arrow(table).schema) as writer:
        writer.write_table(_arrow(table), _ROWS)


def write_mat(table: Table, file: IO[bytes]) -> None:
    """One struct ``run``: columns (N x 1), ``units``, ``state_names``, ``phase_names``, ``trials``,
    ``events``, ``about``. States and phases count from 1, as MATLAB does; 0 is none.

    Raises ExportError for a name or a column that the format does not take.
    """
    from scipy.io import savemat

    columns: dict[str, Any] = {}
    for name, column in table.columns.items():
        if isinstance(column, Named):
            columns[name] = column.index + 1
            columns[f"{name}_names"] = _cell(column.names)
        else:
            columns[name] = column
    for name, values in columns.items():
        if len(name) > _MAT_NAME or name.startswith("_") or values.nbytes > _MAT_BYTES:
            raise ExportError(
                f"found {name} with {len(name)} characters and {values.nbytes} bytes, expected a"
                f" letter first and at most {_MAT_NAME} and {_MAT_BYTES} in a MAT file; write"
                " Parquet instead"
            )
    told = dict(table.about)
    columns["units"] = {name: unit for name, unit in table.units.items() if unit} or ""
    for key in ("trials", "events"):
        columns[key] = _cell([json.dumps(one, ensure_ascii=False) for one in told.pop(key)])
    columns["about"] = json.dumps({"schema": SCHEMA, **told}, ensure_ascii=False)
    savemat(file, {"run": columns}, long_field_names=True, oned_as="column")


WRITERS: dict[str, Callable[[Table, IO[bytes]], None]] = {
    ".csv": write_csv,
    ".parquet": write_parquet,
    ".mat": write_mat,
}


def about_text(table: Table) -> str:
    """What goes beside a CSV file: units, run, record, trials, events; JSON proper."""
    told = {"schema": SCHEMA, "units": dict(table.units), **table.about}
    return json.dumps(_proper(told), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _proper(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _proper(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_proper(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _arrow(table: Table) -> pa.Table:
    import pyarrow as pa

    arrays, fields = [], []
    for name, column in table.columns.items():
        if isinstance(column, Named):
            array = pa.DictionaryArray.from_arrays(
                pa.array(column.index, pa.int32(), mask=column.index < 0),
                pa.array(list(column.names), pa.string()),
            ).cast(pa.string())
        else:  # NaN stays NaN; nothing is missing
            array = pa.array(np.ascontiguousarray(column), from_pandas=False)
        arrays.append(array)
        metadata = {"unit": table.units[name]} if table.units[name] else None
        fields.append(pa.field(name, array.type, metadata=metadata))
    told = json.dumps(
        _proper({"schema": SCHEMA, "units": dict(table.units), **table.about}), ensure_ascii=False
    )
    return pa.Table.from_arrays(
        arrays, schema=pa.schema(fields, metadata={"epa_rt": told, "PANDAS_ATTRS": told})
    )


def _cell(texts: Any) -> np.ndarray:
    cell = np.empty(len(texts), dtype=object)
    cell[:] = list(texts)
    return cell
