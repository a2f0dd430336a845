"""Diagnose the gap between logs of a rig and its plant file: where it lies, which effect causes it,
how far it shrinks.

What is wrong with the logs is said first. With --holdout the shrinkage is measured on those logs,
else on trials that are set aside. The gate runs the patched plant file on the same experiment in
the simulated rig and measures the gap again.

  epa gap diagnose --rig config/rigs/bench.yaml out/a.mcap out/b.mcap --holdout out/c.mcap \\
      --json gap.json --html gap.html
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, STOPPED, VerbError
from epa_rt.cli.gap.baseline import check_rig, since, with_changes
from epa_rt.cli.gap.fits import check_judged, check_spares
from epa_rt.cli.gap.inputs import (
    Opened,
    add_log_arguments,
    add_rig_arguments,
    catalogue_command,
    opened,
    task_parser,
)
from epa_rt.cli.gap.plan import planned
from epa_rt.cli.inputs import EXPERIMENT
from epa_rt.cli.outputs import add_html_argument, add_json_argument, add_old_spelling
from epa_rt.cli.progress import progress_shown
from epa_rt.cli.write import check_own, check_writable, write_whole
from epa_rt.config.near_names import most_like

if TYPE_CHECKING:
    from collections.abc import Callable

    from epa_rt.gap.diagnosis import Diagnosis
    from epa_rt.gap.held_out.gate import Gate
    from epa_rt.gap.posterior.search import Table
    from epa_rt.gap.recording import Recording

Progress = "Callable[[str, float], None]"


def add_parser(tasks: "argparse._SubParsersAction") -> None:
    parser = task_parser(tasks, "diagnose", __doc__)
    add_rig_arguments(parser)
    add_log_arguments(parser)
    parser.add_argument(
        "--holdout",
        nargs="+",
        type=Path,
        default=(),
        metavar="LOG",
        help="logs on which the shrinkage is measured",
    )
    parser.add_argument(
        "--leave-out",
        nargs="+",
        default=(),
        metavar="EFFECT",
        help="effects to leave out of the catalogue",
    )
    parser.add_argument(
        "--baseline",
        nargs="+",
        type=Path,
        default=(),
        metavar="LOG",
        help="healthy runs of the same rig and experiment: what changed since (rigs of others)",
    )
    parser.add_argument(
        "-o",
        "--out",
        dest="patch",
        type=Path,
        metavar="PLANT.yaml",
        help="write the patched plant file",
    )
    add_old_spelling(parser, "--patch", now="-o", dest="patch")
    add_html_argument(parser)
    add_json_argument(parser)
    parser.add_argument(
        "--picture",
        type=Path,
        metavar="PICTURE.svg",
        help="write the gap before and after as one picture",
    )
    parser.add_argument("--no-gate", action="store_true", help="do not run the patched plant again")
    parser.add_argument(
        "--no-plan",
        action="store_true",
        help="do not look for the next experiment where effects cannot be told apart",
    )


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.config.source import ConfigError
    from epa_rt.gap.answer.patch import PATCHED_BY
    from epa_rt.gap.report.terminal import console, show, show_found
    from epa_rt.gap.rig.subjects import named_plant

    check_writable(arguments.json, (".json",))
    check_writable(arguments.html, (".html", ".htm"))
    check_writable(arguments.patch, (".yaml", ".yml"))
    check_writable(arguments.picture, (".svg",))
    check_rig(arguments.rig, arguments.baseline)
    given, out = opened(arguments, arguments.holdout), console()
    if arguments.baseline:
        given = since(given, arguments.rig, arguments.plant, arguments.baseline)
    check_spares(arguments.patch, (arguments.rig, given.plant, named_plant(arguments.rig)))
    check_own(arguments.patch, PATCHED_BY)
    _known(arguments.leave_out, given)
    show_found(given.found, out)
    with progress_shown(arguments.quiet) as progress:
        diagnosis = _diagnosed(given, arguments.rig, arguments.leave_out, progress)
    if arguments.baseline:
        given, diagnosis = with_changes(given, diagnosis, arguments.baseline)
    gate, code = None, COMPLETED
    try:
        write_answer(diagnosis, arguments)
        if arguments.patch and diagnosis.effects:
            write_whole(arguments.patch, _patched(given, diagnosis))
        with progress_shown(arguments.quiet) as progress:
            if not arguments.no_plan:
                diagnosis = replace(diagnosis, next_experiment=planned(given, diagnosis, progress))
                write_answer(diagnosis, arguments)
            if not arguments.no_gate:
                gate = _confirmed(given, diagnosis, arguments.patch, progress)
            diagnosis = replace(diagnosis, gate=gate and gate.report)
    except KeyboardInterrupt:
        print("epa gap diagnose: interrupted; what was found until then stands", file=sys.stderr)
        code = STOPPED
    except (VerbError, ConfigError):
        show(
            replace(diagnosis, found_first=()), out
        )  # what comes after the diagnosis must not take it away
        raise
    show(replace(diagnosis, found_first=()), out)  # before what may fail at a full disk
    write_answer(diagnosis, arguments)
    written = (
        arguments.json,
        arguments.html,
        arguments.patch if diagnosis.effects else None,
        _write_pictures(given, diagnosis, gate, arguments),
    )
    for path in (arguments.json, arguments.html, arguments.patch, arguments.picture):
        if path is not None:
            why = (
                "no effect is named"
                if not diagnosis.effects
                else "this rig has no model of the whole that could be drawn"
            )
            older = "; the file of that name is older" if path.exists() else ""
            out.print(str(path) if path in written else f"{path}: not written, {why}{older}")
    return code


def diagnose_logs(
    rig: Path,
    plant: Path | None,
    logs: Sequence[Path],
    holdout: Sequence[Path] = (),
    leave_out: Sequence[str] = (),
    progress: Progress = lambda stage, share: None,
    baseline: Sequence[Path] = (),
) -> "tuple[Opened, Diagnosis]":
    """What was read of the logs, checked and cleaned, and the diagnosis of it: the one path of
    command line, Python and benchmark. ``baseline``: healthy runs. Nothing is shown or written.
    Raises VerbError, ConfigError.
    """
    check_rig(rig, baseline)
    given = opened(argparse.Namespace(rig=rig, plant=plant, logs=list(logs)), holdout)
    if baseline:
        given = since(given, rig, plant, baseline)
    _known(tuple(leave_out), given)
    found = _diagnosed(given, rig, leave_out, progress)
    return with_changes(given, found, baseline) if baseline else (given, found)


def table_of_logs(
    rig: Path,
    plant: Path | None,
    logs: Sequence[Path],
    holdout: Sequence[Path] = (),
    leave_out: Sequence[str] = (),
) -> "Table":
    """All models of the logs with what each leaves, as calibration wants them: read and checked as
    for a diagnosis. Raises VerbError, ConfigError.
    """
    from epa_rt.gap.held_out.aside import unseen
    from epa_rt.gap.posterior.calibrated import CALIBRATED
    from epa_rt.gap.posterior.searched import searched

    given = opened(argparse.Namespace(rig=rig, plant=plant, logs=list(logs)), holdout)
    known = {name for one in given.subject.catalogue for name in (one.name, one.family)}
    fitted, seen, judged, logs_apart = unseen(given.subject, given.recordings, given.holdout)
    without = tuple(n for n in leave_out if n in known)
    return searched(fitted, seen, logs_apart, judged, CALIBRATED, without)[1]


def answered(
    rig: Path,
    plant: Path | None,
    logs: Sequence[Path],
    holdout: Sequence[Path],
    leave_out: Sequence[str],
    gate: bool,
    progress: Progress,
    baseline: Sequence[Path] = (),
) -> "tuple[Opened, Diagnosis]":
    """As ``diagnose_logs``, with the gate's report where that is asked for."""
    given, diagnosis = diagnose_logs(rig, plant, logs, holdout, leave_out, progress, baseline)
    found = _confirmed(given, diagnosis, None, progress) if gate else None
    return given, replace(diagnosis, gate=found and found.report)


