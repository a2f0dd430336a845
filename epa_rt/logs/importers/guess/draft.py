"""The draft of a mapping: YAML that the mapping reader takes, with every doubt at its line."""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.logs.importers.guess.clock import ClockGuess, clock_of
from epa_rt.logs.importers.guess.motion import repeats_after
from epa_rt.logs.importers.guess.reading import Reading, read_columns
from epa_rt.logs.importers.guess.seen import Seen, Survey
from epa_rt.logs.importers.guess.survey import survey
from epa_rt.logs.importers.guess.units import SUFFIXES
from epa_rt.logs.importers.table import ImportRefused

_MOST_MEASURED, _MOST_OTHERS = 64, 256
_MOST_TRIALS = 100
_LONGEST_NAME = 60
_NO_TEXTS = ("true", "false", "null", "yes", "no", "on", "off", "y", "n")
_LEFT_OUT = ("cmd", "ref", "est", "data")


@dataclass(frozen=True)
class Row:
    """A signal of the draft: section, name, keys, and what stands behind it as a comment."""

    section: str
    name: str
    keys: dict[str, Any]
    comment: str
    unsure: tuple[str, ...]
    seen: Seen
    reading: Reading


@dataclass(frozen=True)
class Draft:
    """``text``: the YAML; ``unsure``: every doubt, in words, with the name it belongs to."""

    text: str
    unsure: tuple[str, ...]
    clocks: tuple[ClockGuess, ...]
    rows: tuple[Row, ...]
    survey: Survey
    says: tuple[str, ...]


def guess(paths: Sequence[Path]) -> Draft:
    """The draft for one recording of one or several files. Raises ImportRefused."""
    surveys = [survey(path) for path in paths]
    kinds = {one.kind for one in surveys}
    if len(kinds) > 1:
        raise ImportRefused(
            f"{paths[-1]}: found files of the kinds {', '.join(sorted(kinds))}, expected one kind"
        )
    tables = [
        replace(seen, of_many=len(paths) > 1)
        for one in surveys
        for seen in one.tables
        if seen.columns
    ]
    clocks = [clock_of(seen) for seen in tables]
    clocks, stamp_notes = _one_clock(tables, clocks)
    rows, trials, says = _rows(tables, clocks, len(paths) > 1)
    doubts = [f"format: {doubt}" for one in surveys for doubt in one.unsure]
    if not rows:
        raise ImportRefused(
            f"{paths[0]}: found no column of numbers beside the clock, expected some"
        )
    main = max(range(len(tables)), key=lambda i: _weight(tables[i], rows))
    doubts += [f"clock: {doubt}" for doubt in (*clocks[main].unsure, *stamp_notes)]
    text, more = _text(paths, surveys[0], tables[main], clocks[main], rows, trials, stamp_notes)
    doubts += more
    doubts += [f"{row.name}: {doubt}" for row in rows for doubt in row.unsure]
    return Draft(text, tuple(doubts), tuple(clocks), tuple(rows), surveys[0], tuple(says))


def _weight(seen: Seen, rows: Sequence[Row]) -> tuple[int, int]:
    """The table that gives the clock: that of the first measured signal."""
    first = next((row.seen for row in rows if row.section == "measured"), None)
    return (int(seen is first), len(seen.columns))


def _one_clock(
    tables: list[Seen], clocks: list[ClockGuess]
) -> tuple[list[ClockGuess], tuple[str, ...]]:
    """Topics share one clock's column: headers where all have them, else receipt."""
    stamped = [clock.column == "header.stamp" for clock in clocks]
    if not any(stamped):
        return clocks, ()
    late = [
        (seen.columns["log_time"] - seen.columns["header.stamp"]) * 1e-9
        for seen, has in zip(tables, stamped, strict=True)
        if has and "log_time" in seen.columns
    ]
    notes: tuple[str, ...] = ()
    if late:
        spread = np.concatenate(late)
        notes = (
            f"header.stamp or log_time: receipt comes {np.median(spread) * 1e3:.4g} ms after the"
            f" headers' stamps, {spread.min() * 1e3:.4g} to {spread.max() * 1e3:.4g} ms",
        )
    return clocks, notes


def _rows(
    tables: list[Seen], clocks: list[ClockGuess], many: bool
) -> tuple[list[Row], list[tuple[Seen, Reading]], list[str]]:
    rows: list[Row] = []
    trials: list[tuple[Seen, Reading]] = []
    says: list[str] = []
    names: set[str] = set()
    mixed = len({clock.column for clock in clocks}) > 1
    for seen, clock in zip(tables, clocks, strict=True):
        for column, reading in read_columns(seen, clock).items():
            if reading.part == "clock":
                continue
            if reading.part == "left out":
                says.append(f"{seen.name(column)!r} is left out: {reading.why}")
                continue
            if reading.part == "trial":
                trials.append((seen, reading))
                continue
            keys: dict[str, Any] = {"column": column}
            if many:
                keys = {"file": seen.path.stem, **keys}
            if seen.topic is not None:
                keys["topic"] = seen.topic
                if mixed and clock.column == "log_time":
                    keys["stamp"] = "log_time"
            rows.append(_row(seen, reading, keys, names))
        says += [f"{name!r} is left out: no numbers" for name in seen.texts[:20]]
    return rows, trials, says


