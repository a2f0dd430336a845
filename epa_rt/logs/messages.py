"""The messages of a log that are not per cycle: events and timing, decoded one by one."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from epa_rt.logs.schema import event_topic, message_class, timing_topic

_MESSAGE = struct.Struct("<BQHIQQ")
_OPCODE_MESSAGE = 5
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


def messages_of(content: bytes, channel_id: int) -> Iterator[tuple[int, bytes]]:
    """The messages of one channel in a chunk's content: `(t_ns, data)` each."""
    at = 0
    while at < len(content):
        opcode, length, channel, _, t_ns, _ = _MESSAGE.unpack_from(content, at)
        end = at + 9 + length
        if opcode == _OPCODE_MESSAGE and channel == channel_id:
            yield t_ns, content[at + _MESSAGE.size : end]
        at = end


def decode_event(t_ns: int, message: bytes) -> Event:
    decoded = _event_class.FromString(message)
    return Event(decoded.cycle, t_ns, decoded.kind, decoded.text, json.loads(decoded.data))


def decode_timing(messages: list[bytes]) -> dict[str, np.ndarray]:
    """The fields of N `/timing` messages as arrays of N; repeated ones as [N, length]."""
    decoded = [_timing_class.FromString(message) for message in messages]
    names = [field.name for field in timing_topic().fields]
    return {name: np.array([getattr(one, name) for one in decoded], np.int64) for name in names}
