"""How right a drafted mapping is beside one that was written by hand."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from epa_rt.config.rig_rows import si_unit_of
from epa_rt.config.units import unit
from epa_rt.logs.importers.gather import gather
from epa_rt.logs.importers.guess.draft import Draft, guess
from epa_rt.logs.importers.line import line_of
from epa_rt.logs.importers.mapping import Mapping, TrialColumn, load_mapping

_PERIOD = 0.02  # relative; a hand rounds the period
_PERIOD_RESAMPLED = 0.10  # relative; there a hand chooses it
_LINE = 1e-6


@dataclass(frozen=True)
class Case:
    """A recording and the mapping by hand that is the truth."""

    name: str
    files: tuple[Path, ...]
    truth: Path


def score(case: Case, folder: Path) -> list[tuple[str, str]]:
    """(item, 'right' | 'unsure, right' | 'unsure, wrong' | 'wrong') of clock, trials, each signal
    of the truth, and whether the draft loads and imports.
    """
    draft = guess(case.files)
    path = folder / f"{case.name}.draft.yaml"
    path.write_text(draft.text)
    mapping, located = load_mapping(path)
    truth, _ = load_mapping(case.truth)
    found = [("format", _verdict(_imports(mapping, located, case), _doubts(draft, "format")))]
    found.append(("clock", _verdict(_clock(mapping, truth), _doubts(draft, "clock"))))
    found.append(("trials", _verdict(_trials(mapping, truth), _doubts(draft, "trials"))))
    rows = {
        _key(truth, *_place(mapping, row.name)): row
        for row in draft.rows
        if row.name in mapping.signals
    }
    for name in truth.signals:
        place = _key(truth, *_place(truth, name))
        row = rows.get(place)
        if row is None:
            found.append((name, "wrong"))
            continue
        same = _meaning(mapping, row.name) == _meaning(truth, name)
        found.append((name, _verdict(same, bool(row.unsure))))
    return found


def _verdict(is_right: bool, is_unsure: bool) -> str:
    return ("unsure, " if is_unsure else "") + ("right" if is_right else "wrong")


def _doubts(draft: Draft, what: str) -> bool:
    return any(doubt.startswith(f"{what}:") for doubt in draft.unsure)


def _imports(mapping: Mapping, located, case: Case) -> bool:
    return len(gather(mapping, located, case.files).grid.cycle) > 1


def _place(mapping: Mapping, name: str) -> tuple[str, str, str]:
    signal = mapping.signals[name]
    topic, column = signal.topic or "", str(signal.column)
    if not topic and column.startswith("/"):
        topic, _, column = column.partition(".")
    return signal.file or "", topic, column


def _key(truth: Mapping, file: str, topic: str, column: str) -> tuple[str, str, str]:
    files = {signal.file for signal in truth.signals.values() if signal.file}
    return next((one for one in files if one in file), ""), topic, column


def _meaning(mapping: Mapping, name: str) -> tuple[str, str, float, float]:
    signal = mapping.signals[name]
    part = (
        "measured"
        if name in mapping.measured
        else "commands"
        if name in mapping.commands
        else "references"
    )
    line = line_of(name, signal.unit, signal.scale, signal.offset, mapping.atmosphere)
    si = si_unit_of(name) or "1"
    return part, si, float(f"{line.slope:.6g}"), float(f"{line.intercept:.6g}")


def _clock(mapping: Mapping, truth: Mapping) -> bool:
    a, b = mapping.clock, truth.clock
    if a.column != b.column:
        return False
    period = [1.0 / one.rate if one.rate else one.period for one in (a, b)]
    near = _PERIOD_RESAMPLED if b.resample else _PERIOD
    units = not a.column or unit(a.unit)[0] == unit(b.unit)[0]
    return units and abs(period[0] / period[1] - 1.0) < near


def _trials(mapping: Mapping, truth: Mapping) -> bool:
    a, b = mapping.trials, truth.trials
    if isinstance(a, TrialColumn) or isinstance(b, TrialColumn):
        return isinstance(a, TrialColumn) and isinstance(b, TrialColumn) and a.column == b.column
    return len(a) == len(b)


def table(results: dict[str, list[tuple[str, str]]]) -> str:
    """A line for each file, and the sums."""
    lines, total = [], Counter()
    right = 0
    for name, found in results.items():
        count = Counter(verdict for _, verdict in found)
        total += count
        wrong = [item for item, verdict in found if verdict == "wrong"]
        right += not wrong
        lines.append(
            f"{name:<24} right {count['right']:>3}  unsure, right {count['unsure, right']:>3}"
            f"  unsure, wrong {count['unsure, wrong']:>3}  wrong {count['wrong']:>2}"
            f"  {', '.join(wrong)}"
        )
    lines.append(f"{right} of {len(results)} files without a wrong item; items: {dict(total)}")
    return "\n".join(lines)
