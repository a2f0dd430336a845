"""What is known of a run that is on: the newest cycle, the last seconds, what happened so far."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from epa_rt.config.rig import Rig, rig_from
from epa_rt.config.source import ConfigError, parse_yaml
from epa_rt.live.attach import Answer, Happened, Message, NotOn, Over, Rows, RunFacts, Status
from epa_rt.logs.layout import FLAG_OVERRUN, FLAG_WORKING_COUNTER_OK
from epa_rt.report.shown import unit_of
from epa_rt.signals.sent import sent_columns

KEPT_S = 20.0
STEP_NS = 20_000_000
"""One value in so much of the rig's time is kept for the plots: a screen has no more columns."""

LATENESS_CYCLES = 5000
EVENTS_KEPT = 200
_PACE_S = 5.0  # over which time left is reckoned


@dataclass(frozen=True)
class Lateness:
    """Of the newest cycles, in us: 99.9th percentile and worst; cycles that they are of."""

    p999_us: float
    worst_us: float
    cycles: int


class WatchedRun:
    """Takes the messages of one feed. Raises NotOn where its rig file cannot be read.

    ``latest``: the newest cycle's slot, None before. ``trip``: its sentence. ``outcome`` and
    ``cause``: once it ended. ``left``: how the rig was left, in words.
    """

    def __init__(self, facts: RunFacts) -> None:
        self.facts = facts
        self.rig = _rig_of(facts)
        self.groups = facts.layout.groups()
        self.places = {name: i for i, name in enumerate(facts.layout.values)}
        self.units = {name: unit_of(name) for name in facts.layout.values}
        self.latest: np.void | None = None
        self.cycles = self.bad_cycles = self.late_cycles = 0
        self.worst_ns = 0
        self.skipped_rows = 0
        self.events: deque[Happened] = deque(maxlen=EVENTS_KEPT)
        self.missed_events = 0
        self.status: Status | None = None
        self.answers: deque[Answer] = deque(maxlen=8)
        self.trip = self.category = self.outcome = self.cause = self.left = ""
        self.over: Over | None = None
        self._kept: deque[np.ndarray] = deque(maxlen=round(KEPT_S * 1e9 / STEP_NS))
        self._last_step = -1
        self._lateness: deque[np.ndarray] = deque()
        self._lateness_cycles = 0
        self._pace: deque[tuple[float, int]] = deque()
        self._next_number = 1

    def take(self, message: Message) -> None:
        """One message of the feed, in its order."""
        if isinstance(message, Rows):
            self._take_rows(message.slots)
        elif isinstance(message, Happened):
            self._take_event(message)
        elif isinstance(message, Status):
            self.status = message
        elif isinstance(message, Answer):
            self.answers.append(message)
        else:
            self.over = message

    @property
    def state(self) -> str:
        """The state's name; '-' before the first cycle."""
        return self._named(self.facts.layout.states, "state")

    @property
    def phase(self) -> str:
        """The phase's name; '-' where none is on."""
        return self._named(self.facts.layout.phases, "phase")

    @property
    def t_s(self) -> float:
        """Time since the first cycle, of the rig."""
        return 0.0 if self.latest is None else (int(self.latest["cycle"]) + 1) * self._period_s

    @property
    def total_s(self) -> float:
        """What the experiment is expected to take; 0 where nobody knows."""
        return self.facts.total_cycles * self._period_s

    @property
    def left_s(self) -> float | None:
        """Time left by the clock on the wall, at the present pace; None where nobody knows."""
        if self.latest is None or not self.facts.total_cycles or len(self._pace) < 2:
            return None
        (begin_s, begin), (end_s, end) = self._pace[0], self._pace[-1]
        cycles = self.facts.total_cycles - int(self.latest["cycle"]) - 1
        if end <= begin or cycles < 0:
            return None
        return cycles * (end_s - begin_s) / (end - begin)

    @property
    def bus_ok(self) -> bool:
        """Whether the newest cycle's working counter was right."""
        return self.latest is not None and bool(self.latest["flags"] & FLAG_WORKING_COUNTER_OK)

    def value(self, name: str) -> float:
        """A signal's newest value, SI; NaN where there is none."""
        place = self.places.get(name)
        if place is None or self.latest is None:
            return float("nan")
        return float(self.latest["values"][place])

    def sent(self) -> dict[str, float]:
        """What left for the rig in the newest cycle, by output row, SI."""
        if self.latest is None:
            return {}
        raw = np.ascontiguousarray(self.latest["outputs_raw"])[None, :]
        return {name: float(column[0]) for name, column in sent_columns(self.rig, raw).items()}

    def recent(self, name: str) -> np.ndarray:
        """The last KEPT_S of a signal, one value in STEP_NS, SI; empty where there is none."""
        place = self.places.get(name)
        if place is None or not self._kept:
            return np.empty(0)
        return np.array([values[place] for values in self._kept])

    def lateness(self) -> Lateness:
        """Over the newest LATENESS_CYCLES."""
        if not self._lateness:
            return Lateness(0.0, 0.0, 0)
        newest = np.concatenate(list(self._lateness))[-LATENESS_CYCLES:]
        ordered = np.sort(newest)
        rank = max(int(np.ceil(0.999 * len(ordered))), 1)
        return Lateness(ordered[rank - 1] / 1e3, ordered[-1] / 1e3, len(ordered))

    def as_json(self) -> dict[str, Any]:
        """State and health for a machine that reads."""
        lateness, status = self.lateness(), self.status
        return {
            "state": self.state,
            "phase": self.phase,
            "t_s": round(self.t_s, 6),
            "total_s": self.total_s,
            "left_s": self.left_s,
            "cycle": -1 if self.latest is None else int(self.latest["cycle"]),
            "working_counter_ok": self.bus_ok,
            "bad_cycles": self.bad_cycles,
            "late_cycles": self.late_cycles,
            "lateness_p99_9_us": lateness.p999_us,
            "lateness_worst_us": self.worst_ns / 1e3,
            "skipped_rows": self.skipped_rows,
            "ring_ratio": 0.0 if status is None else status.ring_ratio,
            "recorder_failure": "" if status is None else status.failure,
            "trip": self.trip,
            "category": self.category,
            "outcome": self.outcome,
            "cause": self.cause,
            "end": self.left,
        }

    @property
    def _period_s(self) -> float:
        return self.facts.period_s

    def _take_rows(self, slots: np.ndarray) -> None:
        self.latest = slots[-1]
        self.cycles += len(slots)
        flags, lateness_ns = slots["flags"], slots["lateness_ns"]
        self.bad_cycles += int(np.count_nonzero(flags & FLAG_WORKING_COUNTER_OK == 0))
        self.late_cycles += int(np.count_nonzero(flags & FLAG_OVERRUN))
        self.worst_ns = max(self.worst_ns, int(lateness_ns.max()))
        self._lateness.append(lateness_ns)
        self._lateness_cycles += len(slots)
        while self._lateness_cycles - len(self._lateness[0]) >= LATENESS_CYCLES:
            self._lateness_cycles -= len(self._lateness.popleft())
        steps = (slots["t_ns"] // STEP_NS).astype(np.int64)
        for at in np.flatnonzero(np.diff(steps, prepend=self._last_step)).tolist():
            self._kept.append(slots["values"][at])
        self._last_step = int(steps[-1])
        now_s = time.monotonic()
        self._pace.append((now_s, int(self.latest["cycle"])))
        while len(self._pace) > 2 and now_s - self._pace[1][0] > _PACE_S:
            self._pace.popleft()

    def _take_event(self, event: Happened) -> None:
        self.missed_events += event.number - self._next_number
        self._next_number = event.number + 1
        self.events.append(event)
        if event.kind == "trip" and not self.trip:
            self.trip = event.text
        elif event.kind == "category":
            self.category = event.text
        elif event.kind == "summary":
            self.left = str(event.data.get("end_text") or "")
        elif event.kind == "end":
            self.outcome, self.cause = str(event.data.get("outcome") or ""), event.text
            self.left = str(event.data.get("end") or self.left)

    def _named(self, names: tuple[str, ...], column: str) -> str:
        index = -1 if self.latest is None else int(self.latest[column])
        return names[index] if 0 <= index < len(names) else "-"


def _rig_of(facts: RunFacts) -> Rig:
    try:
        return rig_from(parse_yaml(facts.rig, f"{facts.log}[rig.yaml]"))
    except ConfigError as error:
        raise NotOn(f"the rig file of the run cannot be read: {error}") from None
