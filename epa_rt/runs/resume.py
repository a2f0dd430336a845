"""Where a broken-off run goes on: which repetitions its log holds whole, and the experiment of
those that are left.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from epa_rt.config.source import ConfigError, Located, parse_yaml
from epa_rt.experiments.experiment import Experiment, Phase, experiment_from
from epa_rt.logs.reader import LogReader

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig

ATTACHMENT = "resume.json"
_KEY = "first_repetition"
_FILES = ("experiment.yaml", "rig.yaml", "plant.yaml")
_SPENT = ("applied_zero", _KEY)  # what a run itself writes into the files that its log carries
_HASHED_AT_ONCE = 1 << 20  # bytes


class ResumeError(ValueError):
    """Why a run cannot go on from a log, in one sentence."""


@dataclass(frozen=True)
class Resumed:
    """``experiment`` begins with ``first_repetition``; None where nothing is left to run.

    ``note``: what the new log carries under ATTACHMENT. ``says``: a sentence for the operator.
    """

    experiment: Experiment | None
    first_repetition: int
    note: bytes
    says: str


@dataclass(frozen=True)
class EarlierLog:
    """A log that another goes on from: its name, its digest, and the trials that count of it."""

    name: str
    sha256: str
    trials: tuple[str, ...]


def resumed(
    log: Path, files: Mapping[str, bytes], experiment: Experiment, rig: "Rig", backend: str
) -> Resumed:
    """The run of ``experiment`` from the first repetition that ``log`` lacks.

    ``backend``: 'sim', 'ethercat', or 'emulated' for an emulated bus. ``files``: experiment, rig
    and plant as the new run would carry them. Raises ResumeError where the log is of other files,
    ConfigError, LogError, OSError.
    """
    located = parse_yaml(files[_FILES[0]].decode("utf-8"), experiment.path)
    _check_repeats(experiment, log)
    with LogReader(log) as reader:
        attached, facts = dict(reader.attachments), reader.metadata.get("run", {})
        _check_files(log, attached, files)
        then = "emulated" if facts.get("bus") == "emulated" else facts.get("backend", backend)
        if then != backend:
            raise ResumeError(
                f"{log}: found a log of the backend '{then}', expected '{backend}':"
                " one data set comes from one rig"
            )
        whole = _whole_phases(reader)
    earlier = _earlier(attached.get(ATTACHMENT), log)
    before = {name for one in earlier for name in one.trials}
    everything = _with_first(located, int(located.data.get(_KEY, 0)), rig)
    first = next(
        (r for r, phases in _by_repetition(everything) if not _is_done(phases, whole | before)),
        None,
    )
    trials = [phase.name for phase in everything.trials]
    here = tuple(
        n for n in trials if n in whole and n not in before and _counts(n, everything, first)
    )
    chain = (*earlier, EarlierLog(log.name, file_sha256(log), here))
    done = sum(len(one.trials) for one in chain)
    note = {
        _KEY: first,
        "logs": [vars(one) | {"trials": list(one.trials)} for one in chain],
        "sha256": {n: meaning_sha256(files[n], n) for n in _FILES if n in files},
    }
    text = json.dumps(note, sort_keys=True, indent=1).encode()
    if first is None:
        return Resumed(None, len(trials), text, f"all {len(trials)} trials are whole in {log}")
    return Resumed(
        _with_first(located, first, rig),
        first,
        text,
        f"{done} of {len(trials)} trials are whole in {' and '.join(one.name for one in chain)};"
        f" goes on with repetition {first + 1}",
    )


def earlier_logs(note: bytes) -> tuple[EarlierLog, ...]:
    """The logs that the one with this attachment goes on from. Raises ValueError where the
    attachment is not what resumed() wrote.
    """
    try:
        found = json.loads(note)["logs"]
        return tuple(
            EarlierLog(str(one["name"]), str(one["sha256"]), tuple(map(str, one["trials"])))
            for one in found
        )
    except (ValueError, KeyError, TypeError, RecursionError):
        raise ValueError(f"found a damaged {ATTACHMENT}, expected one that epa wrote") from None


def file_sha256(path: Path) -> str:
    """Digest of a whole file. Raises OSError."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while part := file.read(_HASHED_AT_ONCE):
            digest.update(part)
    return digest.hexdigest()


