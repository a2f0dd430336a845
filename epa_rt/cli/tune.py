"""Tune a loop: its frequency response, its margins, and gains that track better within them.

From logs whose trials moved the loop, or from a short excitation that the verb runs itself (--rig
without logs): multisines on the loop's reference, within half of the rig's limits, set up as in
--experiment. A joint then follows that experiment's trial once, for its feedforward. It runs as
every run does, with its trips and stops, and leaves a log.

The proposal keeps the sensitivity peak Ms at 1.6 or less over the response's uncertainty, and never
tracks worse. Where only worse tracking keeps Ms, the present gains stay with a warning, and
--hold-margin proposes the others. Nothing is changed: --write gives a copy of the rig file.

  epa tune joint --rig config/rigs/knee.yaml -o out/tune --html out/tune/knee.html \\
      --experiment config/experiments/knee_chirp_short.yaml
  epa tune joint out/tune/*.mcap --experiment config/experiments/knee_chirp_short.yaml
  epa tune motor --rig config/rigs/bench.yaml \\
      --experiment config/experiments/identification_short.yaml -o out/tune --write out/bench.yaml
  epa tune motor --rig config/rigs/bench.yaml --fill muscle "460 kPa gauge" --at "13 mm" -o out/tune
"""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, DIFFERENT, VerbError
from epa_rt.cli.inputs import (
    add_backend_arguments,
    add_simulation_arguments,
    add_supply_argument,
    refuse_twice,
)
from epa_rt.cli.outputs import add_html_argument, add_json_argument
from epa_rt.cli.run_record import add_record_arguments
from epa_rt.cli.screen_text import filled

if TYPE_CHECKING:
    from epa_rt.cli.inputs import Inputs
    from epa_rt.config.rig import Rig
    from epa_rt.config.source import Located
    from epa_rt.gap.recording import Recording
    from epa_rt.tune.answer import Answer, Motion


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("loop", choices=("joint", "motor"), help="which loop")
    verb.add_argument("logs", nargs="*", type=Path, metavar="LOG", help="logs of a rig (*.mcap)")
    verb.add_argument(
        "--rig", type=Path, help="rig file (default, with logs: the one in the first log)"
    )
    verb.add_argument(
        "--plant",
        type=Path,
        help="plant file of the simulated rig (default: the one the rig names)",
    )
    verb.add_argument(
        "--experiment",
        type=Path,
        help="what the loop is to follow; an excitation is set up as its trial is",
    )
    verb.add_argument(
        "--fill",
        action="append",
        nargs=2,
        metavar=("MUSCLE", "PRESSURE"),
        help="pressure of a muscle while it is excited, where no experiment says it",
    )
    verb.add_argument("--at", metavar="PLACE", help="mean of the excitation: a place or a position")
    verb.add_argument(
        "--peak-to-peak", metavar="SIZE", help="of the excitation, at most: '2 deg', '1 mm'"
    )
    verb.add_argument(
        "--hold-margin",
        action="store_true",
        help="propose gains that keep Ms also where they track worse",
    )
    add_backend_arguments(verb)
    add_supply_argument(verb)
    verb.add_argument(
        "-o",
        "--out",
        type=Path,
        default=Path("out"),
        help="folder for the excitation's log (default: %(default)s)",
    )
    add_simulation_arguments(verb)
    verb.add_argument("--dry", action="store_true", help="show the excitation; nothing moves")
    add_html_argument(verb)
    add_json_argument(verb)
    verb.add_argument(
        "--pictures", type=Path, metavar="FOLDER", help="write the pictures as PNG (a browser)"
    )
    verb.add_argument(
        "--write", type=Path, metavar="RIG.yaml", help="write a copy of the rig file with the gains"
    )
    verb.add_argument("--quiet", action="store_true", help="no progress")
    add_record_arguments(verb)


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.tune.controller import TuneError

    _check(arguments)
    try:
        if arguments.logs:
            return _answer(arguments, arguments.logs)
        return _excite(arguments)
    except TuneError as error:
        raise VerbError(str(error)) from None


