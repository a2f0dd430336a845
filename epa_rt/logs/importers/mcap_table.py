"""MCAP files of others: messages in JSON or protobuf, one table for each topic."""

import json
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from epa_rt.config.kinds import begun
from epa_rt.logs.importers.columns import FieldColumns
from epa_rt.logs.importers.mcap_bounds import oversized_chunk
from epa_rt.logs.importers.table import ImportRefused, Table, shown, why

STAMPS = ("log_time", "publish_time")
_ENCODINGS = ("json", "protobuf", "cdr")


def read_mcap(
    path: Path, topic: str, wanted: Sequence[str | int], missing: Sequence[str] = ()
) -> Table | None:
    """The wanted fields of a topic's messages: 'force', 'header.seq', 'position[2]'; log_time and
    publish_time in ns. None where they are in ROS 2's CDR, which another reader takes.

    Raises ImportRefused for the first thing that does not fit, with file, message number (from 0)
    and field.
    """
    try:
        columns = FieldColumns(wanted, missing)
    except ImportRefused as error:
        raise ImportRefused(f"{path}: {error}") from None
    decoders: dict[int, Callable[[bytes], Any]] = {}
    number = 0
    for schema, channel, message in _messages(path, topic):
        if channel.message_encoding == "cdr":
            return None
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
        given = {name: getattr(message, name) for name in STAMPS}
        columns.add(lambda place=place: place, content, given)
        number += 1
    if not number:
        raise ImportRefused(
            f"{path}: found no message on {shown(topic)}, expected some (topics: {_topics(path)})"
        )
    return Table(str(path), columns.arrays(), lambda row: f"{path}: {topic}, message {row}")


def first_messages(path: Path) -> dict[str, Any]:
    """The first message of each topic in JSON or protobuf, as JSON has it. Raises ImportRefused."""
    check_mcap(path)
    found: dict[str, Any] = {}
    for schema, channel, message in _messages(path, None):
        if channel.message_encoding not in ("json", "protobuf"):
            return {}
        if channel.topic in found:
            continue
        try:
            content = _decoder(path, schema, channel)(message.data)
        except ImportRefused:
            raise
        except Exception as error:  # a message that is none: whatever json or protobuf raise
            raise ImportRefused(
                f"{path}: {channel.topic}: found a message that cannot be decoded"
                f" ({type(error).__name__}), expected {channel.message_encoding}"
            ) from None
        if channel.message_encoding == "protobuf":
            from google.protobuf.json_format import MessageToDict

            content = MessageToDict(
                content, preserving_proto_field_name=True, always_print_fields_with_no_presence=True
            )
        found[channel.topic] = content
    return found


def check_mcap(path: Path) -> None:
    """Raises ImportRefused for what is no whole MCAP file, or has a chunk that is too large."""
    try:
        with path.open("rb") as file:
            _check_ends(path, file)
    except OSError as error:
        raise ImportRefused(f"{path}: found {why(error)}, expected an MCAP file") from None


def _messages(path: Path, topic: str | None):
    from mcap.exceptions import McapError
    from mcap.reader import make_reader

    try:
        with path.open("rb") as file:
            _check_ends(path, file)
            yield from make_reader(file, validate_crcs=True).iter_messages(
                topics=None if topic is None else [topic]
            )
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
        raise ImportRefused(f"{path}: found {begun(first)}, expected an MCAP file")
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
            f" expected {', '.join(_ENCODINGS[:-1])} or {_ENCODINGS[-1]}"
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
