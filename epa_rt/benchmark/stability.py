"""Stability: whether a diagnosis stays under a change that must not change it, and such changes.

An answer stays where its first family (or that nothing is named, or nothing of the catalogue) is
the other's, or stands in the other's 95 % set.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from epa_rt.config.rig_rows import si_unit_of
from epa_rt.config.units import unit
from epa_rt.gap.diagnosis import SILENT, Diagnosis
from epa_rt.gap.posterior.decide import HOLDS
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject
from epa_rt.logs.importers.gather import Gathered, Trial
from epa_rt.models.effect import Knob

NONE, UNKNOWN, REFUSED = "none", "not_in_catalogue", "refused"
SPREADS = 2.0  # of a nominal guess, by which it is moved
REST_S = 0.2  # over which motion is averaged where a rest is looked for
OTHER_UNITS = {
    "m": "mm",
    "rad": "deg",
    "N": "kN",
    "N*m": "mNm",
    "Pa": "psi",
    "m/s": "mm/s",
    "rad/s": "rpm",
    "A": "mA",
}


@dataclass(frozen=True)
class Answer:
    """``first``: the first family, NONE, UNKNOWN, or REFUSED where the logs were not diagnosed.
    ``sets``: sets of families with their probabilities, the most probable first; (NONE,) and
    (UNKNOWN,) are among them. ``says``: the answer, or the refusal, in words.
    """

    first: str
    sets: tuple[tuple[tuple[str, ...], float], ...] = ()
    says: str = ""

    @property
    def held(self) -> frozenset[str]:
        """Families in the fewest sets that hold ``HOLDS``."""
        found: set[str] = set()
        total = 0.0
        for families, share in self.sets:
            if total >= HOLDS:
                break
            found.update(families)
            total += share
        return frozenset(found)

    def as_json(self) -> dict[str, Any]:
        """Plain data, which ``answer_from`` reads back."""
        return {"first": self.first, "sets": [list(one) for one in self.sets], "says": self.says}


def answer_from(data: Mapping[str, Any]) -> Answer:
    """An answer from its plain data."""
    sets = tuple((tuple(families), float(share)) for families, share in data["sets"])
    return Answer(data["first"], sets, data["says"])


def answer_of(found: Diagnosis, families: Mapping[str, str]) -> Answer:
    """What a diagnosis says. ``families``: of each effect of the catalogue."""
    if found.verdict in SILENT:
        first = NONE
    else:
        first = found.effects[0].family if found.effects else UNKNOWN
    shares: dict[tuple[str, ...], float] = {}
    if found.posterior is not None:
        for one in found.posterior.models:
            key = tuple(sorted({families[name] for name in one.effects})) or (NONE,)
            shares[key] = shares.get(key, 0.0) + one.probability
        shares[UNKNOWN,] = found.posterior.unknown
    ranked = sorted(shares.items(), key=lambda item: -item[1])
    return Answer(first, tuple(ranked), found.says)


def stays(before: Answer, after: Answer) -> bool:
    """Whether two answers are the same within what either calls uncertain. A refusal never is."""
    if REFUSED in (before.first, after.first):
        return False
    return before.first == after.first or before.first in after.held or after.first in before.held


def figures(answers: Iterable[tuple[str, str, str, Answer, Answer]]) -> dict[str, Any]:
    """Shares of answers that stay, by kind of change and in all, and those that did not. Each
    entry: recording, kind, change, the answer before, the one after.
    """
    counts: dict[str, Counter[str]] = {}
    turned = []
    for recording, kind, change, before, after in answers:
        stayed = stays(before, after)
        for key in (kind, "all"):
            count = counts.setdefault(key, Counter())
            count["asked"] += 1
            count["stay"] += stayed
            count["same_first"] += before.first == after.first
            count["refused"] += after.first == REFUSED
        if not stayed:
            turned.append(
                {
                    "recording": recording,
                    "kind": kind,
                    "change": change,
                    "before": before.as_json(),
                    "after": after.as_json(),
                }
            )
    by_kind = {
        key: {
            "asked": count["asked"],
            "stay": count["stay"],
            "share": round(count["stay"] / count["asked"], 3),
            "same_first": count["same_first"],
            "refused": count["refused"],
        }
        for key, count in counts.items()
    }
    whole = by_kind.pop("all", None)
    return {"all": whole, "by_kind": by_kind, "turned": turned}


def moved_guesses(
    subject: Subject, recordings: Sequence[Recording], most: int = 2
) -> list[tuple[str, float]]:
    """Nominal parameters with a value ``SPREADS`` of their spreads off, up and down: those whose
    move changes the residuals most, in parts of their rms.

    Down is by the factor that leaves the believed value two spreads off, for spreads are parts of
    the value; what a bound cuts short is left out.
    """
    prepared = [subject.prepare(one) for one in recordings]
    ranked = []
    for knob in subject.nominal:
        values = [value for value in _moved(knob) if knob.low <= value <= knob.high]
        if knob.effect is None and knob.spread > 0.0 and values:
            size = max(_changes(subject, prepared, knob.key, value) for value in values)
            ranked.append((size, knob.key, values))
    ranked.sort(key=lambda one: -one[0])
    return [(key, value) for _, key, values in ranked[:most] for value in values]


def _moved(knob: Knob) -> tuple[float, float]:
    far = SPREADS * knob.spread
    if knob.value > 0.0 and far >= knob.value:
        return knob.value + far, knob.value / (1.0 + far / knob.value)
    return knob.value + far, knob.value - far


def _changes(subject: Subject, prepared: Sequence[object], key: str, value: float) -> float:
    """Rms by which a link's residual changes with a value, in parts of its own: the largest."""
    largest = 0.0
    for link in subject.touched(key):
        pairs = [
            (subject.residual(one, {}, link), subject.residual(one, {key: value}, link))
            for one in prepared
        ]
        was = np.concatenate([one for one, _ in pairs])
        change = np.concatenate([after - one for one, after in pairs])
        if np.isfinite(was).any():
            size = float(np.sqrt(np.nanmean(was**2))) or 1.0
            largest = max(largest, float(np.sqrt(np.nanmean(change**2))) / size)
    return largest


