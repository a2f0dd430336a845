"""ROS 2 bags: a folder with metadata.yaml, or its MCAP or db3 file; a table for each topic."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.config.source import ConfigError, load_yaml
from epa_rt.logs.importers.apart import Answer, Unreadable, read_apart
from epa_rt.logs.importers.mcap_table import check_mcap, read_mcap
from epa_rt.logs.importers.table import ImportRefused, Table, shown, why

_SQLITE = b"SQLite format 3\x00"
_METADATA = "metadata.yaml"
_OWN_BYTES = 256 << 20
_LARGEST_HELD = 512 << 20
_LARGEST = 1 << 35
HEADER_STAMP, RECEIVED, SENT = "header.stamp", "log_time", "publish_time"


@dataclass(frozen=True)
class Storage:
    """A file of a bag: 'mcap' or 'db3', and whether each message in it is packed."""

    path: Path
    kind: str
    packed: bool = False


def storages(path: Path) -> tuple[Storage, ...]:
    """The files of a bag, in their order in time. Raises ImportRefused where it is none."""
    try:
        if not path.is_dir():
            return (Storage(path, _kind(path)),)
    except (OSError, ValueError) as error:
        raise ImportRefused(f"{path}: found {why(error)}, expected a ROS 2 bag") from None
    try:
        located = load_yaml(path / _METADATA)
    except ConfigError as error:
        raise ImportRefused(
            f"{path}: found a folder whose {_METADATA} cannot be read ({error.found}), expected a"
            " ROS 2 bag"
        ) from None
    facts = located.data.get("rosbag2_bagfile_information")
    names = facts.get("relative_file_paths") if isinstance(facts, dict) else None
    if not isinstance(names, list) or not names or not all(isinstance(n, str) for n in names):
        raise ImportRefused(
            f"{path / _METADATA}:1: found no 'relative_file_paths', expected those of a ROS 2 bag"
        )
    mode = str(facts.get("compression_mode") or "").lower()
    if mode == "file":
        raise ImportRefused(
            f"{path}: found a bag whose files are packed whole, expected them unpacked (zstd -d"
            f" {shown(Path(names[0]).name)}, or ros2 bag convert)"
        )
    files = [path / Path(name).name for name in names]
    return tuple(Storage(file, _kind(file), mode == "message") for file in files)


def _kind(path: Path) -> str:
    try:
        with path.open("rb") as file:
            head = file.read(len(_SQLITE))
        size = path.stat().st_size
        beside = path.with_name(path.name + "-wal")
        is_open = beside.is_file() and beside.stat().st_size > 0
    except (OSError, ValueError) as error:
        raise ImportRefused(f"{path}: found {why(error)}, expected a ROS 2 bag") from None
    if size > _LARGEST:
        raise ImportRefused(f"{path}: found more than 32 GB, expected a smaller file")
    if head != _SQLITE:
        return "mcap"
    if is_open:
        raise ImportRefused(
            f"{path}: found messages in {beside.name} that never came into the bag, expected a bag"
            " that was closed (sqlite3 FILE 'PRAGMA wal_checkpoint' puts them there)"
        )
    return "db3"


def read_bag(
    path: Path, topic: str, wanted: Sequence[str | int], missing: Sequence[str] = ()
) -> Table:
    """The wanted fields of a topic's messages, of all files of a bag: 'position[knee]' (by the
    names in the message), 'wrench.force.z', 'header.stamp', 'log_time', both in ns.

    Raises ImportRefused for the first thing that does not fit, with file, message and field.
    """
    parts = [_read(storage, topic, wanted, missing) for storage in storages(path)]
    if len(parts) == 1:
        return parts[0]
    ends = np.cumsum([part.rows for part in parts])

    def place(row: int) -> str:
        part = int(np.searchsorted(ends, row, side="right"))
        return parts[part].place(row - (int(ends[part - 1]) if part else 0))

    columns = {name: np.concatenate([part.columns[name] for part in parts]) for name in wanted}
    return Table(str(path), columns, place, parts[0].says)


def _read(
    storage: Storage, topic: str, wanted: Sequence[str | int], missing: Sequence[str]
) -> Table:
    path = storage.path
    if storage.kind == "mcap":
        table = read_mcap(path, topic, wanted, missing)
        if table is not None:
            return table
    by_number = next((column for column in wanted if isinstance(column, int)), None)
    if by_number is not None:
        raise ImportRefused(
            f"{path}: found column {by_number} by its number, expected the name of a field"
        )
    request = {"topic": topic, "wanted": list(wanted), "missing": list(missing)}
    facts, columns = _ask(storage, request)
    return Table(
        str(path),
        {**columns},
        lambda row: f"{path}: {topic}, message {row}",
        _stamps_said(topic, facts, wanted),
    )


def survey_bag(path: Path, most_rows: int) -> list[tuple[dict[str, Any], Table]]:
    """Of each topic of a bag's first file what it is ('topic', 'type', 'why' it cannot be read),
    and all numbers of its first messages. Raises ImportRefused.
    """
    storage = storages(path)[0]
    if storage.kind == "mcap":
        check_mcap(storage.path)
    facts, columns = _ask(storage, {"list": True, "most_rows": most_rows})
    found = []
    for number, topic in enumerate(facts["topics"]):
        head = f"{number} "
        own: dict[str | int, np.ndarray] = {
            n.removeprefix(head): v for n, v in columns.items() if n.startswith(head)
        }
        found.append((topic, Table(str(path), own, lambda row: "")))
    return found


def _ask(storage: Storage, request: dict[str, Any]) -> Answer:
    path = storage.path
    request |= {"path": str(path.absolute()), "shown": str(path), "storage": storage.kind}
    request["packed"] = storage.packed
    try:
        own_bytes = _OWN_BYTES + min(path.stat().st_size, _LARGEST_HELD)
        return read_apart("ros_child", request, own_bytes)
    except Unreadable as error:
        raise ImportRefused(
            f"{path}: found a file that is no whole ROS 2 bag ({error}), expected one"
        ) from None


def _stamps_said(topic: str, facts: dict[str, Any], wanted: Sequence[str | int]) -> tuple[str, ...]:
    """Which stamps are used, and how far the others lie from them."""
    if not facts["header"]:
        return (
            (f"{topic}: stamps are those of receipt (log_time); its messages have no header",)
            if RECEIVED in wanted
            else ()
        )
    low, median, high = (f"{1e3 * value:.4g}" for value in facts["late_s"])
    late = f"receipt came {median} ms after them as a rule, {low} to {high} ms"
    if HEADER_STAMP in wanted:
        return (f"{topic}: stamps are those of the headers (header.stamp); {late}",)
    if RECEIVED in wanted:
        return (
            f"{topic}: stamps are those of receipt (log_time), not those of the headers; {late}"
            " ('column: header.stamp' under clock takes the headers')",
        )
    return ()