def _row(seen: Seen, reading: Reading, keys: dict[str, Any], names: set[str]) -> Row:
    unit = reading.unit
    assert unit is not None
    keys["unit"] = f"{unit.text} {reading.against}".strip()
    if unit.scale:
        keys["scale"] = float(unit.scale)
    if unit.offset:
        keys["offset"] = unit.offset
    section = {"measured": "measured", "command": "commands", "reference": "references"}
    name = _name(seen, reading, names)
    unsure = list(reading.unsure)
    values = seen.columns[reading.column]
    known = values[~np.isnan(values)]
    if len(known) and np.all(known == known[0]):
        unsure.append(f"constant: always {known[0]:g}")
    comment = f"unsure: {'; '.join(unsure)}" if unsure else reading.why
    return Row(section[reading.part], name, keys, comment, tuple(unsure), seen, reading)


def _name(seen: Seen, reading: Reading, names: set[str]) -> str:
    unit = reading.unit
    assert unit is not None
    suffix = SUFFIXES[unit.quantity]
    prefix = {"command": "cmd_", "reference": "ref_"}.get(reading.part, "")
    words = list(reading.words.tokens)
    topic = [] if seen.topic is None else re.findall(r"[a-z0-9]+", seen.topic.lower())
    says_nothing = not words or words[0] == "data"
    if topic and (says_nothing or f"{prefix}{'_'.join(words)}{suffix}" in names):
        words = topic + words
    stem = "_".join(word for word in words if word.isascii() and word not in _LEFT_OUT)
    stem = re.sub(r"[^a-z0-9_]", "", stem) or f"column_{len(names) + 1}"
    stem = stem.removesuffix(suffix) or stem  # one that says it already
    if not stem[0].isalpha():
        stem = f"x{stem}"
    if prefix == "" and stem.startswith(("cmd_", "ref_", "est_")):
        stem = f"x_{stem}"
    stem = stem[: _LONGEST_NAME - len(prefix) - len(suffix) - 4]
    name, count = f"{prefix}{stem}{suffix}", 1
    while name in names:
        count += 1
        name = f"{prefix}{stem}_{count}{suffix}"
    names.add(name)
    return name


def _text(
    paths: Sequence[Path],
    first: Survey,
    main: Seen,
    clock: ClockGuess,
    rows: Sequence[Row],
    trials: Sequence[tuple[Seen, Reading]],
    stamp_notes: Sequence[str],
) -> tuple[str, list[str]]:
    stem = re.sub(r"[^a-z0-9]+", "_", paths[0].stem.lower()).strip("_")[:40] or "recording"
    stem = stem if stem[0].isalpha() else f"r_{stem}"
    missing = sorted({word for row in rows for word in row.seen.missing})
    form = {"kind": first.kind, **first.form} | ({"missing": missing} if missing else {})
    lines = [
        "# Draft by epa import --guess: read every line that says unsure, then take the mark away.",
        f"mapping: {stem}",
        "rig: unnamed_rig  # FILL IN: the rig's name; with rig_file: its file",
        f"format: {_flow(form)}" + _behind([f"unsure: {d}" for d in first.unsure]),
        _clock_line(clock, [*clock.unsure, *stamp_notes]),
    ]
    doubts = []
    measured = [row for row in rows if row.section == "measured"]
    if not measured and rows:
        doubts.append("measured: no column is called a measured one, so all are taken as such")
        rows = [_as_measured(row) for row in rows]
    for section, most in (
        ("measured", _MOST_MEASURED),
        ("commands", _MOST_OTHERS),
        ("references", _MOST_OTHERS),
    ):
        chosen = [row for row in rows if row.section == section]
        if not chosen:
            continue
        lines.append(f"{section}:")
        for k, row in enumerate(chosen):
            mark = "  " if k < most else "  # too many: "
            lines.append(f"{mark}{row.name}: {_flow(row.keys)}{_behind([row.comment])}")
        if section == "measured":
            lines += _places_of_speeds(chosen)
    more, trial_doubts = _trial_lines(clock, main, trials, len(paths) > 1)
    if not more and not trial_doubts:
        trial_doubts = _laps(clock, main, rows)
        more = [f"# trials: unsure: {doubt.partition(': ')[2]}" for doubt in trial_doubts]
    return "\n".join([*lines, *more]) + "\n", doubts + trial_doubts