def page_of(given: Opened, diagnosis: "Diagnosis") -> str:
    """The page of a diagnosis."""
    from epa_rt.gap.report.page import gap_page
    from epa_rt.gap.report.traces import traces

    return gap_page(diagnosis, _curves(given, diagnosis, traces) if diagnosis.effects else ())


def _known(names: Sequence[str], given: Opened) -> None:
    known = [effect.name for effect in given.subject.catalogue]
    for name in names:
        if name not in known:
            near = most_like(name, known) or known
            raise VerbError(
                f"--leave-out: found '{name}', expected an effect of this rig's catalogue"
                f" ({', '.join(near)}; all: {catalogue_command(given.subject, given.rig)})"
            )


def _diagnosed(
    given: Opened, rig: Path, leave_out: Sequence[str], progress: Progress
) -> "Diagnosis":
    from epa_rt.gap.answer.patch import PLANT_DIGEST, digest_of
    from epa_rt.gap.diagnose import diagnose
    from epa_rt.gap.held_out.aside import split

    found = diagnose(
        given.subject, given.recordings, given.holdout, without=leave_out, progress=progress
    )
    check_judged(found.location, given.subject)
    set_aside = bool(given.holdout) or split(given.subject, given.recordings) is not None
    inputs = {
        "rig": str(rig),
        "plant": str(given.plant or ""),
        PLANT_DIGEST: digest_of(given.subject),
        "logs": [str(r.path) for r in given.recordings],
        "holdout": [str(r.path) for r in given.holdout],
        "left_out": list(leave_out),
        "set_aside": set_aside,
    }
    named = {effect.name for effect in found.effects}
    return replace(
        found,
        found_first=given.found,
        inputs=found.inputs | inputs,
        not_tested=tuple(name for name in found.not_tested if name not in named),
    )


