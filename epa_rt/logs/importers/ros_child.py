"""The process that reads a ROS 2 bag: its messages in CDR, by rosbags, within bounds (apart.py)."""

import os
import re
from collections import Counter
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import zstandard
from rosbags.interfaces import MessageDefinitionFormat, Nodetype
from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from epa_rt.logs.importers.address import number_of
from epa_rt.logs.importers.apart import Answer, serve
from epa_rt.logs.importers.columns import FieldColumns
from epa_rt.logs.importers.table import ImportRefused, shown

HEADER_STAMP = "header.stamp"
RECEIVED = "log_time"
SENT = "publish_time"
_TYPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*){1,2}")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_LONGEST_DEFINITION = 256 << 10  # bytes; the longest of ROS itself has a tenth of it
_LONGEST_FIXED = 10_000  # elements of a fixed list of texts or messages; its reader spells them out
_LARGEST_MESSAGE = 64 << 20
_MOST_LISTED = 64  # elements of a list that are worth a column each
_MOST_FIELDS = 300
_SAMPLES = 3  # messages of a topic that are looked at to list its fields


class Message(NamedTuple):
    """A message as it was stored; ``sent_ns`` None where the storage keeps no such stamp."""

    received_ns: int
    sent_ns: int | None
    data: bytes


class Channel(NamedTuple):
    """A topic of a bag: its type, the definition beside it, and its messages in stored order."""

    topic: str
    type: str
    form: str
    definition: str
    messages: Callable[[], Iterator[Message]]


def answer(request: dict[str, Any]) -> Answer:
    """``list``: topics, types and all numbers of their first ``most_rows`` messages; else the
    columns ``wanted`` of one ``topic``.
    """
    path, shown_path = Path(request["path"]), request["shown"]
    open_bag = _mcap_channels if request["storage"] == "mcap" else _db3_channels
    channels = open_bag(path, request.get("packed", False))
    if request.get("list"):
        return _survey(channels, request["most_rows"])
    topic = request["topic"]
    chosen = [channel for channel in channels if channel.topic == topic]
    if not chosen:
        names = ", ".join(shown(channel.topic) for channel in channels[:12])
        raise ImportRefused(
            f"{shown_path}: found no message on {shown(topic)}, expected some (topics:"
            f" {names or 'none'})"
        )
    return _columns(f"{shown_path}: {topic}", chosen[0], request["wanted"], request["missing"])


def _columns(place: str, channel: Channel, wanted: list[str], missing: list[str]) -> Answer:
    try:
        decode = decoder(channel)
        columns = FieldColumns(wanted, missing)
    except ImportRefused as error:
        raise ImportRefused(f"{place}: {error}") from None
    has_header, offsets, number = False, [], 0
    for message in channel.messages():
        at = f"{place}, message {number}"
        try:
            content = decode(message.data)
        except MemoryError:
            raise
        except Exception as error:  # a message that is none: whatever rosbags raises
            raise ImportRefused(
                f"{at}: found a message that cannot be decoded"
                f" ({' '.join(str(error).split())[:100]}), expected {channel.type} in CDR"
            ) from None
        given = {RECEIVED: message.received_ns}
        if message.sent_ns is not None:
            given[SENT] = message.sent_ns
        columns.add(lambda at=at: at, content, given)
        header = getattr(content, "header", None)
        stamp_ns = number_of(getattr(header, "stamp", None))
        if stamp_ns is not None:
            has_header = True
            offsets.append((message.received_ns - stamp_ns) * 1e-9)
        number += 1
    if not number:
        raise ImportRefused(f"{place}: found no message, expected some")
    facts: dict[str, Any] = {"type": channel.type, "header": has_header}
    if offsets:
        facts["late_s"] = [float(v) for v in np.percentile(offsets, (0, 50, 100))]
        facts["spread_s"] = facts["late_s"][2] - facts["late_s"][0]
    return facts, {str(name): values for name, values in columns.arrays().items()}


def decoder(channel: Channel) -> Callable[[bytes], Any]:
    """Bytes to a message object. Raises ImportRefused for a definition that is none."""
    store = _store(channel)
    if channel.type not in store.fielddefs:
        raise ImportRefused(
            f"found the type {shown(channel.type)} without its definition,"
            " expected one of ROS 2's own, or a bag that holds the definitions"
        )
    return lambda data: store.deserialize_cdr(data, channel.type)


def _store(channel: Channel) -> Typestore:
    """The types of the bag itself where it has them, else those of ROS 2."""
    if not _TYPE.fullmatch(channel.type):
        raise ImportRefused(
            f"found {shown(channel.type)}, expected the name of a type such as"
            " sensor_msgs/msg/JointState"
        )
    if not channel.definition:
        return get_typestore(Stores.LATEST)
    if len(channel.definition) > _LONGEST_DEFINITION:
        raise ImportRefused("found a definition of over 256 KB, expected less")
    if channel.form == "ros2idl":
        types = get_types_from_idl(channel.definition)
    else:
        types = get_types_from_msg(channel.definition, channel.type)
    for name, (_, fields) in types.items():
        sound = _TYPE.fullmatch(name) and all(_NAME.fullmatch(field) for field, _ in fields)
        if not sound or any(_too_long(kind) for _, kind in fields):
            raise ImportRefused(
                f"found a definition of {shown(name)} that no reader should"
                " follow, expected names and lists as ROS has them"
            )
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    return store