def _check(arguments: argparse.Namespace) -> None:
    from epa_rt.cli.write import check_writable

    for path, endings in (
        (arguments.json, (".json",)),
        (arguments.html, (".html", ".htm")),
        (arguments.write, (".yaml", ".yml")),
    ):
        check_writable(path, endings)
    if arguments.write is not None and arguments.write.exists():
        raise VerbError(f"{arguments.write}: found a file, expected a name that is free")
    if not arguments.logs and arguments.rig is None:
        raise VerbError("found neither a log nor --rig, expected one of them")
    if arguments.logs and (arguments.fill or arguments.at or arguments.dry):
        raise VerbError(
            "found --fill, --at or --dry beside logs, expected them with an excitation only"
        )
    refuse_twice(arguments.logs)


def _excite(arguments: argparse.Namespace) -> int:
    """Runs the excitation, then answers from its log; a run that did not complete ends here."""
    from dataclasses import replace

    from epa_rt.cli.run import closing_text, driven, exit_code
    from epa_rt.cli.run_record import record_attachment
    from epa_rt.config.source import load_yaml
    from epa_rt.tune.controller import loop_of
    from epa_rt.tune.excitation import Asked, excitation_text

    rig = _rig_file(arguments.rig)[1]
    loop = loop_of(rig, arguments.loop)
    base = None
    if arguments.experiment is not None:
        from epa_rt.config.experiment import ExperimentFile
        from epa_rt.config.source import validate

        located = load_yaml(arguments.experiment)
        validate(located, ExperimentFile)
        base = located.data
    asked = Asked(arguments.at, _height(arguments, loop.si_unit), dict(arguments.fill or ()))
    text = excitation_text(rig, loop, base, asked)
    inputs = _inputs(arguments, text)
    for sentence in inputs.unprotected:
        print(f"UNPROTECTED: {sentence}", file=sys.stderr)
    record = record_attachment(inputs.rig, arguments.rig, arguments.operator, arguments.note)
    inputs = replace(inputs, attachments=inputs.attachments | record)
    if arguments.dry:
        from epa_rt.cli.dry import show_dry_run

        return DIFFERENT if show_dry_run(inputs.experiment, rig, arguments.out) else COMPLETED
    summary, result = driven(
        arguments, inputs, arguments.out, arguments.rig, arguments.seed, arguments.speed
    )
    print(filled(closing_text(summary, result, inputs.rig)))
    code = exit_code(summary, result)
    if code != COMPLETED:  # how the rig was left must stand last
        return code
    return _answer(arguments, [Path(summary.path)])


def _height(arguments: argparse.Namespace, si_unit: str) -> float | None:
    from epa_rt.config.units import UnitError, parse_quantity

    if arguments.peak_to_peak is None:
        return None
    try:
        value = parse_quantity(arguments.peak_to_peak, si_unit)
    except UnitError as error:
        raise VerbError(f"--peak-to-peak: {error}") from None
    if not value > 0.0:
        raise VerbError(f"--peak-to-peak: found '{arguments.peak_to_peak}', expected above zero")
    return value


def _rig_file(path: Path) -> "tuple[Located, Rig]":
    from epa_rt.cli.zero import load_rig_source

    return load_rig_source(path, with_zero=False)


def _inputs(arguments: argparse.Namespace, text: str) -> "Inputs":
    """The files of the run with the excitation as its experiment."""
    import tempfile

    from epa_rt.cli.inputs import load_inputs
    from epa_rt.cli.zero import is_emulated
    from epa_rt.config.source import ConfigError

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"tune_{arguments.loop}.yaml"
        path.write_text(text, encoding="utf-8")
        try:
            return load_inputs(
                path,
                arguments.rig,
                arguments.plant,
                with_plant=arguments.backend == "sim" and not arguments.dry,
                with_zero=arguments.backend != "sim" and not arguments.dry,
                emulated=is_emulated(arguments),
            )
        except ConfigError as error:
            if error.path != path:
                raise
            raise VerbError(
                f"the excitation does not fit the rig: {error.where}: found {error.found},"
                f" expected {error.expected}"
            ) from None


