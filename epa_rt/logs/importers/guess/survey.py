"""What a foreign file holds, before anything is said about its meaning: tables of numbers."""

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.logs.importers.address import number_of
from epa_rt.logs.importers.guess.csv_survey import survey_csv
from epa_rt.logs.importers.guess.seen import Seen, Survey, numbered
from epa_rt.logs.importers.jsonl_table import objects, read_jsonl
from epa_rt.logs.importers.mapping import Format
from epa_rt.logs.importers.mat_table import load_mat
from epa_rt.logs.importers.mcap_table import first_messages, read_mcap
from epa_rt.logs.importers.npz_table import NpzFile
from epa_rt.logs.importers.parquet_table import listed as parquet_listed
from epa_rt.logs.importers.parquet_table import read_parquet
from epa_rt.logs.importers.ros_table import RECEIVED, storages, survey_bag
from epa_rt.logs.importers.table import ImportRefused, Table, shown, why

_MISSING = ("nan", "null")
_MOST_COLUMNS = 300
_MOST_ELEMENTS = 64
_MOST_ROWS = 200_000  # of a table; enough for every trait
_FIRST_LINES = 50
_LONGEST_NAME = 200
_MAGIC = {
    b"\x89MCAP": "mcap",
    b"SQLite format 3": "rosbag",
    b"PAR1": "parquet",
    b"PK\x03\x04": "npz",
    b"PK\x05\x06": "npz",
    b"MATLAB": "mat",
}


