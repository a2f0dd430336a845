"""A recorded run as a page needs it: its columns, its phases as spans of samples, its files."""

import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from epa_rt.config.rig import Rig, rig_from
from epa_rt.config.source import ConfigError, parse_yaml
from epa_rt.experiments.experiment import Experiment, Phase, experiment_from
from epa_rt.logs.reader import Event, LogReader
from epa_rt.report.shown import Shown, shown_for

_CYCLE = (
    "cycle",
    "t_ns",
    "flags",
    "state",
    "phase",
    "lateness_ns",
    "busy_ns",
    "invalid_mask",
    "stale_mask",
)
_RUN = (  # the supervisor's state in which phases go on; when it stops it brakes, which is no phase
    "run"
)


class NotShown(Exception):
    """Why a section of a page has nothing to show, as a sentence."""


@dataclass(frozen=True)
class Span:
    """One stretch of samples ``begin`` to ``end`` (not included). ``phase`` is None for a state."""

    name: str
    begin: int
    end: int
    index: int
    phase: Phase | None = None

    @property
    def samples(self) -> slice:
        return slice(self.begin, self.end)

    @property
    def is_trial(self) -> bool:
        return self.phase is not None and self.phase.trial_index is not None


@dataclass
class Run:
    """Everything of one log. Columns are in SI, keyed by signal; ``missing`` says what a cut log
    lacks.
    """

    name: str
    size_bytes: int
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, bytes]
    layout: Any
    outcome: str
    cause: str
    missing: list[str]
    events: list[Event]
    cycle: dict[str, np.ndarray]
    signals: dict[str, np.ndarray] = field(repr=False)

    @cached_property
    def t_s(self) -> np.ndarray:
        """Times of the samples in s, from the first one on."""
        t_ns = self.cycle["t_ns"]
        return (t_ns - t_ns[0]) / 1e9 if len(t_ns) else np.zeros(0)

    def event_s(self, event: Event) -> float:
        """When an event was, in s since the first sample; by its cycle where it carries no time."""
        if not len(self.t_s):
            return 0.0
        t_ns = event.t_ns or int(self.cycle["t_ns"][min(event.cycle, len(self.t_s) - 1)])
        return max(t_ns - int(self.cycle["t_ns"][0]), 0) / 1e9

    @property
    def period_s(self) -> float:
        """The cycle's period in s: the rig's, else as the samples are apart."""
        try:
            return self.rig.period_s
        except NotShown:
            return float(np.median(np.diff(self.t_s))) if len(self.t_s) > 1 else 0.001

    @property
    def facts(self) -> dict[str, str]:
        """What the run said of itself when it began."""
        return self.metadata.get("run", {})

    @cached_property
    def _rig(self) -> Rig | str:
        try:
            return rig_from(parse_yaml(self.text("rig.yaml"), f"{self.name}[rig.yaml]"))
        except (ConfigError, NotShown) as error:
            return str(error)

    @property
    def rig(self) -> Rig:
        """Raises NotShown where the log has none that can be read."""
        if isinstance(self._rig, str):
            raise NotShown(f"the rig file in the log cannot be read ({self._rig})")
        return self._rig

    @cached_property
    def _experiment(self) -> Experiment | str:
        try:
            return experiment_from(
                parse_yaml(self.text("experiment.yaml"), f"{self.name}[experiment.yaml]"), self.rig
            )
        except (ConfigError, NotShown) as error:
            return str(error)

    @property
    def experiment(self) -> Experiment:
        """Raises NotShown where the log has none that can be read."""
        self.require_experiment()
        return self._experiment

    def require_experiment(self) -> None:
        """Raises NotShown where the log has no experiment that can be read."""
        if "experiment.yaml" not in self.attachments:
            raise NotShown("the log carries no experiment.yaml: moved by hand, or imported")
        if isinstance(self._experiment, str):
            raise NotShown(f"the experiment file in the log cannot be read ({self._experiment})")

    def text(self, attachment: str) -> str:
        """An attached file as text. Raises NotShown where the log has none."""
        if attachment not in self.attachments:
            raise NotShown(f"the log carries no {attachment}")
        return self.attachments[attachment].decode("utf-8", "replace")

    @cached_property
    def shown(self) -> Shown:
        """Units of this run's page."""
        atmosphere_pa = (
            self._rig.atmosphere_pa if isinstance(self._rig, Rig) else Shown.atmosphere_pa
        )
        return shown_for(
            self.attachments.get("experiment.yaml", b"").decode("utf-8", "replace"), atmosphere_pa
        )

    @cached_property
    def states(self) -> list[Span]:
        """The supervisor's states in order."""
        return [
            Span(_named(self.layout.states, i), a, b, i)
            for a, b, i in _stretches(self.cycle["state"])
        ]

    @cached_property
    def phases(self) -> list[Span]:
        """The experiment's phases as they were run, in order."""
        running = [i for i, name in enumerate(self.layout.states) if name == _RUN]
        index = np.where(np.isin(self.cycle["state"], running), self.cycle["phase"], -1)
        planned = self._experiment.phases if isinstance(self._experiment, Experiment) else ()
        return [
            Span(_named(self.layout.phases, i), a, b, i, planned[i] if i < len(planned) else None)
            for a, b, i in _stretches(index)
            if i >= 0
        ]

    @property
    def trials(self) -> list[Span]:
        """The phases that are trials. Raises NotShown where the experiment cannot be read."""
        self.require_experiment()
        return [span for span in self.phases if span.is_trial]

    def seconds(self, span: Span) -> float:
        return (span.end - span.begin) * self.period_s


def load_run(path: str | os.PathLike) -> Run:
    """Reads a log whole into memory, about 250 bytes a cycle. Raises LogError where it is none."""
    with LogReader(path) as log:
        groups = log.layout.groups()
        tables = log.tables({"/cycle": _CYCLE, **{f"/{group}": None for group in groups}})
        events = log.events()
        outcome, cause = outcome_of(log, events)
        signals = {name: column for group in groups for name, column in tables[f"/{group}"].items()}
        return Run(
            os.path.basename(path),
            os.path.getsize(path),
            log.metadata,
            log.attachments,
            log.layout,
            outcome,
            cause,
            log.missing,
            events,
            tables["/cycle"],
            signals,
        )


def outcome_of(log: LogReader, events: list[Event]) -> tuple[str, str]:
    """How a run ended, and why. Where the file does not say: a trip among its events, else
    'unknown'.
    """
    if log.ending is not None:
        return log.ending.outcome, log.ending.cause
    trip = next((event for event in events if event.kind == "trip"), None)
    return ("tripped", trip.text) if trip else ("unknown", "the log has no ending")


def _stretches(values: np.ndarray) -> Iterator[tuple[int, int, int]]:
    if not len(values):
        return
    cuts = np.flatnonzero(np.diff(values)) + 1
    begins = [0, *cuts.tolist()]
    for begin, end in zip(begins, [*begins[1:], len(values)], strict=True):
        yield begin, end, int(values[begin])


def _named(names: tuple[str, ...], index: int) -> str:
    return names[index] if 0 <= index < len(names) else str(index)
