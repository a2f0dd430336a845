"""A list of runs: which logs a folder holds, which of them are asked for, and how they read."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from fnmatch import fnmatchcase
from pathlib import Path

from epa_rt.logs.plain_text import plain
from epa_rt.runs.glance import Glance, glance, muscles_text

_UNITS_S = {"min": 60, "h": 3600, "d": 86400, "w": 604800}
_AGO = re.compile(r"(\d{1,6})\s*(min|h|d|w)")
_WHO, _OUTCOME, _LASTED, _WHEN = 8, 9, 7, 17  # characters of a column
_NAME_LEAST = 16


@dataclass(frozen=True)
class Filter:
    """What is asked for; '' and None ask for everything. Texts are patterns with * and ?, and fit
    in either case.
    """

    rig: str = ""
    experiment: str = ""
    outcome: str = ""
    operator: str = ""
    since: datetime | None = None
    until: datetime | None = None

    def takes(self, one: Glance) -> bool:
        """Whether a log is asked for."""
        pairs = (
            (self.rig, one.rig),
            (self.experiment, one.experiment),
            (self.outcome, one.outcome),
            (self.operator, one.record.operator),
        )
        if any(asked and not fnmatchcase(found.lower(), asked.lower()) for asked, found in pairs):
            return False
        if one.when is None:
            return self.since is None and self.until is None
        return not (
            (self.since is not None and one.when < self.since)
            or (self.until is not None and one.when >= self.until)
        )


def moment(text: str, now: datetime, end_of_day: bool = False) -> datetime:
    """A time as a person writes it: '2026-11-27', '2026-11-27 14:00', or '3 d', '12 h' before
    ``now``. Without a zone it is local. ``end_of_day``: a date alone is the midnight after it.

    Raises ValueError where it is none.
    """
    ago = _AGO.fullmatch(text.strip())
    if ago:
        return now - timedelta(seconds=int(ago[1]) * _UNITS_S[ago[2]])
    found = datetime.fromisoformat(text.strip())
    if end_of_day and len(text.strip()) <= 10:
        found += timedelta(days=1)
    return (found if found.tzinfo else found.astimezone()).astimezone(UTC)


def logs_in(places: Sequence[Path]) -> Iterator[Path]:
    """The logs of folders and all folders in them, and files given by name; each once."""
    seen = set()
    for place in places:
        found: Iterable[Path] = sorted(place.rglob("*.mcap")) if place.is_dir() else [place]
        for path in found:
            if path not in seen and not path.is_dir():
                seen.add(path)
                yield path


def listed(places: Sequence[Path], asked: Filter) -> list[Glance]:
    """The logs that are asked for, the oldest first."""
    found = [one for one in map(glance, logs_in(places)) if asked.takes(one)]
    never = datetime.min.replace(tzinfo=UTC)
    return sorted(found, key=lambda one: (one.when or never, str(one.path)))


def as_text(found: Sequence[Glance], root: Path | None, width: int | None, long: bool) -> str:
    """A table with a line for each log; what did not complete says why on the line below.

    ``root``: names are shown below it. ``width``: characters of the terminal, None for no bound.
    ``long``: also rig, specimens, notes and commit.
    """
    if width is not None:
        width = max(width, _WHEN + _LASTED + _OUTCOME + _WHO + 8 + _NAME_LEAST)
    lines = [_row("when", "lasted", "outcome", "who", "log", width)]
    for one in found:
        lines.append(
            _row(
                _when(one),
                _lasted(one.duration_s),
                one.outcome,
                one.record.operator or "-",
                _name(one.path, root),
                width,
            )
        )
        for text in _below(one, long):
            lines += _whole(text, width) if long else [_cut(f"    {text}", width)]
    if any(one.when_is_of_file for one in found):
        lines.append(_cut("~ the log does not say when it began: the file's own time", width))
    return "\n".join(lines)


def _row(when: str, lasted: str, outcome: str, who: str, name: str, width: int | None) -> str:
    who = _cut(who, _WHO)
    head = f"{when:<{_WHEN}}  {lasted:>{_LASTED}}  {outcome:<{_OUTCOME}}  {who:<{_WHO}}  "
    room = None if width is None else width - len(head)
    name = _one_line(name)
    if room is not None and len(name) > room:  # the end tells logs of one experiment apart
        name = f"…{name[-(room - 1) :]}"
    return head + name


def _below(one: Glance, long: bool) -> list[str]:
    lines = [] if one.outcome == "completed" and not one.cause else [one.cause]
    if long:
        record = one.record
        changed = " with changes" if record.changed else ""
        pairs = (
            ("log", str(one.path)),
            ("experiment", one.experiment),
            ("rig", " ".join(filter(None, (one.rig, record.rig_serial)))),
            ("backend", one.backend),
            ("muscles", muscles_text(record)),
            *(("note", note) for note in record.notes),
            ("code", f"{record.commit[:12]}{changed}" if record.commit else ""),
        )
        lines += [f"{name}: {text}" for name, text in pairs if text]
    return [line for line in lines if line]


def _when(one: Glance) -> str:
    if one.when is None:
        return "-"
    local = one.when.astimezone()
    return f"{local:%Y-%m-%d %H:%M}{'~' if one.when_is_of_file else ''}"


def _lasted(seconds: float | None) -> str:
    if seconds is None:
        return "-"
    if seconds < 100.0:
        return f"{seconds:.1f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


def _name(path: Path, root: Path | None) -> str:
    inside = root is not None and path.is_relative_to(root)
    shown = path.relative_to(root) if inside and root is not None else path
    return str(shown.with_suffix("")) if shown.suffix == ".mcap" else str(shown)


def _whole(text: str, width: int | None) -> list[str]:
    """Nothing is cut: over several lines between words, where it is too long for one."""
    text = _one_line(text)
    if width is None:
        return [f"    {text}"]
    lines = textwrap.wrap(text, width - 6, break_on_hyphens=False)
    return [f"{'      ' if i else '    '}{line}" for i, line in enumerate(lines)]


def _cut(text: str, width: int | None) -> str:
    text = _one_line(text)
    return text if width is None or len(text) <= width else f"{text[: width - 1]}…"


def _one_line(text: str) -> str:
    return plain(text).replace("\n", " ")