def _confirmed(
    given: Opened, diagnosis: "Diagnosis", patch: Path | None, progress: Progress
) -> "Gate | None":
    """The gate, where effects are named and the rig can be simulated on the log's own
    experiment.
    """
    if not diagnosis.effects:
        return None
    if given.rig is not None and EXPERIMENT in _shortest(given).attachments:
        return gated(given, diagnosis, patch, progress)
    return None


def _patched(given: Opened, diagnosis: "Diagnosis") -> str:
    from epa_rt.gap.answer.patch import patched_text

    return patched_text(diagnosis, given.subject)


def gated(given: Opened, diagnosis: "Diagnosis", patch: Path | None, progress: Progress) -> "Gate":
    """Runs the patched plant file ``patch``, a passing one where it has not been written. Raises
    VerbError, ConfigError where the log's own files are broken.
    """
    from epa_rt.cli.gap.simulate import Simulator
    from epa_rt.gap.held_out.gate import GateError, gate

    real = _shortest(given)
    with (
        tempfile.TemporaryDirectory(prefix="epa-gap-") as folder,
        Simulator(Path(folder)) as simulator,
    ):
        path = patch or Path(folder) / f"{given.plant.stem}_patched.yaml"
        if patch is None:
            write_whole(path, _patched(given, diagnosis))
        try:
            found = gate(
                given.subject,
                real,
                given.plant,
                path,
                simulator.again,
                diagnosis.shrinkage,
                progress,
                _aside(given, real),
            )
        except GateError as error:
            raise VerbError(str(error)) from None
    return found._replace(report=found.report | {"plant_file": str(patch) if patch else None})


def write_answer(diagnosis: "Diagnosis", arguments: argparse.Namespace) -> None:
    """The JSON as far as it is known, so that an interruption later loses nothing; without --json
    nothing. Raises VerbError where it cannot be written.
    """
    from epa_rt.gap.report.as_json import json_text

    if arguments.json:
        write_whole(arguments.json, json_text(diagnosis))


def _write_pictures(
    given: Opened, diagnosis: "Diagnosis", gate: "Gate | None", arguments: argparse.Namespace
) -> Path | None:
    """The page and the picture; the latter's path where there was anything to draw."""
    from epa_rt.gap.report.page import gap_page
    from epa_rt.gap.report.picture import gap_picture
    from epa_rt.gap.report.traces import alongside_trace, traces

    if not (arguments.html or arguments.picture):
        return None
    curves = _curves(given, diagnosis, traces) if diagnosis.effects else ()
    if arguments.html:
        write_whole(arguments.html, gap_page(diagnosis, curves))
    if arguments.picture:
        trace = (
            alongside_trace(
                given.subject, gate.real, gate.before, gate.after, gate.twin, _worst(diagnosis)
            )
            if gate
            else next((one for one in curves if not one.is_error), None)
        )
        if trace is not None:
            write_whole(arguments.picture, gap_picture(diagnosis, trace))
            return arguments.picture
    return None


def _curves(given: Opened, diagnosis: "Diagnosis", traces: "Callable") -> tuple:
    from epa_rt.gap.likelihood.floor import floors

    recordings = [_shortest(given)]
    return traces(
        given.subject,
        recordings,
        diagnosis.refitted,
        diagnosis.fitted,
        floors(given.subject, recordings, diagnosis.fitted),
        channel=_worst(diagnosis),
    )


def _shortest(given: Opened) -> "Recording":
    """Of the logs to be judged the one that is run again and drawn: without a hold-out one of those
    whose last trial was set aside, the last log where none has several.
    """
    from epa_rt.gap.likelihood.alongside import trials

    judged = (
        given.holdout
        or [one for one in given.recordings if len(trials(one)) > 1]
        or given.recordings[-1:]
    )
    return min(judged, key=lambda one: one.samples)


def _aside(given: Opened, real: "Recording") -> "Recording | None":
    """A log with those trials alone that were set aside; None where it was given with --holdout or
    nothing could be set aside: then all of it is judged.
    """
    from epa_rt.gap.held_out.aside import split

    halves = None if given.holdout else split(given.subject, given.recordings)
    return (
        next((one for one in halves[1].only(given.recordings) if one.name == real.name), None)
        if halves
        else None
    )


def _worst(diagnosis: "Diagnosis") -> str | None:
    """The channel with the largest gap."""
    return diagnosis.location[0].channel if diagnosis.location else None