def _answer(arguments: argparse.Namespace, logs: list[Path]) -> int:
    from epa_rt.cli.gap.inputs import read
    from epa_rt.cli.progress import progress_shown
    from epa_rt.cli.write import write_whole
    from epa_rt.tune.answer import tuned
    from epa_rt.tune.report.terminal import text_of

    with progress_shown(arguments.quiet) as progress:
        progress("reading", 0.0)
        rig_source = _rig_file(arguments.rig)[0] if arguments.rig is not None else None
        recordings = read(logs, None)
        rig = _rig_of(rig_source, recordings)
        motion = _motion(arguments.experiment, rig, arguments.loop)
        answer = tuned(recordings, rig, arguments.loop, motion, progress, arguments.hold_margin)
    print(text_of(answer))
    if arguments.json is not None:
        write_whole(arguments.json, _json_text(answer))
        print(arguments.json)
    if arguments.html is not None:
        from epa_rt.tune.report.page import tune_page

        write_whole(arguments.html, tune_page(answer))
        print(arguments.html)
    if arguments.pictures is not None:
        _write_pictures(arguments.pictures, answer)
    if arguments.write is not None:
        _write_rig(arguments, answer, rig_source, recordings)
    return COMPLETED if answer.proposal.known else DIFFERENT


def _write_pictures(folder: Path, answer: "Answer") -> None:
    from epa_rt.cli.write import written_to
    from epa_rt.study.report.page import PictureError, write_pictures
    from epa_rt.tune.report.pictures import figures_of

    try:
        with written_to(folder / "*.png"):
            paths = write_pictures(folder, figures_of(answer))
        for path in paths:
            print(path)
    except PictureError as error:
        raise VerbError(str(error)) from None


def _rig_of(source: "Located | None", recordings: "tuple[Recording, ...]") -> "Rig":
    from epa_rt.config.rig import rig_from
    from epa_rt.gap.rig.read import rig_of

    if source is not None:
        return rig_from(source)
    rig = rig_of(recordings[0])
    if rig is None:
        raise VerbError(
            f"{recordings[0].path}: found no rig file of ours in the log, expected --rig RIG"
        )
    return rig


def _motion(path: Path | None, rig: "Rig", kind: str) -> "Motion | None":
    """Reference and speed of the first trial of an experiment in the loop that is tuned."""
    import numpy as np

    from epa_rt.experiments.experiment import load_experiment
    from epa_rt.tune.controller import LOOP_OF

    if path is None:
        return None
    experiment = load_experiment(path, rig)
    trial = next((phase for phase in experiment.trials if phase.loop == LOOP_OF[kind]), None)
    if trial is None or trial.motion.planned is None:
        raise VerbError(
            f"{path}: found no trial in the loop {LOOP_OF[kind]} that is planned beforehand,"
            " expected one"
        )
    times = np.arange(0.0, trial.motion.planned.duration_s, rig.period_s)
    return trial.motion.planned.sample(times)


def _json_text(answer: "Answer") -> str:
    import json

    from epa_rt.tune.answer import as_json

    return json.dumps(as_json(answer), indent=1, allow_nan=False) + "\n"


def _write_rig(
    arguments: argparse.Namespace,
    answer: "Answer",
    source: "Located | None",
    recordings: "tuple[Recording, ...]",
) -> None:
    """A copy of the rig file with the proposed gains; only where something is to be changed."""
    from epa_rt.cli.write import write_whole
    from epa_rt.cli.zero import bring_zero
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import parse_yaml
    from epa_rt.config.zero_file import without_zero
    from epa_rt.tune.rig_text import text_with

    out: Path = arguments.write
    if answer.proposal.keep:
        print(filled(f"{out}: not written, for the gains stay as they are"))
        return
    text = source.text if source is not None else recordings[0].attachments["rig.yaml"].decode()
    text = text_with(without_zero(text), answer.loop.kind, answer.after.gains)
    rig = rig_from(parse_yaml(text, out))  # what is written can be read
    write_whole(out, text)
    print(out)
    notes = bring_zero(rig, arguments.rig, out)
    if not notes:
        notes = [f"note: no zero goes with it: on a real rig first epa home --rig {out}"]
    for said in notes:
        print(filled(said))
    if not (out.parent / rig.plant).exists():
        said = (
            f"note: it names the plant file {rig.plant}, which is not there from its folder: run it"
            " with --plant, or move it beside the rig file"
        )
        print(filled(said))
