"""The messages of a log that are not per cycle: events and timing, decoded one by one."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from google.protobuf.message import DecodeError

from epa_rt.logs.schema import event_topic, message_class, timing_topic
from epa_rt.logs.timing import BUCKET_UPPER_NS

_MESSAGE = struct.Struct("<BQHIQQ")
_OPCODE_MESSAGE = 5
_TIMING_NAMES = [field.name for field in timing_topic().fields]
_UNSIGNED = {field.name for field in timing_topic().fields if field.type == "fixed64"}
_TIMING_LENGTHS = [
    len(BUCKET_UPPER_NS) + (field.name != "bucket_upper_ns")
    for field in timing_topic().fields
    if field.repeated
]
_event_class = message_class(event_topic())
_timing_class = message_class(timing_topic())


@dataclass(frozen=True)
class Event:
    """Something that happened in a run, at `t_ns` of the run's clock."""

    cycle: int
    t_ns: int
    kind: str
    text: str
    data: dict[str, object]


class MessageError(ValueError):
    """A message that cannot be decoded; the words say why, to follow 'it'."""


def messages_of(content: bytes, channel_id: int) -> Iterator[tuple[int, bytes]]:
    """The messages of one channel in a chunk's content: `(t_ns, data)` each. Raises MessageError at
    the first byte that begins no whole message.
    """
    at = 0
    while at < len(content):
        if at + _MESSAGE.size > len(content):
            raise MessageError(f"ends within a message, at byte {at} of what was packed")
        opcode, length, channel, _, t_ns, _ = _MESSAGE.unpack_from(content, at)
        end = at + 9 + length
        if opcode != _OPCODE_MESSAGE or end > len(content) or end < at + _MESSAGE.size:
            raise MessageError(f"holds no message at byte {at} of what was packed")
        if channel == channel_id:
            yield t_ns, content[at + _MESSAGE.size : end]
        at = end


def decode_event(t_ns: int, message: bytes) -> Event:
    """Raises MessageError where it is none."""
    try:
        decoded = _event_class.FromString(message)
        data = json.loads(decoded.data)
    except (DecodeError, ValueError, RecursionError):
        raise MessageError("holds an event that cannot be decoded") from None
    if not isinstance(data, dict):
        raise MessageError("holds an event whose data is no JSON object")
    return Event(decoded.cycle, t_ns, decoded.kind, decoded.text, data)


def decode_timing(message: bytes) -> dict[str, int | list[int]]:
    """The fields of one `/timing` message, repeated ones as lists. Raises MessageError where it is
    none, or where its histograms are no histograms.
    """
    try:
        decoded = _timing_class.FromString(message)
    except DecodeError:
        raise MessageError("holds a timing message that cannot be decoded") from None
    fields = {name: getattr(decoded, name) for name in _TIMING_NAMES}
    fields = {
        name: value if isinstance(value, int) else list(value) for name, value in fields.items()
    }
    if [len(value) for value in fields.values() if isinstance(value, list)] != _TIMING_LENGTHS:
        raise MessageError("holds a timing message whose histograms have other lengths")
    return fields


def timing_columns(messages: list[dict[str, int | list[int]]]) -> dict[str, np.ndarray]:
    """The fields of N decoded `/timing` messages as arrays of N; repeated ones as [N, length]."""
    return {
        name: np.array(
            [one[name] for one in messages], np.uint64 if name in _UNSIGNED else np.int64
        ).astype(np.int64)
        for name in _TIMING_NAMES
    }
