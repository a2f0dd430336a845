"""Who ran what, when and with which code: the one attachment of a log that no replay reads."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any

RECORD = "record.json"
"""The attachment's name."""

_SCHEMA = 1
_PAGE_BYTES = 4096  # the text is filled up to whole pages, so that sizes do not tell two runs apart
_LONGEST = 4000  # characters of one text that is shown
_MOST_PLACES = 64  # muscles or notes that one record may hold


@dataclass(frozen=True)
class RunRecord:
    """What a person or an archive wants to know of a run, and the loop does not.

    ``operator_from``: 'option', 'file' or 'login', '' where nobody is named. ``muscles``: which
    specimen is built in, by the rig file's muscle name. ``started``: wall-clock time in UTC, as
    2026-01-31T12:00:00Z. ``commit``: of the code, '' outside of git; ``changed``: whether files
    differed from it.
    """

    operator: str = ""
    operator_from: str = ""
    rig_serial: str = ""
    muscles: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    started: str = ""
    commit: str = ""
    changed: bool = False

    @property
    def started_at(self) -> datetime | None:
        """The start as a time with zone; None where the log does not say it."""
        return parse_time(self.started)

    def to_bytes(self) -> bytes:
        """The attachment: JSON, filled with blanks to a multiple of 4096 bytes."""
        values = {"schema": _SCHEMA, **asdict(self), "muscles": dict(self.muscles)}
        text = json.dumps(values, ensure_ascii=False, indent=1).encode("utf-8", "replace")
        return text + b" " * (-len(text) % _PAGE_BYTES)


def parse_time(text: str) -> datetime | None:
    """An ISO 8601 time, taken as UTC where it has no zone; None where it is none, or so far off
    that no zone has it.
    """
    try:
        found = datetime.fromisoformat(text)
        for most in (-1, 1):  # days: a time zone is less
            found + timedelta(days=most)
    except (ValueError, OverflowError):
        return None
    return found if found.tzinfo else found.replace(tzinfo=UTC)


def record_of(attachments: Mapping[str, bytes]) -> RunRecord | None:
    """The record that a log carries; None where it carries none, or none that can be read."""
    if RECORD not in attachments:
        return None
    try:
        found = json.loads(attachments[RECORD])
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict):
        return None
    muscles = found.get("muscles")
    notes = found.get("notes")
    return RunRecord(
        operator=_text(found.get("operator")),
        operator_from=_text(found.get("operator_from")),
        rig_serial=_text(found.get("rig_serial")),
        muscles={_text(name): _text(value) for name, value in list(muscles.items())[:_MOST_PLACES]}
        if isinstance(muscles, dict)
        else {},
        notes=tuple(map(_text, notes[:_MOST_PLACES])) if isinstance(notes, list) else (),
        started=_text(found.get("started")),
        commit=_text(found.get("commit")),
        changed=found.get("changed") is True,
    )


def _text(value: Any) -> str:
    return value[:_LONGEST] if isinstance(value, str) else ""
