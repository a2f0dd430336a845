"""What a log says of itself, read from its summary alone: a few kilobytes of a file of any size."""

from __future__ import annotations

import io
import mmap
import os
import stat
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from epa_rt.logs.held import is_held
from epa_rt.logs.reader import LogError, LogReader
from epa_rt.logs.recording import OUTCOME_METADATA, ending_from
from epa_rt.logs.run_record import RECORD, RunRecord, record_of
from epa_rt.logs.schema import CHANNEL_IDS, CYCLE

_HEAD = struct.Struct("<BQ")
_FOOTER = struct.Struct("<QQI")
_FOOTER_BYTES = _HEAD.size + _FOOTER.size + len(MCAP0_MAGIC)
_LARGEST_RECORD = 1 << 20  # bytes; a record has some thousands
_METADATA_OF = ("run", OUTCOME_METADATA)  # names of the tables that a list of runs needs


@dataclass(frozen=True)
class Glance:
    """One log in a list of runs.

    ``outcome``: that of the log, 'recording' where its run is on, 'damaged' where the file is not
    whole, 'no log' where it is none.
    ``duration_s`` is None where the log does not say it. ``when``: the wall-clock start in UTC;
    with ``when_is_of_file`` the file's time of change, for a log without a record.
    """

    path: Path
    outcome: str
    cause: str = ""
    rig: str = ""
    experiment: str = ""
    backend: str = ""
    duration_s: float | None = None
    size_bytes: int = 0
    when: datetime | None = None
    when_is_of_file: bool = False
    record: RunRecord = field(default_factory=RunRecord)

    def as_json(self) -> dict[str, Any]:
        """The same with plain values, as docs/runs.md has it."""
        record = self.record
        return {
            "log": str(self.path),
            "outcome": self.outcome,
            "cause": self.cause,
            "rig": self.rig,
            "experiment": self.experiment,
            "backend": self.backend,
            "duration_s": self.duration_s,
            "size_bytes": self.size_bytes,
            "when": self.when.strftime("%Y-%m-%dT%H:%M:%SZ") if self.when else None,
            "when_is_of_file": self.when_is_of_file,
            "operator": record.operator or None,
            "operator_from": record.operator_from or None,
            "rig_serial": record.rig_serial or None,
            "muscles": dict(record.muscles),
            "notes": list(record.notes),
            "commit": record.commit or None,
            "changed": record.changed,
        }


class _NoSummary(Exception):
    """The file has no summary that can be used."""


