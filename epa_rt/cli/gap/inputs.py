"""What the tasks of ``epa gap`` read: a rig, a plant, logs, and what is wrong with the logs."""

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import EPILOGUE, VerbError
from epa_rt.cli.parser import summary

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.gap.finding import Finding
    from epa_rt.gap.recording import Recording
    from epa_rt.gap.subject import Subject


@dataclasses.dataclass(frozen=True)
class Opened:
    """``rig`` is None for a rig that is not ours. ``found``: what is wrong with the logs, a
    sentence each.
    """

    subject: "Subject"
    rig: "Rig | None"
    plant: Path | None
    recordings: "tuple[Recording, ...]"
    holdout: "tuple[Recording, ...]"
    found: tuple[str, ...]


def task_parser(
    tasks: "argparse._SubParsersAction", name: str, doc: str
) -> argparse.ArgumentParser:
    """A parser of one task, described by its module."""
    return tasks.add_parser(
        name,
        help=summary(doc),
        description=doc,
        epilog=EPILOGUE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def add_rig_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--rig", type=Path, required=True, help="rig file (config/rigs/*.yaml)")
    parser.add_argument(
        "--plant", type=Path, help="plant file as it is believed (default: the one the rig names)"
    )


def add_log_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "logs", nargs="+", type=Path, metavar="LOG", help="logs of the rig (*.mcap)"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress")


def catalogue_command(subject: "Subject", rig: "Rig | None") -> str:
    """What lists the effects that this rig can have."""
    return (
        "epa gap catalogue"
        if rig is not None
        else f"epa gap catalogue --kind {subject.rig.component.kind}"
    )


def open_rig(rig: Path, plant: Path | None) -> "tuple[Subject, Rig | None, Path | None]":
    """The subject, the typed rig (None for a rig that is not ours) and the plant file's path.
    Raises ConfigError.
    """
    from epa_rt.cli.inputs import load_plant_of
    from epa_rt.config.rig import load_rig
    from epa_rt.gap.rig.foreign import is_foreign, open_foreign
    from epa_rt.gap.rig.house import HouseSubject

    if is_foreign(rig):
        subject = open_foreign(rig, plant)
        return subject, None, plant or subject.rig.plant
    typed = load_rig(rig)
    _, read_plant = load_plant_of(rig, typed, plant)
    return HouseSubject(typed, read_plant), typed, plant or rig.parent / typed.plant


def opened(arguments: argparse.Namespace, holdout: Sequence[Path] = ()) -> Opened:
    """Rig and logs, the logs checked and cleaned. Raises VerbError, ConfigError where a diagnosis
    of them would mean nothing.
    """
    from epa_rt.cli.gap.fits import check_columns, check_trials
    from epa_rt.gap.hygiene.check import check, clean
    from epa_rt.gap.rig.foreign.dead import check_dead
    from epa_rt.gap.rig.foreign.noisy_place import narrowed
    from epa_rt.gap.rig.foreign.pasted import as_runs
    from epa_rt.gap.rig.foreign.rests import check_rests
    from epa_rt.gap.rig.foreign.signs import check_signs
    from epa_rt.gap.rig.foreign.sizes import check_sizes
    from epa_rt.gap.rig.foreign.swaps import check_swaps
    from epa_rt.gap.rig.house.counter import as_counted
    from epa_rt.gap.rig.house.early import check_early

    subject, rig, plant = open_rig(arguments.rig, arguments.plant)
    fitted, held = read(arguments.logs, rig), read(holdout, rig)
    _unique(fitted + held)
    if rig is None:
        check_columns(subject, arguments.rig, fitted + held)
        check_trials(fitted + held)
        fitted, held = as_runs(fitted, subject), as_runs(held, subject)
    recordings, n = fitted + held, len(fitted)
    if rig is None:
        dead = check_dead(fitted, subject.rig, bool(subject.plant.effects))
        dead += check_dead(held, subject.rig, True)  # the fitted logs say the scale
        of_file = (subject.rig.steps_by_column, subject.rig.asked_by_column)
        found = _without(check(recordings, None, *of_file), dead)
        findings = _of_used((*found, *check_sizes(recordings, subject.rig), *dead), subject)
    else:
        findings = check(recordings, rig)
    _refused(findings)
    cleaned = clean(recordings, findings)
    if rig is None:
        _refused(check_swaps(cleaned, subject))
        findings = (*findings, *check_signs(cleaned, subject), *check_rests(cleaned, subject))
        subject, loud = narrowed(subject, cleaned)
        findings = (*findings, *loud, *_of_plant_file(subject))
    else:
        _refused(check_early(cleaned, subject))
        subject, counted = as_counted(subject, cleaned[:n])
        findings = (*findings, *counted, *_without_experiment(cleaned))
        cleaned = tuple(_with_rig(one, arguments.rig) for one in cleaned)
    return Opened(
        subject,
        rig,
        plant,
        cleaned[:n],
        cleaned[n:],
        tuple(dict.fromkeys(finding.says for finding in findings)),
    )


def _without(findings: "Sequence[Finding]", said: "Sequence[Finding]") -> "list[Finding]":
    """The findings but for those on channels of which ``said`` has more of the same kind."""
    known = {(one.log, one.channel, one.kind) for one in said}
    return [one for one in findings if (one.log, one.channel, one.kind) not in known]


def _of_used(findings: "Sequence[Finding]", subject: "Subject") -> "tuple[Finding, ...]":
    """What is wrong with a column that a rig of others does not use is a note."""
    used = set(subject.rig.channels.values())
    return tuple(
        (
            dataclasses.replace(one, severity="note")
            if one.severity == "refuse" and one.channel and one.channel not in used
            else one
        )
        for one in findings
    )


def _of_plant_file(subject: "Subject") -> "list[Finding]":
    """What of a plant file of a rig of others holds and may not be meant."""
    from epa_rt.gap.finding import Finding

    return [Finding("note", "plant file", "", "", says) for says in subject.plant.notes]


def _refused(findings: "Sequence[Finding]") -> None:
    """Raises VerbError where a diagnosis of the logs would mean nothing."""
    says = [finding.says for finding in findings if finding.severity == "refuse"]
    if says:
        raise VerbError("; ".join(says))


def _without_experiment(recordings: "Sequence[Recording]") -> "list[Finding]":
    """A note on logs that nobody can run again: imported ones do not say which experiment they are
    of.
    """
    from epa_rt.cli.inputs import EXPERIMENT
    from epa_rt.gap.finding import Finding

    names = [one.name for one in recordings if EXPERIMENT not in one.attachments]
    return (
        [
            Finding(
                "note",
                "experiment",
                names[0],
                "",
                f"{', '.join(names)}: found no {EXPERIMENT} in the log, expected it for the gate,"
                " which would run it again; there is none",
            )
        ]
        if names
        else []
    )


def _with_rig(recording: "Recording", rig: Path) -> "Recording":
    """Imported logs carry no rig file: the one that they are read with."""
    from epa_rt.cli.inputs import RIG

    return (
        recording
        if RIG in recording.attachments
        else dataclasses.replace(
            recording, attachments=recording.attachments | {RIG: rig.read_bytes()}
        )
    )


def read(logs: Sequence[Path], rig: "Rig | None") -> "tuple[Recording, ...]":
    """Logs as recordings. Raises VerbError."""
    from epa_rt.gap.likelihood.series import as_one_series
    from epa_rt.gap.rig.read import read_recording, read_recordings
    from epa_rt.logs.reader import LogError

    try:
        return as_one_series(
            tuple(map(read_recording, logs)) if rig is None else read_recordings(logs, rig)
        )
    except LogError as error:
        _refuse_files(logs)
        raise VerbError(str(error)) from None
    except OSError as error:
        raise VerbError(f"{error.filename}: cannot be read ({error.strerror})") from None


def _refuse_files(logs: Sequence[Path]) -> None:
    """Raises VerbError where a rig or plant file stands among the logs."""
    from epa_rt.config.kinds import WORDS, named

    for path in logs:
        words = named(path)
        option = next((key for key in ("rig", "plant") if words == WORDS[key]), None)
        if option is not None:
            raise VerbError(f"{path}: found {words} among the logs, expected --{option} {path}")


def _unique(recordings: "Sequence[Recording]") -> None:
    """Raises VerbError where two logs have one name, or one of several has the name that all of
    them together have in the answer.
    """
    from epa_rt.gap.held_out.shrink import ALL

    seen: dict[str, str] = {}
    for recording in recordings:
        if recording.name == ALL and len(recordings) > 1:
            raise VerbError(
                f"{recording.path}: found a log named '{ALL}' among others, expected another name:"
                f" '{ALL}' are all logs together in the answer"
            )
        if recording.name in seen:
            raise VerbError(
                f"found {recording.path} beside {seen[recording.name]}, expected every log once and"
                " under a name of its own"
            )
        seen[recording.name] = recording.path