def halves(log: Gathered, watched: Sequence[str]) -> tuple[Gathered, Gathered]:
    """A log as two: cut where the trial begins that is nearest to its middle; where it has but one,
    where the watched channels move least in its middle third.
    """
    rows = len(log.grid.cycle)
    starts = [one.start for one in log.trials if one.judged][1:]
    at = min(starts, key=lambda row: abs(row - rows // 2)) if starts else _rest(log, watched)
    return _part(log, 0, at), _part(log, at, rows)


def _rest(log: Gathered, watched: Sequence[str]) -> int:
    rows, wide = len(log.grid.cycle), max(1, round(REST_S / log.grid.period_s))
    motion = np.zeros(rows - 1)
    for name in watched:
        speed = np.abs(np.diff(np.nan_to_num(log.measured[name])))
        motion += speed / (speed.mean() or 1.0)
    motion = np.convolve(motion, np.ones(wide) / wide, "same")
    return rows // 3 + int(np.argmin(motion[rows // 3 : 2 * rows // 3]))


def _part(log: Gathered, start: int, stop: int) -> Gathered:
    rows, grid = slice(start, stop), log.grid
    cycle, t_s = grid.cycle[rows] - grid.cycle[start], grid.t_s[rows] - grid.t_s[start]
    trials = tuple(
        replace(one, start=max(one.start, start) - start, stop=min(one.stop, stop) - start)
        for one in log.trials
        if one.start < stop and one.stop > start
    )
    measured, references, commands = (
        {name: values[rows] for name, values in group.items()} for group in _groups(log)
    )
    cut = replace(grid, cycle=cycle, t_s=t_s)
    return Gathered(cut, measured, references, commands, trials, log.says)


def joined(logs: Sequence[Gathered]) -> Gathered:
    """Several logs of one mapping as trials of one, one after the other."""
    grid = logs[0].grid
    cycles, stamps, trials, row, cycle = [], [], [], 0, 0
    for place, log in enumerate(logs, 1):
        cycles.append(log.grid.cycle + cycle)
        stamps.append(log.grid.t_s + cycle * grid.period_s)
        judged = sum(one.judged for one in log.trials) > 1
        trials += [
            Trial(
                f"log {place} {one.name}" if judged else f"log {place}",
                one.start + row,
                one.stop + row,
                one.judged,
            )
            for one in log.trials
        ]
        row += len(log.grid.cycle)
        cycle += int(log.grid.cycle[-1]) + 1
    whole = replace(grid, cycle=np.concatenate(cycles), t_s=np.concatenate(stamps))
    measured, references, commands = (
        {name: np.concatenate([_groups(log)[k][name] for log in logs]) for name in group}
        for k, group in enumerate(_groups(logs[0]))
    )
    return Gathered(whole, measured, references, commands, tuple(trials), logs[0].says)


def noisy(log: Gathered, name: str, seed: int) -> Gathered:
    """A log whose channel has its own noise once more: what neighbours differ by beyond a straight
    line, or that of its step where that is more.
    """
    values = log.measured[name]
    random = np.random.default_rng(seed)
    made = values + noise_of(values) * random.standard_normal(len(values))
    return replace(log, measured={**log.measured, name: made})


def noise_of(values: np.ndarray) -> float:
    """Rms noise of a channel's readings: robust, from second differences, at least that of its
    step.
    """
    known = values[np.isfinite(values)]
    bends = np.abs(np.diff(known, 2))
    white = 1.4826 * float(np.median(bends)) / np.sqrt(6.0)  # 1 + 4 + 1 variances
    steps = np.unique(np.abs(np.diff(known)))
    steps = steps[steps > 1e-9 * float(np.ptp(known))]
    step = float(steps[0]) if len(steps) else 0.0
    return float(max(white, step / np.sqrt(12.0)))


def in_other_units(log: Gathered, names: Sequence[str]) -> tuple[str, dict[str, str]]:
    """A CSV of these channels in other units, with the stamp ``t`` in ms and the column ``trial``;
    and each channel's unit as a mapping says it.
    """
    every = {name: values for group in _groups(log) for name, values in group.items()}
    columns, said = [log.grid.cycle * log.grid.period_s * 1e3], {}
    for name in names:
        si_unit = si_unit_of(name) or "1"
        other = OTHER_UNITS.get(si_unit, si_unit)
        said[name] = f"{other} abs" if si_unit == "Pa" else other
        columns.append(every[name] / unit(other)[0])
    trial = np.zeros(len(log.grid.cycle))
    for number, one in enumerate((one for one in log.trials if one.judged), 1):
        trial[one.start : one.stop] = number
    columns.append(trial)
    rows = [",".join(["t", *names, "trial"])]
    rows += [",".join(_text(value) for value in row) for row in zip(*columns, strict=True)]
    return "\n".join(rows) + "\n", said


def _text(value: float) -> str:
    return f"{value:.15g}" if np.isfinite(value) else ""


def _groups(log: Gathered) -> tuple[dict[str, np.ndarray], ...]:
    return log.measured, log.references, log.commands