def _places_of_speeds(rows: Sequence[Row]) -> list[str]:
    """Where speeds are measured and no place of their kind: lines to take the mark from, which add
    them up.
    """
    lines = []
    for place, word in (("_m", "position"), ("_rad", "angle")):
        speeds = [row for row in rows if row.name.endswith(f"{place}_s")]
        if any(row.name.endswith(place) for row in rows):
            continue
        for row in speeds:
            name = re.sub("speed|velocity", word, row.name.removesuffix("_s"))
            keys = _flow(row.keys | {"integral": True})
            lines.append(f"  # {name}: {keys}  # where a rig asks for a place: the speed added up")
    return lines


def _as_measured(row: Row) -> Row:
    name = row.name.removeprefix("cmd_").removeprefix("ref_")
    return Row("measured", name, row.keys, row.comment, row.unsure, row.seen, row.reading)


def _clock_line(clock: ClockGuess, unsure: Sequence[str]) -> str:
    behind = _behind([f"unsure: {'; '.join(unsure)}" if unsure else clock.why])
    if clock.column is None:
        return f"clock: {{rate: {1.0 / clock.period_s:.9g} Hz}}{behind}"
    keys: dict[str, Any] = {"column": clock.column, "unit": clock.unit}
    keys["period"] = f"{clock.period_s * 1e3:.9g} ms"
    if clock.resample:
        keys["resample"] = "linear"
    return f"clock: {_flow(keys)}{behind}"


def _trial_lines(
    clock: ClockGuess, main: Seen, trials: Sequence[tuple[Seen, Reading]], many: bool
) -> tuple[list[str], list[str]]:
    if trials:
        seen, reading = trials[0]
        keys: dict[str, Any] = {"column": reading.column}
        if many:
            keys["file"] = seen.path.stem
        if seen.topic is not None:
            keys["topic"] = seen.topic
        doubts = list(reading.unsure)
        doubts += [f"{other.name(r.column)!r} may mark trials as well" for other, r in trials[1:]]
        behind = _behind([f"unsure: {'; '.join(doubts)}"] if doubts else [])
        return [f"trials: {_flow(keys)}{behind}"], [f"trials: {doubt}" for doubt in doubts]
    if not clock.gaps or clock.column is None or clock.back_at is not None:
        return [], []
    if len(clock.gaps) >= _MOST_TRIALS:
        return [], [f"trials: {len(clock.gaps)} gaps in time, too many to be breaks between trials"]
    stamps = main.columns[clock.column]
    t = (stamps - stamps[0]).astype(float) * clock.factor
    cuts = [0, *(row + 1 for row, _ in clock.gaps), len(t)]
    lines = ["trials:  # unsure: pieces between gaps in time"]
    for k, (a, b) in enumerate(zip(cuts, cuts[1:], strict=False)):
        end = float(t[b - 1]) + 0.5 * clock.period_s
        begin = max(float(t[a]) - 0.5 * clock.period_s, 0.0)
        keys = {"name": f"part_{k + 1}", "begin": f"{begin:.9g} s", "end": f"{end:.9g} s"}
        lines.append(f"  - {_flow(keys)}")
    longest = max(gap for _, gap in clock.gaps)
    return lines, [
        f"trials: {len(clock.gaps)} gaps in time, up to {longest:.4g} s: breaks or lost rows"
    ]


def _laps(clock: ClockGuess, main: Seen, rows: Sequence[Row]) -> list[str]:
    """Whether the motion comes again, so that a person would call its laps trials."""
    for row in rows:
        if row.seen is main and row.reading.unit is not None:
            lap = repeats_after(main.columns[row.reading.column])
            if lap is not None:
                return [
                    f"trials: {main.name(row.reading.column)!r} comes again every"
                    f" {lap * clock.period_s:.4g} s: laps may be trials"
                ]
    return []


def _behind(comments: Sequence[str]) -> str:
    text = "; ".join(comment for comment in comments if comment)
    return f"  # {''.join(c if c.isprintable() else ' ' for c in text)}" if text else ""


def _flow(keys: dict[str, Any]) -> str:
    return "{" + ", ".join(f"{key}: {_scalar(value)}" for key, value in keys.items()) + "}"


def _scalar(value: Any) -> str:
    """A value of YAML's flow style; text that could be read otherwise in double quotes."""
    if isinstance(value, list):
        return "[" + ", ".join(_quoted(one) for one in value) + "]"
    if not isinstance(value, str):
        return json.dumps(value)
    is_word = re.fullmatch(r"[A-Za-z][A-Za-z0-9_/*]*( [a-z]+)?", value, re.ASCII)
    if is_word and value.lower() not in _NO_TEXTS:
        return value
    return value if re.fullmatch(r"[0-9.e+-]+ [A-Za-z]+", value, re.ASCII) else _quoted(value)


def _quoted(text: str) -> str:
    """In double quotes, with every sign that YAML might not take as an escape."""
    return "".join(
        c if c.isprintable() and c <= "\ud7ff" else f"\\U{ord(c):08x}"
        for c in json.dumps(text, ensure_ascii=False)
    )