def _too_long(kind: Any) -> bool:
    if kind[0] != Nodetype.ARRAY:
        return False
    inner, length = kind[1]
    spelled_out = inner[0] != Nodetype.BASE or inner[1][0] in ("string", "wstring")
    return bool(spelled_out and length > _LONGEST_FIXED)


def _mcap_channels(path: Path, _: bool) -> list[Channel]:
    from mcap.reader import make_reader

    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    if summary is None:
        raise ImportRefused(f"{path}: found no summary at its end, expected a whole MCAP file")

    def messages(topic: str) -> Iterator[Message]:
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            for _, _, message in reader.iter_messages(topics=[topic]):
                yield Message(message.log_time, message.publish_time, message.data)

    found = []
    for channel in sorted(summary.channels.values(), key=lambda one: one.id):
        schema = summary.schemas.get(channel.schema_id)
        if channel.message_encoding != "cdr" or schema is None:
            continue
        text = schema.data.decode("utf-8", "replace")
        topic = channel.topic
        found.append(
            Channel(topic, schema.name, schema.encoding, text, lambda topic=topic: messages(topic))
        )
    return found


def _db3_channels(path: Path, packed: bool) -> list[Channel]:
    # by descriptor: a name may hold signs that mean something in sqlite's own addresses
    reader = Sqlite3Reader(Path(f"/proc/self/fd/{os.open(path, os.O_RDONLY)}"))
    reader.open()
    assert reader.dbconn is not None
    checked = reader.dbconn.execute("PRAGMA quick_check(1)").fetchone()
    if checked is None or checked[0] != "ok":
        raise ValueError(f"sqlite finds it damaged: {checked[0] if checked else 'no answer'}")

    def messages(connection: Any) -> Iterator[Message]:
        unpack = zstandard.ZstdDecompressor()
        for _, stamp_ns, data in reader.messages([connection]):
            if not isinstance(stamp_ns, int) or not isinstance(data, bytes):
                raise ValueError("a message that is no bytes with a stamp")
            if packed:
                if zstandard.frame_content_size(data) > _LARGEST_MESSAGE:
                    raise ValueError("a message of over 64 MB")
                data = unpack.decompress(data, max_output_size=_LARGEST_MESSAGE)
            yield Message(stamp_ns, None, data)

    forms = {MessageDefinitionFormat.MSG: "ros2msg", MessageDefinitionFormat.IDL: "ros2idl"}
    return [
        Channel(
            one.topic,
            one.msgtype,
            forms.get(one.msgdef.format, ""),
            one.msgdef.data or "",
            lambda one=one: messages(one),
        )
        for one in reader.connections
    ]


def _survey(channels: list[Channel], most_rows: int) -> Answer:
    """Facts of each topic, and its columns as 'NUMBER FIELD'."""
    topics: list[dict[str, Any]] = []
    columns: dict[str, np.ndarray] = {}
    for number, channel in enumerate(channels):
        facts = _listed(channel)
        fields = facts["fields"][:_MOST_FIELDS]
        if fields:
            few = channel._replace(messages=lambda c=channel: islice(c.messages(), most_rows))
            try:
                _, found = _columns(channel.topic, few, [*fields, RECEIVED], ["nan", "null"])
                columns |= {f"{number} {field}": values for field, values in found.items()}
            except ImportRefused as error:
                facts["why"] = str(error)
        topics.append(facts)
    return {"topics": topics}, columns


def _listed(channel: Channel) -> dict[str, Any]:
    """Type, number of messages and addresses of the numbers in the first of them."""
    facts: dict[str, Any] = {"topic": channel.topic, "type": channel.type, "fields": []}
    try:
        decode = decoder(channel)
        seen: Counter[str] = Counter()
        samples = [decode(message.data) for message in islice(channel.messages(), _SAMPLES)]
        for sample in samples:
            seen.update(list(dict.fromkeys(_addresses(sample, ""))))
        facts["fields"] = [address for address, count in seen.items() if count == len(samples)]
    except MemoryError:
        raise
    except Exception as error:  # one topic that cannot be read hides no other
        facts["why"] = " ".join(str(error).split())[:120]
    return facts


def _addresses(value: Any, at: str) -> Iterator[str]:
    if number_of(value) is not None:
        yield at
    elif isinstance(value, (list, tuple, np.ndarray)):
        for i in range(min(len(value), _MOST_LISTED)):
            yield from _addresses(value[i], f"{at}[{i}]")
    elif not isinstance(value, (str, bytes)):
        names = _names(value)
        for field in value.__dataclass_fields__:
            inner = getattr(value, field)
            where = f"{at}.{field}" if at else field
            if names and isinstance(inner, (list, np.ndarray)) and len(inner) == len(names):
                if not (len(inner) and isinstance(inner[0], str)):
                    yield from (f"{where}[{name}]" for name in names[:_MOST_LISTED])
            elif "covariance" not in field:
                yield from _addresses(inner, where)


def _names(value: Any) -> list[str]:
    """The names beside lists of one message, where they can stand in brackets."""
    for field in ("name", "joint_names"):
        names = getattr(value, field, None)
        if isinstance(names, list) and names and all(isinstance(one, str) for one in names):
            plain = [one for one in names if one and not set(one) & set("[]") and not one.isdigit()]
            if len(set(plain)) == len(names):
                return plain
    return []


if __name__ == "__main__":
    serve(answer)
