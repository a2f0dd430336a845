"""Two runs side by side, aligned by phase: what differs by more than noise, and since when."""

from __future__ import annotations

import difflib
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from epa_rt.control.valve_settings import ValveSettings
from epa_rt.report.run import NotShown, Run, Span
from epa_rt.report.shown import unit_of
from epa_rt.runs.noise import (
    SIGMAS,
    Blocks,
    block_noise,
    block_samples,
    blocks_of,
    own_noise,
    rounding,
    sample_noise,
    step_of,
)
from epa_rt.runs.repeatability import Repeatability, repeatability_of
from epa_rt.runs.table import trials_of

SCHEMA = "epa_rt.compare/1"
_IN_A_ROW = 2  # blocks; one alone may be a spike
_START_BLOCKS = 3  # of a stretch with shut valves: what it is compared with
_DIFFER_LINES = 40  # of a file that was changed
OFFSET, DRIFT, MISSING, NOISE = "offset", "drift", "missing", "noise"
_LOUDER = 1.5  # times the other run's noise: a tenth is chance, and a worn contact doubles it
_LOUD_S = 1.0  # a phase of this length at least tells its noise to some per cent

TRIM_S = 2.0 * (ValveSettings().settle_s + ValveSettings().average_s)
"""Each run may need one trim of its valves more than the other: it settles and is averaged."""


class NothingInCommon(Exception):
    """Why two logs cannot be compared, one sentence."""


@dataclass(frozen=True)
class Pair:
    """One phase that both runs have. ``in_a``, ``in_b``: the samples that are compared: all of
    them, or the end of a phase in which valves are at work (each run opens them when it must).
    """

    name: str
    a: Span
    b: Span
    trial: int | None
    in_a: slice
    in_b: slice
    at_work: bool


@dataclass(frozen=True)
class Difference:
    """One signal that differs in one phase; values in the signal's SI unit.

    ``kind``: 'offset' (by more than two runs of one rig), 'drift' (moves away while the valves
    are shut), 'missing' (one run has no value), 'noise' (of a sample: B's less A's). ``since_s``:
    when it began, from the phase's begin; ``at_s``: the same of run A; ``beyond_s``: when it was
    beyond chance, from the phase's begin. ``largest``: B less A where it is furthest beyond
    ``allowed``.
    """

    signal: str
    unit: str
    kind: str
    phase: str
    trial: int | None
    since_s: float
    at_s: float
    beyond_s: float
    largest: float
    allowed: float

    @property
    def ratio(self) -> float:
        """The largest difference in parts of what is allowed."""
        return abs(self.largest) / self.allowed if self.allowed else float("inf")


@dataclass(frozen=True)
class Judged:
    """One signal over the phases that both have: differences and what was allowed, by phase."""

    signal: str
    unit: str
    noise: float
    step: float
    blocks: tuple[Blocks, ...]
    allowed: tuple[np.ndarray, ...]


