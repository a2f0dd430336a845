"""MCAP files of others: messages in JSON or protobuf, one table for each topic."""

import json
import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from epa_rt.logs.importers.mcap_bounds import oversized_chunk
from epa_rt.logs.importers.table import ImportRefused, Table, element_of, shown, why

STAMPS = ("log_time", "publish_time")
_ENCODINGS = ("json", "protobuf")


def read_mcap(path: Path, topic: str, wanted: Sequence[str | int]) -> Table:
    """The wanted fields of a topic's messages: 'force', 'header.seq', 'position[2]'; log_time and
    publish_time in ns.

    Raises ImportRefused for the first thing that does not fit, with file, message number (from 0)
    and field.
    """
    values: dict[str | int, list[float]] = {column: [] for column in wanted}
    decoders: dict[int, Callable[[bytes], Any]] = {}
    number = 0
    for schema, channel, message in _messages(path, topic):
        if channel.id not in decoders:
            decoders[channel.id] = _decoder(path, schema, channel)
        place = f"{path}: {topic}, message {number}"
        try:
            content = decoders[channel.id](message.data)
        except Exception as error:  # a message that is none: whatever json or protobuf raise
            raise ImportRefused(
                f"{place}: found a message that cannot be decoded ({type(error).__name__}),"
                f" expected {channel.message_encoding}"
            ) from None
        for column, into in values.items():
            into.append(
                float(getattr(message, column))
                if column in STAMPS
                else _field(place, content, column)
            )
        number += 1
    if not number:
        raise ImportRefused(
            f"{path}: found no message on {shown(topic)}, expected some (topics: {_topics(path)})"
        )
    columns = {column: np.array(found) for column, found in values.items()}
    return Table(str(path), columns, lambda row: f"{path}: {topic}, message {row}")


def _messages(path: Path, topic: str):
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    try:
        with path.open("rb") as file:
            _check_ends(path, file)
            yield from make_reader(file, validate_crcs=True).iter_messages(topics=[topic])
    except ImportRefused:
        raise
    except OSError as error:
        raise ImportRefused(f"{path}: found {why(error)}, expected an MCAP file") from None
    except (
        McapError,
        Exception,
    ) as error:  # a damaged file makes the library raise nearly anything
        reason = " ".join(str(error).split())[:120]
        raise ImportRefused(
            f"{path}: found a file that is no whole MCAP file ({type(error).__name__}: {reason}),"
            " expected one"
        ) from None


def _check_ends(path: Path, file: BinaryIO) -> None:
    """Raises ImportRefused for what is no MCAP file or was cut. A pipe or a folder raises
    OSError.
    """
    from mcap.writer import MCAP0_MAGIC

    first, size = file.read(len(MCAP0_MAGIC)), file.seek(0, os.SEEK_END)
    if first != MCAP0_MAGIC:
        raise ImportRefused(
            f"{path}: found {f'a file that begins with {first!r}' if first else 'an empty file'},"
            f" expected an MCAP file (it begins with {MCAP0_MAGIC!r})"
        )
    file.seek(max(size - len(MCAP0_MAGIC), 0))
    if size < 2 * len(MCAP0_MAGIC) or file.read() != MCAP0_MAGIC:
        raise ImportRefused(
            f"{path}: found a file that was cut at byte {size} (its last bytes are missing),"
            " expected a whole MCAP file"
        )
    too_large = oversized_chunk(file, size)
    if too_large is not None:
        raise ImportRefused(f"{path}: found {too_large}, expected smaller ones")
    file.seek(0)


def _topics(path: Path) -> str:
    from mcap.reader import make_reader

    try:
        with path.open("rb") as file:
            summary = make_reader(file).get_summary()
        names = sorted(channel.topic for channel in summary.channels.values())
    except Exception:  # only words for a sentence that is said anyway
        return "unknown"
    return ", ".join(shown(name) for name in names[:12]) or "none"


def _decoder(path: Path, schema: Any, channel: Any) -> Callable[[bytes], Any]:
    if channel.message_encoding == "json":
        return json.loads
    if channel.message_encoding != "protobuf" or schema is None:
        raise ImportRefused(
            f"{path}: {channel.topic}: found messages in {shown(channel.message_encoding)},"
            f" expected {' or '.join(_ENCODINGS)}"
        )
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    try:
        files = descriptor_pb2.FileDescriptorSet.FromString(schema.data)
        pool = descriptor_pool.DescriptorPool()
        for file in files.file:
            pool.Add(file)
        return message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString
    except Exception as error:  # a broken schema: TypeError, KeyError, DecodeError, ...
        raise ImportRefused(
            f"{path}: {channel.topic}: found a schema that is no protobuf one"
            f" ({type(error).__name__}), expected a FileDescriptorSet"
        ) from None


def _field(place: str, content: Any, column: str | int) -> float:
    if isinstance(column, int):
        raise ImportRefused(
            f"{place}: found column {column} by its number, expected the name of a field"
        )
    value = content
    for part in column.split("."):
        name, element = element_of(part)
        value = value.get(name) if isinstance(value, dict) else getattr(value, name, None)
        if element is not None:
            try:
                value = value[element]
            except (TypeError, IndexError, KeyError):
                raise ImportRefused(
                    f"{place}: field {shown(column)}: found no element {element}, expected a list"
                    " with one, counted from 0"
                ) from None
    if isinstance(value, (bool, int, float)):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if math.isfinite(number):
            return number
    found = "nothing" if value is None else shown(str(value))
    raise ImportRefused(f"{place}: field {shown(column)}: found {found}, expected a number")