def meaning_sha256(text: bytes, name: str) -> str:
    """Digest of what a YAML file says: comments, and what a run adds itself, do not count. Raises
    ConfigError.
    """
    data = parse_yaml(text.decode("utf-8", "replace"), name).data
    said = {key: value for key, value in data.items() if key not in _SPENT}
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()


def _check_repeats(experiment: Experiment, log: Path) -> None:
    if all(phase.repetition is None for phase in experiment.phases):
        raise ResumeError(
            f"{experiment.path}: found an experiment that does not repeat, expected 'repeat' or"
            f" 'times' to go on from {log.name}: run it again"
        )
    outside = next((p for p in experiment.trials if p.repetition is None), None)
    if outside is not None:
        raise ResumeError(
            f"{experiment.path}: found the trial '{outside.name}' outside of 'phases', expected"
            " all trials in what repeats, for before and after run again"
        )


def _check_files(log: Path, attached: Mapping[str, bytes], files: Mapping[str, bytes]) -> None:
    for name in _FILES:
        if name not in files:
            continue
        kind = name.removesuffix(".yaml")
        if name not in attached:
            raise ResumeError(
                f"{log}: found no attachment {name}, expected a log of this {kind}, which carries"
                " it"
            )
        then = meaning_sha256(attached[name], f"{log}[{name}]")
        now = meaning_sha256(files[name], name)
        if then != now:
            raise ResumeError(
                f"{log}: found another {kind} file in the log ({then[:12]}), expected the one that"
                f" is to go on ({now[:12]}): their trials are not one data set"
            )


def _whole_phases(reader: LogReader) -> set[str]:
    """Names of the phases that ended as planned, with every cycle from start to end in the log."""
    ordered = np.unique(reader.columns("/cycle", ["cycle"])["cycle"])
    begun: dict[str, int] = {}
    whole = set()
    for event in reader.events():
        name, cycle = event.data.get("phase"), event.data.get("cycle")
        if not isinstance(name, str) or not isinstance(cycle, int):
            continue
        if event.kind == "phase_start":
            begun[name] = cycle
        elif event.kind == "phase_end" and name in begun:
            low, high = np.searchsorted(ordered, (begun[name], cycle))
            if high - low == cycle - begun[name]:
                whole.add(name)
    return whole


def _by_repetition(experiment: Experiment) -> list[tuple[int, list[Phase]]]:
    found: dict[int, list[Phase]] = {}
    for phase in experiment.phases:
        if phase.repetition is not None:
            found.setdefault(phase.repetition, []).append(phase)
    return sorted(found.items())


def _is_done(phases: Sequence[Phase], whole: set[str]) -> bool:
    """Whether all trials of a repetition are whole; all its phases, where it has no trial."""
    judged = [phase for phase in phases if phase.trial_index is not None] or phases
    return all(phase.name in whole for phase in judged)


def _counts(name: str, experiment: Experiment, first: int | None) -> bool:
    """Whether a whole trial is kept: those of a repetition that runs again are not."""
    repetition = next(p.repetition for p in experiment.phases if p.name == name)
    return first is None or (repetition is not None and repetition < first)


def _earlier(note: bytes | None, log: Path) -> tuple[EarlierLog, ...]:
    if note is None:
        return ()
    try:
        return earlier_logs(note)
    except ValueError as error:
        raise ResumeError(f"{log}: {error}") from None


def _with_first(located: Located, first: int, rig: "Rig") -> Experiment:
    """The experiment from one repetition on; its text says so."""
    import yaml

    data: dict[str, Any] = {k: v for k, v in located.data.items() if k != _KEY}
    line = f"{_KEY}: {first}\n" if first else ""
    if _KEY in located.data or located.text.lstrip().startswith("{"):
        text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True) + line
    else:
        text = f"{located.text.rstrip()}\n{line}"
    try:
        return experiment_from(parse_yaml(text, located.path), rig)
    except ConfigError as error:
        raise ResumeError(str(error)) from None
