"""A single-producer, single-consumer ring of fixed-size slots in shared memory.

The memory is an anonymous file (memfd) whose descriptor the recorder process inherits. It has no
name, so it goes with the last process that maps it, however that process ends: nothing can leak,
and no resource tracker is needed.
"""

from __future__ import annotations

import mmap
import os
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from epa_rt.logs.layout import SampleLayout

KIND_SAMPLE = 1
KIND_EVENT_PART = 2
KIND_EVENT_END = 3

# Positions in the header, counted in 8-byte words. Words that different processes write lie on
# different cache lines.
HEAD = 0  # slots published so far; written by the producer
CLOSING = 1  # set by the producer before it closes the pipe: the end is meant
TAIL = 8  # slots consumed so far; written by the recorder
STATUS = 9
SAMPLES = 10  # samples in the file
EVENTS = 11  # events in the file
BYTES = 12  # size of the file
LOST_SAMPLES = 13  # taken from the ring and not in the file, because the disk refused
LOST_EVENTS = 14
FAILURE_BYTES = 16  # length of the text that follows; set after the text
_FAILURE_AT = 17 * 8

STATUS_STARTING, STATUS_OPEN, STATUS_CLOSED, STATUS_FAILED = range(4)

HEADER_BYTES = mmap.PAGESIZE
EVENT_HEAD = struct.Struct("@B3xI")
_SAMPLE_FIELDS = (
    ("flags", "u4"),
    ("state", "i4"),
    ("phase", "i4"),
    ("cycle", "u8"),
    ("t_ns", "u8"),
    ("lateness_ns", "i8"),
    ("busy_ns", "i8"),
    ("invalid_mask", "u8"),
    ("stale_mask", "u8"),
)


def sample_format(layout: SampleLayout) -> str:
    """The struct format of a sample slot: kind, the fields of `/cycle`, both raw images, all
    values.
    """
    raw_bytes = layout.inputs_bytes + layout.outputs_bytes
    images = f"{layout.inputs_bytes}s{layout.outputs_bytes}s{-raw_bytes % 8}x"
    return f"@B3xIiiQQqqQQ{images}{len(layout.values)}d"


def slot_dtype(layout: SampleLayout) -> np.dtype:
    """A slot as a structured type: the same bytes as `sample_format`, rounded up to 8."""
    fields = [("kind", "u1"), ("_pad", "u1", 3), *_SAMPLE_FIELDS]
    raw_bytes = layout.inputs_bytes + layout.outputs_bytes
    fields += [
        ("inputs_raw", "u1", layout.inputs_bytes),
        ("outputs_raw", "u1", layout.outputs_bytes),
    ]
    fields += [("_align", "u1", -raw_bytes % 8), ("values", "f8", len(layout.values))]
    return np.dtype(fields)


class Ring:
    """The mapped ring: `words` (header, 8 bytes each), `memory` (all bytes), `slots` and
    `slot_bytes`.
    """

    def __init__(self, fd: int, slots: int, slot_bytes: int) -> None:
        if slots & (slots - 1):
            raise ValueError(f"ring: found {slots} slots, expected a power of two")
        self.fd, self.slots, self.slot_bytes = fd, slots, slot_bytes
        size = HEADER_BYTES + slots * slot_bytes
        # Populated at once: a page fault inside the control loop would cost more than the sample.
        self.memory = mmap.mmap(fd, size, flags=mmap.MAP_SHARED | mmap.MAP_POPULATE)
        self.words = memoryview(self.memory)[:HEADER_BYTES].cast("Q")

    @classmethod
    def create(cls, slots: int, slot_bytes: int) -> Ring:
        """A new ring, all zero. Raises OSError where the memory cannot be had."""
        fd = os.memfd_create("epa_rt_ring", os.MFD_CLOEXEC)
        try:
            os.ftruncate(fd, HEADER_BYTES + slots * slot_bytes)
            return cls(fd, slots, slot_bytes)
        except OSError:
            os.close(fd)
            raise

    def close_fd(self) -> None:
        """Give the descriptor back; the mapping stays until the ring is forgotten."""
        if self.fd >= 0:
            os.close(self.fd)
            self.fd = -1

    def slots_of(self, layout: SampleLayout) -> np.ndarray:
        """All slots as one array of `slot_dtype`, each as wide as the ring's."""
        fields: Mapping[str, Any] = slot_dtype(layout).fields or {}
        dtype = np.dtype(
            {
                "names": list(fields),
                "formats": [field[0] for field in fields.values()],
                "offsets": [field[1] for field in fields.values()],
                "itemsize": self.slot_bytes,
            }
        )
        return np.frombuffer(self.memory, dtype, offset=HEADER_BYTES)

    @property
    def failure(self) -> str | None:
        """What the recorder process says went wrong."""
        length = self.words[FAILURE_BYTES]
        return (
            bytes(self.memory[_FAILURE_AT : _FAILURE_AT + length]).decode(errors="replace")
            if length
            else None
        )

    @failure.setter
    def failure(self, text: str) -> None:
        encoded = text.encode()[: HEADER_BYTES - _FAILURE_AT]
        self.memory[_FAILURE_AT : _FAILURE_AT + len(encoded)] = encoded
        self.words[FAILURE_BYTES] = len(encoded)
