"""One table of a foreign file, by the kind that the mapping says."""

from collections.abc import Sequence
from pathlib import Path

from epa_rt.logs.importers.csv_table import read_csv
from epa_rt.logs.importers.jsonl_table import read_jsonl
from epa_rt.logs.importers.mapping import Format
from epa_rt.logs.importers.mat_table import read_mat
from epa_rt.logs.importers.npz_table import read_npz
from epa_rt.logs.importers.parquet_table import read_parquet
from epa_rt.logs.importers.ros_table import read_bag
from epa_rt.logs.importers.table import Table


def read_table(
    path: Path,
    topic: str | None,
    form: Format,
    wanted: Sequence[str | int],
    constants: Sequence[str] = (),
) -> tuple[Table, dict[str, float]]:
    """The wanted columns of a file or of one topic, and scalars of a MAT or NPZ file.

    Raises ImportRefused for the first thing that does not fit, with file, place and column.
    """
    if form.kind == "mat":
        return read_mat(path, wanted, constants, form.missing)
    if form.kind == "npz":
        return read_npz(path, wanted, constants, form.missing)
    if form.kind == "csv":
        return read_csv(path, form, wanted), {}
    if form.kind == "jsonl":
        return read_jsonl(path, form, wanted), {}
    if form.kind == "parquet":
        return read_parquet(path, wanted, form.missing), {}
    return read_bag(path, str(topic), wanted, form.missing), {}
