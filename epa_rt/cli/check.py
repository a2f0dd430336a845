"""Check rig, experiment, plant and queue files without starting anything.

Each file is read as a run would read it. Everything in a rig file that does not protect is named,
one sentence each, with file, line, what was found and what was expected; a sound one shows what
protects it. What a rig leaves out on purpose stands under 'unprotected: {NAME: why}' and is said
here and at every start. With --rig, experiment files are checked against that rig.

  epa check config/rigs/*.yaml
  epa check --rig config/rigs/bench.yaml config/experiments/identification.yaml
"""

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.duration import duration, duration_words
from epa_rt.cli.exits import BAD_INPUT, COMPLETED
from epa_rt.cli.outputs import add_json_argument, is_screen
from epa_rt.cli.screen_text import filled
from epa_rt.cli.write import check_writable, write_whole

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.config.source import ConfigError, Located


@dataclass(frozen=True)
class Answer:
    """What is said of a sound file: one line, what protects it, what it does without by reason."""

    line: str
    protected: tuple[str, ...] = ()
    unprotected: tuple[str, ...] = ()
    calibrated: tuple[str, ...] = ()  # which readings go by a calibration file, and how old it is
    old: tuple[str, ...] = ()


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "files", nargs="+", type=Path, metavar="FILE", help="rig, experiment, plant or queue files"
    )
    verb.add_argument("--rig", type=Path, help="the rig that experiment files are meant for")
    add_json_argument(verb, "the answers as one list")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.sound_rig import sound_rig
    from epa_rt.config.source import ConfigError, load_yaml

    check_writable(arguments.json, (".json",))
    rig = sound_rig(load_yaml(arguments.rig)).rig if arguments.rig else None
    answers, broken = [], 0
    no_errors: tuple[ConfigError, ...] = ()
    answer: Answer | None
    for path in arguments.files:
        try:
            answer, errors = describe(path, rig), no_errors
        except ConfigError as error:
            answer, errors = None, error.errors
        broken += answer is None
        answers.append(_as_data(path, answer, errors))
        if not is_screen(arguments.json):
            _say(path, answer, errors)
    if arguments.json:
        write_whole(arguments.json, json.dumps(answers, indent=2) + "\n")
    return BAD_INPUT if broken else COMPLETED


def _say(path: Path, answer: Answer | None, errors: "tuple[ConfigError, ...]") -> None:
    if answer is None:
        for one in errors:
            print(filled(f"epa check: {one}", sys.stderr), file=sys.stderr)
        return
    print(filled(f"{path}: {answer.line}"))
    for text in answer.calibrated:
        said = f"    {text}" if text.startswith(" ") else f"  calibrated: {text}"
        print(filled(said))
    for text in answer.old:
        print(filled(f"  OLD: {text}"))
    for text in answer.protected:
        print(filled(f"  {text}"))
    for text in answer.unprotected:
        print(filled(f"  UNPROTECTED: {text}"))


def _as_data(
    path: Path, answer: Answer | None, errors: "tuple[ConfigError, ...]"
) -> dict[str, object]:
    if answer is None:
        return {
            "file": str(path),
            "sound": False,
            "errors": [
                {"line": e.line, "where": e.where, "found": e.found, "expected": e.expected}
                for e in errors
            ],
        }
    return {
        "file": str(path),
        "sound": True,
        "is": answer.line,
        "protected": answer.protected,
        "unprotected": answer.unprotected,
        "calibrated": answer.calibrated,
        "old": answer.old,
    }


def describe(path: Path, rig: "Rig | None") -> Answer:
    """What is said of a sound file. Raises ConfigError, which may hold several sentences."""
    from epa_rt.config.source import load_yaml

    source = load_yaml(path)
    if path.name.endswith(".zero.yaml"):
        from epa_rt.config.source import validate
        from epa_rt.config.zero_file import ZeroFile

        return Answer(validate(source, ZeroFile).facts)
    if "calibration_of" in source.data:
        from epa_rt.config.calibration_file import CalibrationFile
        from epa_rt.config.source import validate

        file = validate(source, CalibrationFile)
        found = tuple(one.facts for one in file.signals)
        return Answer(f"{len(found)} calibrations of {file.calibration_of}", calibrated=found)
    if path.name == "operator.yaml":
        return _describe_operator(source, rig)
    if "queue" in source.data:  # before 'rig', which a queue may have too
        return _describe_queue(path)
    if "rig" in source.data:
        return _describe_rig(path, source)
    if "experiment" in source.data:
        return _describe_experiment(source, rig)
    if "plant" in source.data:
        from epa_rt.models.plant_file import read_plant

        plant = read_plant(source)
        return Answer(f"plant {plant.name}, {plant.substeps} sub-steps")
    raise source.error(
        (),
        "none of the keys rig, experiment, plant, calibration_of, queue",
        "a rig, experiment, plant, calibration or queue file",
    )


def _describe_queue(path: Path) -> Answer:
    from epa_rt.cli.inputs import load_inputs
    from epa_rt.report.shown import count
    from epa_rt.runs.queue import load_queue

    queue, duration_s = load_queue(path), 0.0
    for item in queue.items:
        queue.check_files(item)
        inputs = load_inputs(item.experiment, item.rig, item.plant, with_plant=True)
        duration_s += inputs.experiment.duration_s
    runs = count(len(queue.items), "run")
    return Answer(f"queue {queue.name}, {runs}, about {duration(duration_s)}")


def _describe_rig(path: Path, source: "Located") -> Answer:
    from epa_rt.cli.calibration_age import old_words, used_words
    from epa_rt.cli.inputs import load_plant_of
    from epa_rt.cli.sound_rig import sound_rig
    from epa_rt.config.rig_protected import protections

    sound = sound_rig(source)
    rig = sound.rig
    load_plant_of(path, rig, None)
    return Answer(
        f"rig {rig.name}, {len(rig.slaves)} slaves, {len(rig.inputs)} measured signals"
        f" and {len(rig.outputs)} commands every {rig.period_s * 1e3:g} ms",
        protections(rig),
        sound.unprotected,
        used_words(rig),
        old_words(rig),
    )


def _describe_operator(source: "Located", rig: "Rig | None") -> Answer:
    from epa_rt.config.operator_file import operator_from

    muscles = {rig.name: tuple(muscle.name for muscle in rig.muscles)} if rig else {}
    found = operator_from(source, muscles)
    return Answer(
        f"operator {found.operator or 'not named'}, {len(found.rigs)} rigs described"
        f"{': ' if found.rigs else ''}{', '.join(found.rigs)}"
    )


def _describe_experiment(source: "Located", rig: "Rig | None") -> Answer:
    from epa_rt.experiments.experiment import experiment_from
    from epa_rt.loop.assembly import WiringError, assemble
    from epa_rt.report.shown import count

    if rig is None:
        raise source.error(
            ("experiment",), "an experiment without a rig", "--rig RIG to check it against"
        )
    experiment = experiment_from(source, rig)
    try:
        assemble(rig, experiment)
    except WiringError as error:
        raise source.error(
            ("experiment",), str(error), "loops that go together in one run"
        ) from None
    phases = count(len(experiment.phases), "phase")
    return Answer(
        f"experiment {experiment.name} on {rig.name}, {phases}, {duration_words(experiment)}"
    )