@dataclass(frozen=True)
class Comparison:
    """What two runs differ in. ``differences``: the earliest first. ``set_up``: what was put in
    differently, a sentence each, with the changed lines of files.
    """

    a: Run
    b: Run
    pairs: tuple[Pair, ...]
    differences: tuple[Difference, ...]
    judged: tuple[Judged, ...]
    identical: bool
    only_a: tuple[str, ...] = ()
    only_b: tuple[str, ...] = ()
    set_up: tuple[tuple[str, tuple[str, ...]], ...] = ()
    asked: tuple[Difference, ...] = ()
    notes: tuple[str, ...] = field(default=())

    @property
    def first(self) -> Difference | None:
        """The clearest difference in the phase in which one shows first."""
        if not self.differences:
            return None
        phase = self.differences[0].phase
        return max(
            (one for one in self.differences if one.phase == phase), key=lambda one: one.ratio
        )

    @property
    def other_length(self) -> tuple[Pair, ...]:
        """Phases that lasted otherwise than a trim more or less explains."""
        return tuple(
            pair
            for pair in self.pairs
            if abs(self.a.seconds(pair.a) - self.b.seconds(pair.b)) > TRIM_S
        )

    @property
    def is_different(self) -> bool:
        """Whether anything differs by more than chance: a signal, what was asked for, a phase's
        length, the end.
        """
        return bool(
            self.differences
            or self.asked
            or self.other_length
            or self.only_a
            or self.only_b
            or self.a.outcome != self.b.outcome
        )

    def as_json(self) -> dict[str, Any]:
        """Plain values, as docs/runs.md has it."""
        first = self.first
        return {
            "schema": SCHEMA,
            "a": self.a.name,
            "b": self.b.name,
            "identical": self.identical,
            "different": self.is_different,
            "first": vars(first) | {"ratio": first.ratio} if first else None,
            "differences": [vars(one) | {"ratio": one.ratio} for one in self.differences],
            "asked": [vars(one) | {"ratio": one.ratio} for one in self.asked],
            "phases": [
                {
                    "phase": pair.name,
                    "trial": pair.trial,
                    "a_s": self.a.seconds(pair.a),
                    "b_s": self.b.seconds(pair.b),
                    "other_length": pair in self.other_length,
                }
                for pair in self.pairs
            ],
            "only_a": list(self.only_a),
            "only_b": list(self.only_b),
            "set_up": [{"what": what, "lines": list(lines)} for what, lines in self.set_up],
            "noise": [
                {"signal": one.signal, "unit": one.unit, "sigma": one.noise, "step": one.step}
                for one in self.judged
            ],
            "notes": list(self.notes),
        }


def compare(a: Run, b: Run) -> Comparison:
    """Compares run B with run A. Raises NothingInCommon where no phase or no signal is in both."""
    signals = [name for name in a.signals if name in b.signals]
    allowance = repeatability_of(a, b)
    pairs, only_a, only_b = _pairs(a, b, allowance)
    if not signals or not pairs:
        what = "phase" if signals else "signal"
        raise NothingInCommon(
            f"{a.name} ({_named(a)}) and {b.name} ({_named(b)}): found no {what} that both have,"
            " expected runs of one rig and experiment"
        )
    if not np.isclose(a.period_s, b.period_s):
        raise NothingInCommon(
            f"{a.name} and {b.name}: found cycles of {a.period_s * 1e3:g} ms and"
            f" {b.period_s * 1e3:g} ms, expected the same"
        )
    measured = [name for name in signals if name in a.layout.measured and unit_of(name)]
    judged = [_judged(a, b, pairs, name, allowance) for name in measured]
    found = [one for signal in judged for one in _differences(a, pairs, signal)]
    found += [one for signal in judged for one in _noises(a, b, pairs, signal)]
    for name in allowance.pressures:
        if name in signals:
            found += _drifts(a, b, pairs, name, allowance)
    asked = [
        one
        for name in signals
        if name in a.layout.reference
        for one in _differences(a, pairs, _judged(a, b, pairs, name, allowance))
    ]
    return Comparison(
        a,
        b,
        tuple(pairs),
        tuple(_earliest(found)),
        tuple(judged),
        _identical(a, b),
        only_a,
        only_b,
        tuple(_set_up(a, b)),
        tuple(_earliest(asked)),
        tuple(allowance.notes),
    )


def _named(run: Run) -> str:
    told = run.facts
    return f"{told.get('experiment', 'an experiment')} on {told.get('rig', 'a rig')}"


def _identical(a: Run, b: Run) -> bool:
    """Whether every sample of every signal is the same, bit for bit."""
    return list(a.signals) == list(b.signals) and all(
        a.signals[name].tobytes() == b.signals[name].tobytes() for name in a.signals
    )


