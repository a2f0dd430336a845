"""What one recorded cycle holds: the names behind the columns of a log."""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass
from typing import Any

# rows: computed from the inputs of edge k, sent at k + 1, seen in the motion that edge k + 2
# samples
ANSWERED_AFTER = 2

FLAG_WORKING_COUNTER_OK = 1
FLAG_STOP_REQUESTED = 2
FLAG_RECORDER_FAILED = 4
FLAG_TRIPPED = 8
FLAG_OVERRUN = 16
FLAG_STOP_AT_ONCE = 32

MASK_BITS = 64
"""Width of the invalid and stale masks, and so the most measured rows one rig may have."""

LARGEST_IMAGE_BYTES = 16384
"""A raw image of an EtherCAT segment: eleven full frames' process data, more than any rig here."""

_MOST_NAMES = {"states": 1000, "phases": 100_000}
_MOST_SIGNALS = 4096  # of one group; the largest rig here has some 60
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_GROUPS = ("measured", "reference", "command", "estimate")


@dataclass(frozen=True)
class SampleLayout:
    """Names and sizes of one sample, in the order in which the recorder is handed the values.

    `inputs_bytes` and `outputs_bytes` are the sizes of the raw process image in bytes. `measured`,
    `reference`, `command` and `estimate` name one float64 each, in SI. `states` and `phases` name
    the integers of those columns. Raises ValueError for a name that cannot be a column, a name
    given twice, or more rows than the masks have bits.
    """

    inputs_bytes: int
    outputs_bytes: int
    measured: tuple[str, ...]
    reference: tuple[str, ...]
    command: tuple[str, ...]
    estimate: tuple[str, ...]
    states: tuple[str, ...]
    phases: tuple[str, ...]

    def __post_init__(self) -> None:
        for group in _GROUPS:
            names = getattr(self, group)
            for name in names:
                if not _NAME.fullmatch(name):
                    raise ValueError(
                        f"log layout: {group}: found {name!r}, expected letters, digits and"
                        " underscores"
                    )
            if len(set(names)) < len(names):
                twice = next(name for name in names if names.count(name) > 1)
                raise ValueError(
                    f"log layout: {group}: found {twice!r} twice, expected each name once"
                )
        if len(self.measured) > MASK_BITS:
            raise ValueError(
                f"log layout: found {len(self.measured)} measured rows, expected at most"
                f" {MASK_BITS}"
            )

    @property
    def values(self) -> tuple[str, ...]:
        """The names of all float64 values of a sample, in slot order."""
        return self.measured + self.reference + self.command + self.estimate

    def groups(self) -> dict[str, tuple[str, ...]]:
        """The signal names of each group that has any, keyed `measured`, `reference`, `command`,
        `estimate`.
        """
        return {group: getattr(self, group) for group in _GROUPS if getattr(self, group)}

    def to_json(self) -> str:
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> SampleLayout:
        """The layout that `to_json` wrote. Raises ValueError or TypeError where it is not one, or
        one larger than any rig's.
        """
        try:
            found = json.loads(text)
        except RecursionError:
            raise ValueError("log layout: found values nested too deeply") from None
        if not isinstance(found, dict):
            raise TypeError("log layout: found no JSON object")
        for key, value in found.items():
            is_size = key.endswith("_bytes")
            if is_size and not (type(value) is int and 0 <= value <= LARGEST_IMAGE_BYTES):
                raise ValueError(f"log layout: {key}: found {value!r:.40}, expected a size")
            if not is_size and not (
                isinstance(value, list)
                and len(value) <= _MOST_NAMES.get(key, _MOST_SIGNALS)
                and all(isinstance(name, str) for name in value)
            ):
                raise ValueError(f"log layout: {key}: found no list of names, expected one")
        fields: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in found.items()
        }
        return cls(**fields)
