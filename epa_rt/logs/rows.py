"""Samples to the messages of a chunk, as arrays: no Python per message."""

from __future__ import annotations

import numpy as np

from epa_rt.logs.layout import SampleLayout
from epa_rt.logs.ring import slot_dtype
from epa_rt.logs.schema import (
    CYCLE,
    MESSAGE_HEAD_BYTES,
    Topic,
    cycle_topics,
    message_dtype,
    row_dtype,
    tag,
)

INDEX_DTYPE = np.dtype([("log_time", "<u8"), ("offset", "<u8")])
_OPCODE_MESSAGE = 5


class RowBlock:
    """Room for `capacity` samples, and for the messages that they become.

    All that is the same in every message (opcodes, lengths, channels, protobuf tags, offsets) is
    written once, here.
    """

    def __init__(self, layout: SampleLayout, capacity: int) -> None:
        topics = cycle_topics(layout)
        self.capacity = capacity
        self.count = 0
        self.slots = np.zeros(capacity, slot_dtype(layout))
        self.rows = np.zeros(capacity, row_dtype(topics))
        self._indexes = {topic.channel_id: np.zeros(capacity, INDEX_DTYPE) for topic in topics}
        self._copies: list[tuple[np.ndarray, np.ndarray]] = []
        for topic in topics:
            self._fill_constants(topic)
            self._pair_heads(topic)
        self._pair_fields(topics, layout)

    def take(self, slots: np.ndarray) -> int:
        """Copy in as many of the slots as there is room for, and say how many."""
        taken = min(self.capacity - self.count, len(slots))
        self.slots[self.count : self.count + taken] = slots[:taken]
        self.count += taken
        return taken

    @property
    def samples(self) -> np.ndarray:
        """The slots taken since `clear`."""
        return self.slots[: self.count]

    def clear(self) -> None:
        self.count = 0

    def messages(self) -> tuple[memoryview, dict[int, np.ndarray]]:
        """The chunk's content, and for each channel its index: log_time and offset of each
        message.
        """
        for target, source in self._copies:
            target[: self.count] = source[: self.count]
        content = memoryview(self.rows[: self.count]).cast("B")
        return content, {
            channel_id: index[: self.count] for channel_id, index in self._indexes.items()
        }

    def _fill_constants(self, topic: Topic) -> None:
        messages, dtype = self.rows[topic.name], message_dtype(topic)
        messages["head"]["opcode"] = _OPCODE_MESSAGE
        # A record's length counts neither its opcode nor the length itself.
        messages["head"]["length"] = dtype.itemsize - 9
        messages["head"]["channel_id"] = topic.channel_id
        for number, field in enumerate(topic.fields, start=1):
            messages["body"][f".{number}"] = np.frombuffer(tag(number, field), "u1")
        begin = self.rows.dtype.fields[topic.name][1]
        self._indexes[topic.channel_id]["offset"] = (
            np.arange(self.capacity) * self.rows.itemsize + begin
        )

    def _pair_heads(self, topic: Topic) -> None:
        head = self.rows[topic.name]["head"]
        self._copies.append((head["sequence"], self.slots["cycle"]))
        for target in (
            head["log_time"],
            head["publish_time"],
            self._indexes[topic.channel_id]["log_time"],
        ):
            self._copies.append((target, self.slots["t_ns"]))

    def _pair_fields(self, topics: list[Topic], layout: SampleLayout) -> None:
        cycle = next(topic for topic in topics if topic.name == CYCLE)
        for field in cycle.fields:
            self._copies.append((self.rows[CYCLE]["body"][field.name], self.slots[field.name]))
        column = 0
        for group, names in layout.groups().items():
            for name in names:
                self._copies.append(
                    (self.rows[f"/{group}"]["body"][name], self.slots["values"][:, column])
                )
                column += 1


def loose_messages(
    messages: list[tuple[int, int, int, bytes]],
) -> tuple[bytes, dict[int, np.ndarray]]:
    """Chunk content and indexes for messages of any size: `(channel_id, sequence, t_ns, data)`
    each.
    """
    head = np.zeros((), message_dtype(Topic("/event", ()))["head"])
    parts: list[bytes] = []
    entries: dict[int, list[tuple[int, int]]] = {}
    offset = 0
    for channel_id, sequence, t_ns, data in messages:
        head[()] = (
            _OPCODE_MESSAGE,
            MESSAGE_HEAD_BYTES - 9 + len(data),
            channel_id,
            sequence,
            t_ns,
            t_ns,
        )
        parts += [head.tobytes(), data]
        entries.setdefault(channel_id, []).append((t_ns, offset))
        offset += MESSAGE_HEAD_BYTES + len(data)
    return b"".join(parts), {
        channel_id: np.array(rows, INDEX_DTYPE) for channel_id, rows in entries.items()
    }