def _pairs(
    a: Run, b: Run, allowance: Repeatability
) -> tuple[list[Pair], tuple[str, ...], tuple[str, ...]]:
    """Phases of one name, the first with the first, the second with the second."""
    keyed_a, keyed_b = _keyed(a), _keyed(b)
    end = _IN_A_ROW * block_samples(a.period_s)
    pairs, trials = [], trials_of(a)
    for key, span in keyed_a.items():
        if key not in keyed_b:
            continue
        other = keyed_b[key]
        in_a, in_b = span.samples, other.samples
        at_work = allowance.is_at_work(in_a, in_b)
        if at_work and span not in trials:
            in_a, in_b = (slice(max(s.stop - end, s.start), s.stop) for s in (in_a, in_b))
        trial = trials.index(span) + 1 if span in trials else None
        pairs.append(Pair(span.name, span, other, trial, in_a, in_b, at_work))
    return (
        pairs,
        tuple(key[0] for key in keyed_a if key not in keyed_b),
        tuple(key[0] for key in keyed_b if key not in keyed_a),
    )


def _keyed(run: Run) -> dict[tuple[str, int], Span]:
    seen: Counter[str] = Counter()
    keyed = {}
    for span in run.phases:
        keyed[span.name, seen[span.name]] = span
        seen[span.name] += 1
    return keyed


def _judged(a: Run, b: Run, pairs: list[Pair], name: str, allowance: Repeatability) -> Judged:
    n = block_samples(a.period_s)
    x, y = a.signals[name], b.signals[name]
    blocks = [blocks_of(x[pair.in_a], y[pair.in_b], n) for pair in pairs]
    step = max(step_of(x), step_of(y))
    allowed = []
    sigmas = block_noise([one.difference for one in blocks])
    for pair, one, sigma in zip(pairs, blocks, sigmas, strict=True):
        noise = sample_noise(x[pair.in_a], y[pair.in_b])
        chance = SIGMAS * sigma + rounding(step, noise)
        valves = allowance.of(name, pair.in_a, pair.at_work and pair.trial is not None, one, n)
        allowed.append(chance + one.late + valves)
    return Judged(name, unit_of(name), max(sigmas), step, tuple(blocks), tuple(allowed))


def _differences(a: Run, pairs: list[Pair], judged: Judged) -> list[Difference]:
    found = []
    for pair, blocks, allowed in zip(pairs, judged.blocks, judged.allowed, strict=True):
        lacks = np.isfinite(blocks.a) != np.isfinite(blocks.b)
        for kind, beyond, size in (
            (MISSING, lacks, np.ones(len(lacks))),
            (OFFSET, np.abs(blocks.difference) > allowed, blocks.difference),
        ):
            one = _first_of(a, pair, judged.signal, kind, beyond, size, allowed)
            found += [one] if one else []
    return found


def _noises(a: Run, b: Run, pairs: list[Pair], judged: Judged) -> list[Difference]:
    """Phases in which one run's samples scatter more than the other's."""
    found = []
    for pair in pairs:
        x, y = a.signals[judged.signal][pair.in_a], b.signals[judged.signal][pair.in_b]
        if min(len(x), len(y)) * a.period_s < _LOUD_S:
            continue
        before, now = (own_noise(values, judged.step) for values in (x, y))
        if max(before, now) > _LOUDER * min(before, now):
            allowed = (_LOUDER - 1.0) * min(before, now)
            at_s = float(a.t_s[pair.a.begin])
            size = (pair.name, pair.trial, 0.0, at_s, 0.0, now - before, allowed)
            found.append(Difference(judged.signal, judged.unit, NOISE, *size))
    return found


def _drifts(
    a: Run, b: Run, pairs: list[Pair], name: str, allowance: Repeatability
) -> list[Difference]:
    """Where a pressure moves away from the other run's although the valves of its muscle are shut
    in both: what was different when they shut falls out, so a slow leak shows. Phases that follow
    each other with shut valves go on from the first one's begin.
    """
    n = block_samples(a.period_s)
    found = []
    shut_to = (-1, -1)  # where the gas that is trapped now has been followed to
    start_a = start_b = np.nan
    for pair in pairs:
        if not allowance.is_shut(name, pair.in_a, pair.in_b):
            continue
        x, y = a.signals[name][pair.in_a], b.signals[name][pair.in_b]
        blocks = blocks_of(x, y, n)
        if shut_to != (pair.in_a.start, pair.in_b.start):
            start_a = start_b = np.nan
        shut_to = (pair.in_a.stop, pair.in_b.stop)
        if not start_a > 0.0 and len(blocks.a) > _START_BLOCKS:
            start_a, start_b = (np.mean(m[:_START_BLOCKS]) for m in (blocks.a, blocks.b))
        if not start_a > 0.0 or len(blocks.a) < _IN_A_ROW:  # no reading, none of a gas, too short
            continue
        expected = (start_b - start_a) * blocks.a / start_a  # trapped gas: in proportion
        moved = blocks.difference - expected
        sigma = block_noise([moved])[0] * np.sqrt(1.0 + 1.0 / _START_BLOCKS)
        allowed = SIGMAS * sigma + rounding(step_of(x), sample_noise(x, y)) + blocks.late
        one = _first_of(a, pair, name, DRIFT, np.abs(moved) > allowed, moved, allowed)
        found += [one] if one else []
    return found


