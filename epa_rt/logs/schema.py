"""The topics of a log and their protobuf messages.

Every field of a per-cycle message is of fixed width and always written, zero or not. So every such
message of a log has the same size, and a chunk of them can be built and read as one array.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from epa_rt.logs.layout import SampleLayout

PACKAGE = "epa_rt"
CYCLE, EVENT, TIMING = "/cycle", "/event", "/timing"
CHANNEL_IDS = {
    CYCLE: 1,
    "/measured": 2,
    "/reference": 3,
    "/command": 4,
    "/estimate": 5,
    EVENT: 6,
    TIMING: 7,
}

_Type = descriptor_pb2.FieldDescriptorProto
_FORMATS = {
    "double": "<f8",
    "fixed64": "<u8",
    "sfixed64": "<i8",
    "fixed32": "<u4",
    "sfixed32": "<i4",
}
_WIRE_TYPES = {"double": 1, "fixed64": 1, "sfixed64": 1, "fixed32": 5, "sfixed32": 5, "bytes": 2}
_MESSAGE_HEAD = [
    ("opcode", "u1"),
    ("length", "<u8"),
    ("channel_id", "<u2"),
    ("sequence", "<u4"),
    ("log_time", "<u8"),
    ("publish_time", "<u8"),
]
MESSAGE_HEAD_BYTES = np.dtype(_MESSAGE_HEAD).itemsize
_TIMING_STATISTICS = ("p50", "p99", "p999", "max")


@dataclass(frozen=True)
class Field:
    """One protobuf field: its type's name, its size where the type is `bytes`, whether it
    repeats.
    """

    name: str
    type: str
    size: int = 0
    repeated: bool = False


@dataclass(frozen=True)
class Topic:
    """One channel of the log, with the fields of its message in the order of their numbers (from
    1).
    """

    name: str
    fields: tuple[Field, ...]

    @property
    def channel_id(self) -> int:
        return CHANNEL_IDS[self.name]

    @property
    def message_name(self) -> str:
        return f"{PACKAGE}.{self.name[1:].capitalize()}"


def cycle_topics(layout: SampleLayout) -> list[Topic]:
    """The topics with one message per cycle: `/cycle`, and each group of signals that has any."""
    fixed = [Field("cycle", "fixed64"), Field("t_ns", "fixed64"), Field("flags", "fixed32")]
    fixed += [Field("state", "sfixed32"), Field("phase", "sfixed32")]
    fixed += [Field("lateness_ns", "sfixed64"), Field("busy_ns", "sfixed64")]
    fixed += [Field("invalid_mask", "fixed64"), Field("stale_mask", "fixed64")]
    fixed += [
        Field("inputs_raw", "bytes", layout.inputs_bytes),
        Field("outputs_raw", "bytes", layout.outputs_bytes),
    ]
    topics = [Topic(CYCLE, tuple(fixed))]
    for group, names in layout.groups().items():
        topics.append(Topic(f"/{group}", tuple(Field(name, "double") for name in names)))
    return topics


def event_topic() -> Topic:
    return Topic(
        EVENT,
        (
            Field("cycle", "fixed64"),
            Field("kind", "string"),
            Field("text", "string"),
            Field("data", "string"),
        ),
    )


def timing_topic() -> Topic:
    fields = [Field("cycle", "fixed64"), Field("samples", "fixed32"), Field("overruns", "fixed32")]
    for quantity in ("lateness", "busy"):
        fields += [
            Field(f"{quantity}_{statistic}_ns", "sfixed64") for statistic in _TIMING_STATISTICS
        ]
    fields += [Field("bucket_upper_ns", "fixed64", repeated=True)]
    fields += [
        Field(f"{quantity}_histogram", "fixed32", repeated=True)
        for quantity in ("lateness", "busy")
    ]
    return Topic(TIMING, tuple(fields))


def file_descriptor(topic: Topic) -> descriptor_pb2.FileDescriptorProto:
    """The protobuf file that holds the topic's message and nothing else."""
    file = descriptor_pb2.FileDescriptorProto(
        name=f"{PACKAGE}{topic.name}.proto", package=PACKAGE, syntax="proto3"
    )
    message = file.message_type.add(name=topic.message_name.removeprefix(f"{PACKAGE}."))
    for number, field in enumerate(topic.fields, start=1):
        label = _Type.LABEL_REPEATED if field.repeated else _Type.LABEL_OPTIONAL
        type_number = getattr(_Type, f"TYPE_{field.type.upper()}")
        # The JSON name is given: made by the rules, those of `a_1` and `a1` would collide.
        message.field.add(
            name=field.name, number=number, label=label, type=type_number, json_name=field.name
        )
    return file


def descriptor_set(topic: Topic) -> bytes:
    """The schema record's data: a FileDescriptorSet."""
    files = descriptor_pb2.FileDescriptorSet(file=[file_descriptor(topic)])
    return bytes(files.SerializeToString(deterministic=True))


def message_class(topic: Topic) -> Any:
    """A protobuf class for the topic's message."""
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file_descriptor(topic))
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(topic.message_name))


def varint(value: int) -> bytes:
    """A protobuf varint."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def tag(number: int, field: Field) -> bytes:
    """The bytes before a field's value: number and wire type, and for `bytes` the length."""
    return varint(number << 3 | _WIRE_TYPES[field.type]) + (
        varint(field.size) if field.type == "bytes" else b""
    )


def message_dtype(topic: Topic) -> np.dtype:
    """One MCAP Message record of a per-cycle topic: opcode to publish_time in `head`, the fields in
    `body`.
    """
    body: list[tuple[str, str] | tuple[str, str, int]] = []
    for number, field in enumerate(topic.fields, start=1):
        # A dot cannot be in a signal's name, so the tags cannot collide with one.
        body.append((f".{number}", "u1", len(tag(number, field))))
        body.append(
            (field.name, "u1", field.size)
            if field.type == "bytes"
            else (field.name, _FORMATS[field.type])
        )
    return np.dtype([("head", _MESSAGE_HEAD), ("body", body)])


def row_dtype(topics: list[Topic]) -> np.dtype:
    """All messages of one cycle, one after the other, keyed by topic."""
    return np.dtype([(topic.name, message_dtype(topic)) for topic in topics])