def kind_of(path: Path) -> str:
    """The ``kind`` of a mapping's format, by content, then by ending. Raises ImportRefused."""
    try:
        if path.is_dir():
            return "rosbag"
        with path.open("rb") as file:
            head = file.read(4096)
    except (OSError, ValueError) as error:
        raise ImportRefused(f"{path}: found {why(error)}, expected a recording") from None
    if not head:
        raise ImportRefused(f"{path}: found an empty file, expected a recording")
    for magic, kind in _MAGIC.items():
        if head.startswith(magic):
            return kind
    if path.suffix.lower() == ".mat":
        return "mat"
    is_lines = head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{")
    return "jsonl" if is_lines else "csv"


def survey(path: Path) -> Survey:
    """All numbers of a file, by table. Raises ImportRefused where it cannot be read."""
    kind = kind_of(path)
    try:
        found = _SURVEYS[kind](path)
    except RecursionError:
        raise ImportRefused(
            f"{path}: found brackets nested too deep, expected a recording"
        ) from None
    found = replace(found, tables=tuple(_with_short_names(seen) for seen in found.tables))
    if any(_rows(seen) == _MOST_ROWS for seen in found.tables):
        cut = f"only the first {_MOST_ROWS} rows of a table were looked at"
        found = replace(found, unsure=(*found.unsure, cut))
    if not any(seen.columns for seen in found.tables):
        why_not = f" ({'; '.join(found.unsure)[:300]})" if found.unsure else ""
        raise ImportRefused(f"{path}: found no column of numbers{why_not}, expected some")
    return found


def _rows(seen: Seen) -> int:
    return len(next(iter(seen.columns.values()), ()))


def _with_short_names(seen: Seen) -> Seen:
    """Without the columns whose name no mapping takes: too long, or no text."""
    kept = {
        c: v
        for c, v in seen.columns.items()
        if 0 < len(str(c)) <= _LONGEST_NAME and not re.search("[\ud800-\udfff]", str(c))
    }
    return replace(seen, columns=kept)


def _addresses(value: Any, at: str = "") -> Iterator[str]:
    """Addresses of all numbers in an object of JSON; a stamp of sec and nanosec is one number."""
    if number_of(value) is not None or value is None:
        yield at
    elif isinstance(value, list):
        for i in range(min(len(value), _MOST_ELEMENTS)):
            yield from _addresses(value[i], f"{at}[{i}]")
    elif isinstance(value, dict):
        names = value.get("name", value.get("joint_names"))
        names = names if isinstance(names, list) else []
        for key, inner in value.items():
            where = f"{at}.{key}" if at else str(key)
            is_named = bool(names) and isinstance(inner, list) and inner is not names
            if is_named and len(inner) == len(names) and all(isinstance(n, str) for n in names):
                yield from (f"{where}[{name}]" for name in names[:_MOST_ELEMENTS])
            else:
                yield from _addresses(inner, where)


def _survey_jsonl(path: Path) -> Survey:
    addresses: dict[str, None] = {}
    texts: dict[str, None] = {}
    for _, content in islice(objects(path), _FIRST_LINES):
        addresses.update(dict.fromkeys(islice(_addresses(content), _MOST_COLUMNS)))
        texts.update({k: None for k, v in content.items() if isinstance(v, str)})
    wanted = list(addresses)[:_MOST_COLUMNS]
    if not wanted:
        raise ImportRefused(f"{path}:1: found no number on the first lines, expected some")
    table = read_jsonl(path, Format(kind="jsonl", missing=_MISSING), wanted, _MOST_ROWS)
    seen = _seen(path, table, texts=tuple(texts)[:_MOST_ELEMENTS])
    return Survey("jsonl", {}, (seen.also_missing("null") if seen.missing else seen,))


def _seen(
    path: Path,
    table: Table,
    topic: str | None = None,
    kind: str = "",
    units: dict[str | int, str] | None = None,
    texts: tuple[str, ...] = (),
) -> Seen:
    columns = {
        name: values for name, values in table.columns.items() if not np.all(np.isnan(values))
    }
    gone = any(np.isnan(values).any() for values in columns.values())
    return Seen(
        path,
        topic,
        columns,
        kind,
        units or {},
        texts + tuple(str(name) for name in table.columns if name not in columns),
        missing=("nan",) if gone else (),
    )


def _survey_parquet(path: Path) -> Survey:
    fields = parquet_listed(path)
    plain = ("int", "uint", "float", "double", "half", "bool", "timestamp", "duration", "decimal")
    wanted = [f for f in fields if f["kind"].startswith(plain) and not f["name"].startswith("__")]
    texts = tuple(f["name"] for f in fields if f not in wanted)
    wanted = wanted[:_MOST_COLUMNS]
    table = read_parquet(path, [f["name"] for f in wanted], _MISSING, _MOST_ROWS)
    units: dict[str | int, str] = {f["name"]: f["unit"] for f in wanted if f["unit"]}
    by_null = any(np.isnan(v).any() for v in table.columns.values())
    seen = _seen(path, table, units=units, texts=texts)
    return Survey("parquet", {}, (seen.also_missing("null") if by_null else seen,))


def _survey_npz(path: Path) -> Survey:
    with NpzFile(path) as file:
        content: dict[str, Any] = {}
        texts: list[str] = []
        first: ImportRefused | None = None
        for name in file.names[:_MOST_COLUMNS]:
            try:
                content[name] = file.array(name)
            except ImportRefused as error:
                texts.append(f"{name} ({'pickled' if 'pickled' in str(error) else 'unreadable'})")
                first = first or error
        if first is not None and not content:
            raise first
    return Survey("npz", {}, (_of_arrays(path, content, tuple(texts)),))


def _survey_mat(path: Path) -> Survey:
    content = {name: v for name, v in load_mat(path).items() if not name.startswith("__")}
    return Survey("mat", {}, (_of_arrays(path, content, ()),))


def _of_arrays(path: Path, content: dict[str, Any], texts: tuple[str, ...]) -> Seen:
    """Arrays of the length that most have; scalars apart."""
    flat: dict[str, np.ndarray] = {}
    scalars: dict[str, float] = {}
    others = list(texts)
    for name, values in _leaves(content):
        if values is None:
            others.append(name)
        elif values.size == 1:
            scalars[name] = float(values.reshape(-1)[0])
        elif values.ndim == 2 and 1 < values.shape[1] <= _MOST_ELEMENTS:
            flat.update({f"{name}[{i}]": values[:, i] for i in range(values.shape[1])})
        elif values.ndim == 2 and values.shape[1] == 1:
            flat[name] = values[:, 0]
        elif values.ndim == 1:
            flat[name] = values
        else:
            others.append(name)
    lengths = [len(values) for values in flat.values()]
    rows = max(set(lengths), key=lengths.count) if lengths else 0
    kept = {name: numbered(values) for name, values in flat.items() if len(values) == rows}
    others += [name for name in flat if name not in kept]
    table = Table(str(path), dict(list(kept.items())[:_MOST_COLUMNS]), lambda row: "")
    seen = _seen(path, table, texts=tuple(others))
    return seen.with_scalars(scalars)


def _leaves(content: dict[str, Any], at: str = "") -> Iterator[tuple[str, np.ndarray | None]]:
    """Arrays of numbers by address, through structures; None for what is none."""
    for key, value in content.items():
        name = f"{at}{key}"
        if isinstance(value, dict):
            yield from _leaves(value, f"{name}.")
            continue
        values = None if isinstance(value, (list, str)) else np.asarray(value)
        if values is not None and values.dtype.names:
            yield from _leaves({field: values[field] for field in values.dtype.names}, f"{name}.")
        elif values is not None and values.dtype.kind in "mM":
            yield name, values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64)
        else:
            yield name, values if values is not None and values.dtype.kind in "fiub" else None


def _survey_bag(path: Path) -> Survey:
    if storages(path)[0].kind == "mcap":
        first = first_messages(storages(path)[0].path)
        if first:
            return _survey_mcap(storages(path)[0].path, first)
    tables, notes = [], []
    for topic, table in survey_bag(path, _MOST_ROWS):
        if not table.columns:
            why_not = f": {topic['why']}" if topic.get("why") else ""
            what = f"topic {shown(topic['topic'])} ({shown(topic['type'])})"
            notes.append(f"{what} has no numbers{why_not}")
            continue
        tables.append(_seen(path, table, topic["topic"], topic["type"]))
    return Survey("rosbag", {}, tuple(tables), tuple(notes))


def _survey_mcap(path: Path, first: dict[str, Any]) -> Survey:
    tables = []
    for topic, content in first.items():
        wanted = list(dict.fromkeys(_addresses(content)))[:_MOST_COLUMNS]
        table = read_mcap(path, topic, [*wanted, RECEIVED], _MISSING)
        if table is not None:
            tables.append(_seen(path, table, topic))
    return Survey("mcap", {}, tuple(tables))


_SURVEYS = {
    "csv": survey_csv,
    "jsonl": _survey_jsonl,
    "parquet": _survey_parquet,
    "npz": _survey_npz,
    "mat": _survey_mat,
    "rosbag": _survey_bag,
    "mcap": _survey_bag,
}