def _first_of(
    a: Run,
    pair: Pair,
    signal: str,
    kind: str,
    beyond: np.ndarray,
    size: np.ndarray,
    allowed: np.ndarray,
) -> Difference | None:
    """The first stretch of blocks beyond what is allowed; None where there is none."""
    begin = _first_in_a_row(beyond & np.isfinite(size), size)
    if begin is None:
        return None
    n = block_samples(a.period_s)
    onset = begin
    while kind != MISSING and _rises(size, allowed, onset - 1, size[begin]):
        onset -= 1
    before = pair.in_a.start - pair.a.begin
    since_s = (before + onset * n) * a.period_s
    outside = np.flatnonzero(beyond[begin:]) + begin
    worst = int(outside[np.argmax(np.abs(size[outside]) / np.maximum(allowed[outside], 1e-300))])
    is_missing = kind == MISSING
    return Difference(
        signal,
        unit_of(signal),
        kind,
        pair.name,
        pair.trial,
        since_s,
        float(a.t_s[pair.a.begin]) + since_s,
        (before + begin * n) * a.period_s,
        float("nan") if is_missing else float(size[worst]),
        0.0 if is_missing else float(allowed[worst]),
    )


def _rises(size: np.ndarray, allowed: np.ndarray, i: int, like: float) -> bool:
    """Whether a block before a difference belongs to it: to the same side, and above a fifth of
    what is allowed, which is one standard deviation.
    """
    return i >= 0 and bool(size[i] * like > 0.0 and abs(size[i]) > allowed[i] / SIGMAS)


def _first_in_a_row(beyond: np.ndarray, size: np.ndarray) -> int | None:
    row = 0
    for i, (is_beyond, value) in enumerate(zip(beyond, np.sign(size), strict=True)):
        row = row + 1 if is_beyond and (row == 0 or value == np.sign(size[i - 1])) else is_beyond
        if row >= _IN_A_ROW:
            return i - _IN_A_ROW + 1
    return None


def _earliest(found: list[Difference]) -> list[Difference]:
    return sorted(found, key=lambda one: (one.at_s, -one.ratio if one.allowed else 0.0))


def _set_up(a: Run, b: Run) -> list[tuple[str, tuple[str, ...]]]:
    found: list[tuple[str, tuple[str, ...]]] = [
        (f"{key}: {a.facts.get(key, 'not recorded')} / {b.facts.get(key, 'not recorded')}", ())
        for key in sorted({*a.facts, *b.facts})
        if a.facts.get(key) != b.facts.get(key)
    ]
    for name in ("rig.yaml", "experiment.yaml", "plant.yaml", "version.json"):
        try:
            texts = [run.text(name) for run in (a, b)]
        except NotShown:
            continue
        if texts[0] != texts[1]:
            before, after = (text.splitlines() for text in texts)
            lines = difflib.unified_diff(before, after, n=0, lineterm="")
            changed = [line for line in lines if not line.startswith(("---", "+++", "@@"))]
            more = len(changed) - _DIFFER_LINES
            shown = [*changed[:_DIFFER_LINES], *([f"({more} more lines)"] if more > 0 else [])]
            found.append((f"{name} differs", tuple(shown)))
    return found
