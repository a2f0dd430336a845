"""A log as one table: a row for each cycle, a column for each quantity, units beside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

import numpy as np

from epa_rt.logs.run_record import record_of
from epa_rt.report.run import NotShown, Run, Span
from epa_rt.report.shown import unit_of

if TYPE_CHECKING:
    import pandas as pd

SCHEMA = "epa_rt.table/1"
_COUNTED = ("cycle", "t_ns", "flags", "lateness_ns", "busy_ns", "invalid_mask", "stale_mask")
_OWN_UNITS = {"t_s": "s", "t_ns": "ns", "lateness_ns": "ns", "busy_ns": "ns"}
NO_TRIAL = 0


@dataclass(frozen=True)
class Named:
    """A column of words: ``index`` (N,) into ``names``; -1 where there is no name."""

    index: np.ndarray
    names: tuple[str, ...]

    def texts(self) -> np.ndarray:
        """The words, (N,) objects; '' where there is none."""
        words: np.ndarray = np.array([*self.names, ""], dtype=object)
        found: np.ndarray = words[self.index]
        return found


@dataclass(frozen=True)
class Table:
    """``columns``: by name, (N,) numbers, in the log's order behind time and place in the run.

    Every float64 is the log's own; names that end in ``_raw`` are int64 where all are whole
    numbers. ``trial`` counts from 1 and is 0 outside of trials. ``units``: SI by column, '' for
    counts. ``about``: run, record, outcome, trials and events as plain values.
    """

    columns: Mapping[str, np.ndarray | Named]
    units: Mapping[str, str]
    about: Mapping[str, Any]

    @property
    def rows(self) -> int:
        column = self.columns["t_s"]
        return len(column.index if isinstance(column, Named) else column)

    def to_pandas(self) -> pd.DataFrame:
        """The table as a DataFrame; states and phases are categories, ``attrs`` holds the rest."""
        import pandas as pd

        data = {
            name: pd.Categorical.from_codes(column.index, list(column.names))
            if isinstance(column, Named)
            else column
            for name, column in self.columns.items()
        }
        frame = pd.DataFrame(data)
        frame.attrs = {"schema": SCHEMA, "units": dict(self.units), **self.about}
        return frame


def table_of(run: Run, samples: slice = slice(None), patterns: tuple[str, ...] = ()) -> Table:
    """The table of a run, of a stretch of ``samples``, with the signals that fit any of the
    ``patterns`` (* and ?; none: all). Raises NotShown for a pattern that fits no signal.
    """
    signals = chosen(run, patterns)
    columns: dict[str, np.ndarray | Named] = {"t_s": run.t_s[samples]}
    columns |= {name: run.cycle[name][samples] for name in _COUNTED}
    columns["state"] = _named(run.cycle["state"][samples], run.layout.states)
    columns["phase"] = _named(_phases(run)[samples], run.layout.phases)
    columns["trial"] = _trials(run)[samples]
    units = {name: _OWN_UNITS.get(name, "") for name in columns}
    for name in signals:
        key = f"signal_{name}" if name in units else name  # a row may be called as a column is
        columns[key], units[key] = _whole(name, run.signals[name][samples]), _unit(name)
    return Table(columns, units, about(run))


def chosen(run: Run, patterns: tuple[str, ...]) -> list[str]:
    """Signals that fit, in the log's order. Raises NotShown for a pattern that fits none."""
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in run.signals):
            raise NotShown(f"found no signal '{pattern}', expected one of {', '.join(run.signals)}")
    return [
        name
        for name in run.signals
        if not patterns or any(fnmatchcase(name, pattern) for pattern in patterns)
    ]


def about(run: Run) -> dict[str, Any]:
    """What a log says beside its columns, as plain values for JSON."""
    record = record_of(run.attachments)
    told = record and {**vars(record), "muscles": dict(record.muscles), "notes": [*record.notes]}
    return {
        "log": run.name,
        "run": dict(run.facts),
        "record": told,
        "outcome": run.outcome,
        "cause": run.cause,
        "missing": list(run.missing),
        "trials": [
            {
                "trial": number,
                "name": span.name,
                "begin_cycle": int(run.cycle["cycle"][span.begin]),
                "last_cycle": int(run.cycle["cycle"][span.end - 1]),
                "begin_s": float(run.t_s[span.begin]),
                "end_s": float(run.t_s[span.end - 1]),
                "values": values_of(run, span),
            }
            for number, span in enumerate(trials_of(run), start=1)
        ],
        "events": [
            {
                "t_s": run.event_s(event),
                "cycle": event.cycle,
                "kind": event.kind,
                "text": event.text,
                "data": event.data,
            }
            for event in run.events
        ],
    }


def trials_of(run: Run) -> list[Span]:
    """The trials that were begun, in order; by the events that began them, so that imported logs
    have theirs as well.
    """
    begun = _trial_events(run)
    return [span for span in run.phases if span.index in begun]


def values_of(run: Run, span: Span) -> dict[str, Any]:
    """What the experiment put in for '$' names in that phase; empty where it repeats nothing."""
    values = _trial_events(run).get(span.index, {}).get("values")
    return dict(values) if isinstance(values, dict) else {}


def _trial_events(run: Run) -> dict[int, dict[str, Any]]:
    begun = [event.data for event in run.events if event.kind == "phase_start"]
    return {
        data["index"]: data
        for data in begun
        if data.get("trial_index") is not None and isinstance(data.get("index"), int)
    }


def _trials(run: Run) -> np.ndarray:
    numbers = np.full(len(run.t_s), NO_TRIAL, np.int64)
    for number, span in enumerate(trials_of(run), start=1):
        numbers[span.samples] = number
    return numbers


def _phases(run: Run) -> np.ndarray:
    """Index of the phase, -1 outside of the experiment's phases (bring-up, stop)."""
    index = np.full(len(run.t_s), -1, np.int64)
    for span in run.phases:
        index[span.samples] = span.index
    return index


def _named(index: np.ndarray, names: tuple[str, ...]) -> Named:
    inside = (index >= 0) & (index < len(names))
    unique = tuple(dict.fromkeys(names))  # a category stands once
    place = np.array([*(unique.index(name) for name in names), -1], np.int64)
    return Named(place[np.where(inside, index, -1)], unique)


def _whole(name: str, values: np.ndarray) -> np.ndarray:
    if not name.endswith("_raw") or not np.isfinite(values).all():
        return values
    counts = values.astype(np.int64)
    return counts if (counts == values).all() else values


def _unit(name: str) -> str:
    return unit_of(name) if not name.endswith(("_raw", "_mask")) else ""
