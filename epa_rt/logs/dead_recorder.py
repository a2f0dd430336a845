"""What the loop's process adds to a log whose recorder died: how the run ended, and how much of it
is not there.
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import replace
from typing import NamedTuple

from mcap import records
from mcap.data_stream import RecordBuilder

from epa_rt.logs.reader import LogReader
from epa_rt.logs.recording import OUTCOME_METADATA, Ending, ending_values
from epa_rt.logs.scan import LogError
from epa_rt.logs.schema import CYCLE, EVENT


class Left(NamedTuple):
    """What is in the file that was left, and the ending as it stands there."""

    ending: Ending
    samples: int
    events: int
    size_bytes: int


def tell_ending(path: str, ending: Ending, samples: int, events: int) -> Left:
    """Appends the ending behind the last whole record of a cut log, with how many of the
    ``samples`` and ``events`` that the recorder was given are not in the file.

    A file that is whole or no log, or on a disk that takes no more, stays as it is.
    """
    there = {CYCLE: 0, EVENT: 0}
    is_cut, torn_at = False, None
    with contextlib.suppress(LogError, OSError), LogReader(path) as log:
        there |= {name: count for name, count in log.counts().items() if name in there}
        is_cut, torn_at = not log.has_end, log.torn_at
    lost_samples, lost_events = max(samples - there[CYCLE], 0), max(events - there[EVENT], 0)
    ending = replace(ending, lost_samples=lost_samples, lost_events=lost_events)
    with contextlib.suppress(OSError):
        if is_cut:
            _append(path, ending_values(ending, there[CYCLE], there[EVENT]), torn_at)
        return Left(ending, there[CYCLE], there[EVENT], os.path.getsize(path))
    return Left(ending, there[CYCLE], there[EVENT], 0)


def _append(path: str, values: dict[str, str], torn_at: int | None) -> None:
    record = RecordBuilder()
    records.Metadata(OUTCOME_METADATA, values).write(record)
    with open(path, "r+b") as file:
        if torn_at is not None:
            file.truncate(torn_at)
        file.seek(0, os.SEEK_END)
        file.write(bytes(record.end()))  # type: ignore[no-untyped-call]