def glance(path: Path) -> Glance:
    """What one file says; never raises for what the file holds. A file without a sound summary is
    read from the front, as far as it goes.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            return _no_log(path, status, "found no plain file, expected a log")
        metadata, attachments, cycles = _summarised(path)
        cause = None
    except _NoSummary:
        try:
            metadata, attachments, cycles, cause = _walked(path)
        except LogError as error:
            return _no_log(path, status, str(error).removeprefix(f"{path}: "))
    except OSError as error:
        return Glance(path, "no log", f"cannot be read ({error.strerror})")
    return _told(path, status, metadata, attachments, cycles, cause)


def _no_log(path: Path, status: os.stat_result, why: str) -> Glance:
    size, when = status.st_size, _changed(status)
    return Glance(path, "no log", why, size_bytes=size, when=when, when_is_of_file=True)


def _told(
    path: Path,
    status: os.stat_result,
    metadata: dict[str, dict[str, str]],
    attachments: dict[str, bytes],
    cycles: int,
    damage: str | None,
) -> Glance:
    run = metadata.get("run", {})
    outcome, cause = _ending(metadata.get(OUTCOME_METADATA))
    if damage is not None:
        outcome, cause = "recording" if is_held(str(path)) else "damaged", damage
    record = record_of(attachments) or RunRecord()
    when = record.started_at
    return Glance(
        path,
        outcome,
        cause,
        run.get("rig", ""),
        run.get("experiment", ""),
        run.get("backend", ""),
        _duration_s(cycles, run.get("period_s", "")),
        status.st_size,
        (when or _changed(status)).astimezone(UTC),
        when is None,
        record,
    )


def _ending(found: dict[str, str] | None) -> tuple[str, str]:
    if found is None:
        return "unknown", "the log does not say how the run ended"
    try:
        ending = ending_from(found)
    except ValueError:
        return "unknown", "the log says how the run ended in words that cannot be read"
    if ending.lost_samples or ending.lost_events:
        lost = f"{ending.lost_samples} samples and {ending.lost_events} events were lost"
        return ending.outcome, "; ".join(filter(None, (ending.cause, lost)))
    return ending.outcome, ending.cause


def _duration_s(cycles: int, period: str) -> float | None:
    try:
        period_s = float(period)
    except ValueError:
        return None
    return cycles * period_s if 0.0 < period_s < 3600.0 else None


def _changed(status: os.stat_result) -> datetime:
    """Its time of change; 1970 where a file system holds one beyond all calendars."""
    try:
        return datetime.fromtimestamp(status.st_mtime, UTC)
    except (ValueError, OverflowError, OSError):
        return datetime.fromtimestamp(0, UTC)


_Found = tuple[dict[str, dict[str, str]], dict[str, bytes], int]


def _summarised(path: Path) -> _Found:
    """Metadata, the record and the number of cycles by the file's own index. Raises _NoSummary,
    OSError.
    """
    with path.open("rb") as file:
        if os.fstat(file.fileno()).st_size < _FOOTER_BYTES + len(MCAP0_MAGIC):
            raise _NoSummary
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as view:
            try:
                return _of_summary(view)
            except (ValueError, struct.error, EndOfFile, UnicodeDecodeError, OverflowError):
                raise _NoSummary from None


def _of_summary(view: mmap.mmap) -> _Found:
    if view[: len(MCAP0_MAGIC)] != MCAP0_MAGIC or view[-len(MCAP0_MAGIC) :] != MCAP0_MAGIC:
        raise _NoSummary
    footer_at = len(view) - _FOOTER_BYTES
    begin, _, crc = _FOOTER.unpack_from(view, footer_at + _HEAD.size)
    if view[footer_at] != Opcode.FOOTER or not 0 < begin <= footer_at:
        raise _NoSummary
    if zlib.crc32(view[begin : footer_at + _HEAD.size + 16]) != crc:
        raise _NoSummary
    metadata: dict[str, dict[str, str]] = {}
    attachments: dict[str, bytes] = {}
    cycles = 0
    for opcode, body in _records(view, begin, footer_at):
        if opcode == Opcode.METADATA_INDEX:
            place = records.MetadataIndex.read(body())
            if place.name in _METADATA_OF and place.name not in metadata:
                found = records.Metadata.read(_at(view, place.offset, Opcode.METADATA))
                metadata[found.name] = found.metadata
        elif opcode == Opcode.ATTACHMENT_INDEX:
            there = records.AttachmentIndex.read(body())
            if there.name == RECORD and not attachments and there.length <= _LARGEST_RECORD:
                stream = _at(view, there.offset, Opcode.ATTACHMENT)
                attachments[RECORD] = records.Attachment.read(stream).data
        elif opcode == Opcode.STATISTICS:
            counts = records.Statistics.read(body()).channel_message_counts
            cycles = counts.get(CHANNEL_IDS[CYCLE], 0)
    return metadata, attachments, cycles


def _records(
    view: mmap.mmap, at: int, end: int
) -> Iterator[tuple[int, Callable[[], ReadDataStream]]]:
    while at < end:
        opcode, length = _HEAD.unpack_from(view, at)
        begin, at = at + _HEAD.size, at + _HEAD.size + length
        if at > end:
            raise _NoSummary
        yield opcode, partial(_stream, view, begin, at)


def _stream(view: mmap.mmap, begin: int, end: int) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(view[begin:end]))


def _at(view: mmap.mmap, offset: int, expected: int) -> ReadDataStream:
    opcode, length = _HEAD.unpack_from(view, offset)
    begin = offset + _HEAD.size
    if opcode != expected or begin + length > len(view):
        raise _NoSummary
    return _stream(view, begin, begin + length)


def _walked(path: Path) -> tuple[dict[str, dict[str, str]], dict[str, bytes], int, str | None]:
    """The same from the front, with the first sentence on what is wrong. Raises LogError."""
    with LogReader(path) as log:
        missing = log.missing_at_a_glance
        wrong = missing[0] if missing else "its summary is damaged"
        return log.metadata, log.attachments, log.counts().get(CYCLE, 0), wrong


def muscles_text(record: RunRecord) -> str:
    """'muscle: DMSP-20 no. 7', muscles parted by '; '."""
    return "; ".join(f"{name}: {words}" for name, words in record.muscles.items())
