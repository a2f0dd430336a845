"""A log in a notebook: signals as arrays with units and times, trials, events, the rig."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.experiments.experiment import Experiment
from epa_rt.logs.reader import Event
from epa_rt.logs.run_record import RunRecord, record_of
from epa_rt.report.run import NotShown, Run, Span, load_run
from epa_rt.report.shown import unit_of
from epa_rt.runs.table import Table, table_of, trials_of, values_of

if TYPE_CHECKING:
    import pandas as pd


T = TypeVar("T")


class EpaError(Exception):
    """What was given cannot be used: a sentence with file, what was found, what was expected."""


@dataclass(frozen=True)
class Signal:
    """``values`` (N,) in ``unit`` ('' for counts) at ``t_s`` (N,), in s since the first sample."""

    name: str
    unit: str
    t_s: np.ndarray
    values: np.ndarray

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        found = np.asarray(self.values, dtype=dtype)
        return found.copy() if copy else found

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        return f"Signal({self.name}, {self.unit or 'counts'}, {len(self)} samples)"


class Signals(Mapping[str, Signal]):
    """The signals of a log or of a stretch of it, by name; made when asked for."""

    def __init__(self, run: Run, samples: slice) -> None:
        self._run, self._samples = run, samples

    def __getitem__(self, name: str) -> Signal:
        if name not in self._run.signals:
            raise KeyError(f"{name}: expected one of {', '.join(self._run.signals)}")
        values = self._run.signals[name][self._samples]
        return Signal(name, unit_of(name), self._run.t_s[self._samples], values)

    def __iter__(self) -> Iterator[str]:
        return iter(self._run.signals)

    def __len__(self) -> int:
        return len(self._run.signals)

    def __repr__(self) -> str:
        return f"Signals({', '.join(self)})"


class Stretch:
    """A stretch of a log, such as a trial: ``name``, ``number`` (from 1, None where it is none),
    ``values`` as the experiment repeats them, ``t_s``, ``signals``.
    """

    def __init__(self, run: Run, span: Span, number: int | None = None) -> None:
        self._run, self.span, self.number = run, span, number
        self.name = span.name
        self.values: dict[str, Any] = values_of(run, span)

    @property
    def t_s(self) -> np.ndarray:
        """Times of its samples in s, since the log's first sample."""
        return self._run.t_s[self.span.samples]

    @property
    def duration_s(self) -> float:
        """Its length in s."""
        return self._run.seconds(self.span)

    @property
    def signals(self) -> Signals:
        """Its signals by name."""
        return Signals(self._run, self.span.samples)

    def __getitem__(self, name: str) -> Signal:
        return self.signals[name]

    def table(self, *patterns: str) -> Table:
        """As Log.table, of this stretch. Raises EpaError for a pattern that fits no signal."""
        try:
            return table_of(self._run, self.span.samples, patterns)
        except NotShown as error:
            raise EpaError(f"{self._run.name}: {error}") from None

    def to_pandas(self, *patterns: str) -> pd.DataFrame:
        """As Log.to_pandas, of this stretch."""
        return self.table(*patterns).to_pandas()

    def __repr__(self) -> str:
        kind = "Phase" if self.number is None else f"Trial {self.number}"
        return f"{kind}({self.name}, {self.duration_s:g} s)"


class Log:
    """One log, read whole into memory. Raises LogError where the file is none.

    ``log["muscle_pressure_pa"]`` is a Signal; ``log.trial(3)`` the third trial. ``missing`` says
    in sentences what a log that was cut or damaged lacks; the rest of it is there all the same.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self.run = load_run(self.path)

    @property
    def outcome(self) -> str:
        """'completed', 'stopped', 'tripped', 'failed', 'died', or 'unknown'."""
        return self.run.outcome

    @property
    def cause(self) -> str:
        """Why it ended so; '' where it completed."""
        return self.run.cause

    @property
    def missing(self) -> list[str]:
        """What a whole log would hold and this one does not, a sentence each."""
        return self.run.missing

    @property
    def facts(self) -> dict[str, str]:
        """What the run said of itself when it began: rig, experiment, backend, seed, ..."""
        return self.run.facts

    @cached_property
    def record(self) -> RunRecord:
        """Who ran what, when, with which code; empty where the log does not say it."""
        return record_of(self.run.attachments) or RunRecord()

    @property
    def rig(self) -> Rig:
        """The rig as the log carries it. Raises EpaError where it cannot be read."""
        return self._shown(lambda: self.run.rig)

    @property
    def experiment(self) -> Experiment:
        """The experiment as the log carries it. Raises EpaError where it cannot be read."""
        return self._shown(lambda: self.run.experiment)

    def _shown(self, read: Callable[[], T]) -> T:
        try:
            return read()
        except NotShown as error:
            raise EpaError(f"{self.path}: {error}") from None

    @property
    def attachments(self) -> dict[str, bytes]:
        """The files in the log, by name."""
        return self.run.attachments

    @property
    def period_s(self) -> float:
        """The cycle's period in s."""
        return self.run.period_s

    @property
    def t_s(self) -> np.ndarray:
        """Times of the samples in s, since the first one; (N,)."""
        return self.run.t_s

    @property
    def signals(self) -> Signals:
        """All signals by name."""
        return Signals(self.run, slice(None))

    def __getitem__(self, name: str) -> Signal:
        return self.signals[name]

    @property
    def events(self) -> list[Event]:
        """What happened, in order; ``run.event_s`` gives its time."""
        return self.run.events

    @cached_property
    def phases(self) -> tuple[Stretch, ...]:
        """The experiment's phases as they were run."""
        trials = trials_of(self.run)
        return tuple(
            Stretch(self.run, span, trials.index(span) + 1 if span in trials else None)
            for span in self.run.phases
        )

    @property
    def trials(self) -> tuple[Stretch, ...]:
        """The phases that are trials."""
        return tuple(phase for phase in self.phases if phase.number is not None)

    def trial(self, number: int) -> Stretch:
        """A trial, counted from 1. Raises EpaError where there is no such one."""
        if not 1 <= number <= len(self.trials):
            raise EpaError(
                f"{self.path}: found no trial {number}, expected 1 to {len(self.trials)}"
            )
        return self.trials[number - 1]

    def table(self, *patterns: str) -> Table:
        """A row for each cycle, a column for each signal that fits a pattern (none: all). Raises
        EpaError for a pattern that fits none.
        """
        return self._shown(lambda: table_of(self.run, patterns=patterns))

    def to_pandas(self, *patterns: str) -> pd.DataFrame:
        """The same as a DataFrame; ``attrs`` holds units, trials, events and who ran."""
        return self.table(*patterns).to_pandas()

    def __repr__(self) -> str:
        told = self.facts
        return (
            f"Log({self.path.name}: {told.get('experiment', '?')} on {told.get('rig', '?')},"
            f" {self.outcome}, {len(self.t_s)} cycles, {len(self.trials)} trials)"
        )
