"""``--baseline``: healthy runs of the same rig, and what changed since."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.inputs import Opened, opened

if TYPE_CHECKING:
    from epa_rt.gap.diagnosis import Change, Diagnosis
    from epa_rt.gap.recording import Recording
    from epa_rt.gap.rig.foreign.healthy import Healthy

FAR = 4.0  # spreads from which a change is said to be one: of healthy runs one in a thousand
Stamped = tuple[Path, int, int]
BASELINE = "baseline"  # among the inputs of a diagnosis


def check_rig(rig: Path, baseline: Sequence[Path]) -> None:
    """Raises VerbError where healthy runs are given of a rig of this house; ConfigError."""
    from epa_rt.gap.rig.foreign import is_foreign

    if baseline and not is_foreign(rig):
        raise VerbError(
            f"--baseline: found {rig}, a rig of this house, expected a rig of others"
            " (docs/foreign-rigs.md): of this house's the spread from run to run is not estimated"
        )


def since(given: Opened, rig: Path, plant: Path | None, baseline: Sequence[Path]) -> Opened:
    """The same logs, held against healthy runs. Raises VerbError where these are none of the rig
    and experiment, or too few; ConfigError.
    """
    from epa_rt.gap.held_out.aside import split
    from epa_rt.gap.rig.foreign.healthy import NotHealthy
    from epa_rt.gap.rig.foreign.since import SinceBaseline
    from epa_rt.gap.rig.subjects import named_plant

    _apart(baseline, (*given.recordings, *given.holdout))
    try:
        files = _stamped(rig), _stamped(plant or named_plant(rig) or rig)
        healthy, noted = _learnt(rig, plant, files, tuple(map(_stamped, baseline)))
        healthy.check((*given.recordings, *given.holdout))
    except NotHealthy as error:
        raise VerbError(f"--baseline: {error}") from None
    halves = None if given.holdout else split(SinceBaseline(healthy), given.recordings)
    fitted = halves[0].only(given.recordings) if halves else given.recordings
    names = [one.name for one in fitted]  # of a log that is set aside no fit sees the level
    found = given.found
    if far := lacking(healthy):
        found = (*found, far)
    noted = tuple(one for one in noted if one not in found)  # what is said of the plant file
    if noted:
        found = (*found, f"of the baseline's logs {len(noted)} notes, the first: {noted[0]}")
    return replace(given, subject=SinceBaseline(healthy, names), found=found)


def lacking(healthy: "Healthy") -> str:
    """That the plant lacks something of the healthy runs, so that its numbers mean nothing beside
    what they share; '' where not.
    """
    import numpy as np

    from epa_rt.config.units import with_unit
    from epa_rt.gap.rig.foreign.healthy import beyond

    far = [q for link in healthy.links for q in healthy.impossible(link)]
    if not far:
        return ""
    worst = [q.values[np.argmax(beyond(healthy.subject.knobs[q.key], q.values))] for q in far]
    words = [
        f"{q.key} of {with_unit(f'{value:.3g}', q.unit)}"
        for q, value in zip(far, worst, strict=True)
    ]
    return (
        f"the healthy runs would have {' and '.join(words)}, which cannot be: the plant file lacks"
        " something that they have, and a name may be wrong; diagnose one of them without"
        " --baseline first"
    )


def _stamped(file: Path) -> Stamped:
    """A file with its time and size: what tells whether it was read before."""
    try:
        stat = file.stat()
    except OSError as error:
        raise VerbError(f"{file}: cannot be read ({error.strerror})") from None
    return file, stat.st_mtime_ns, stat.st_size


@lru_cache(maxsize=4)  # day after day is held against one baseline
def _learnt(
    rig: Path, plant: Path | None, files: tuple[Stamped, ...], stamped: tuple[Stamped, ...]
) -> "tuple[Healthy, tuple[str, ...]]":
    """What healthy runs say, and what was noted of their logs. ``files``: of rig and plant, as they
    are now.
    """
    from epa_rt.gap.rig.foreign.healthy import healthy_from

    logs = [log for log, *_ in stamped]
    runs = opened(argparse.Namespace(rig=rig, plant=plant, logs=logs))
    return healthy_from(runs.subject, runs.recordings), runs.found


def _apart(baseline: Sequence[Path], logs: "Sequence[Recording]") -> None:
    """Raises VerbError where a log to be judged is one of the healthy runs, by name or content."""
    from epa_rt.runs.resume import file_sha256

    there = [path for path in baseline if path.is_file()]
    for path in (Path(one.path) for one in logs):
        size = path.stat().st_size
        like = [one for one in there if one.stat().st_size == size]
        if file_sha256(path) in map(file_sha256, like):
            raise VerbError(
                f"--baseline: found {path} among the healthy runs and among the logs, expected it"
                " once"
            )


def with_changes(
    given: Opened, diagnosis: "Diagnosis", baseline: Sequence[Path]
) -> "tuple[Opened, Diagnosis]":
    """The diagnosis with what moved since the baseline, without the levels of single runs, which no
    plant file has; and the rig as it is drawn and judged from here on.
    """
    from epa_rt.gap.rig.foreign.since import SinceBaseline
    from epa_rt.gap.subject import OF_RUN

    subject = given.subject
    assert isinstance(subject, SinceBaseline)
    diagnosis = as_a_set(diagnosis, subject.not_told_apart())
    changes = subject.changes(given.recordings)
    moved = said_of(changes, len(subject.healthy.runs), bool(diagnosis.effects))
    kept = {
        name: {key: value for key, value in values.items() if not key.startswith(OF_RUN)}
        for name, values in (("refitted", diagnosis.refitted), ("fitted", diagnosis.fitted))
    }
    return replace(given, subject=subject.of_any_run()), replace(
        diagnosis,
        changes=changes,
        says=f"{diagnosis.says} {moved}",
        inputs=diagnosis.inputs | {BASELINE: [str(path) for path in baseline]},
        **kept,
    )


def as_a_set(diagnosis: "Diagnosis", alike: Sequence[str]) -> "Diagnosis":
    """The diagnosis in which an effect of ``alike`` stands for all of them: the motion cannot tell
    them from each other, whichever fits best.
    """
    sets = {
        one.name: tuple(dict.fromkeys((*one.not_separable_from, *alike)))
        for one in diagnosis.effects
        if one.name in alike and len(alike) > 1
    }
    if not sets:
        return diagnosis
    effects = tuple(
        replace(
            one,
            not_separable_from=tuple(
                name for name in sets.get(one.name, one.not_separable_from) if name != one.name
            ),
        )
        for one in diagnosis.effects
    )
    named = ("explained", "partly_explained")
    return replace(
        diagnosis,
        verdict="not_separable" if diagnosis.verdict in named else diagnosis.verdict,
        says=f"{diagnosis.says} This motion cannot tell {' from '.join(alike)}.",
        effects=effects,
    )


def said_of(changes: "Sequence[Change]", runs: int, named: bool) -> str:
    """The sentence on what moved since the baseline of so many runs. ``named``: whether an effect
    is named already.
    """
    far = [one for one in changes if abs(one.spreads) >= FAR]
    if far:
        return f"Since the baseline of {runs} runs moved: {', '.join(map(change_words, far[:3]))}."
    start = "furthest went" if named else f"nothing moved by {FAR:g} spreads; furthest went"
    return f"Since the baseline of {runs} runs {start} {change_words(changes[0])}."


def change_words(one: "Change") -> str:
    """One number's change with its unit and its size in spreads."""
    from epa_rt.config.units import with_unit

    size = f"({one.spreads:+.1f} spreads)"
    if one.before == 0.0:
        return f"{one.name} by {with_unit(f'{one.now:.3g}', one.unit)} rms {size}"
    return f"{one.name} from {one.before:.4g} to {with_unit(f'{one.now:.4g}', one.unit)} {size}"
