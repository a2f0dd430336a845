"""Identify a muscle from logs: the paper's models and physical ones, scored and held out; which
terms; a plant file.

Only phases marked 'trial: true' are read. What is known beforehand (no-load length, normalisation,
geometry) comes from the plant file. -o writes a plant file with the identified muscle, which 'epa
run --plant' runs. The logs of a run that was broken off and resumed go together.

  epa identify out/*.mcap --rig config/rigs/bench.yaml -o muscle.yaml --html muscle.html
  epa identify out/a.mcap out/b.mcap --no-physical --json muscle.json
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.inputs import refuse_twice
from epa_rt.cli.outputs import add_html_argument, add_json_argument

if TYPE_CHECKING:
    from collections.abc import Callable

    from epa_rt.config.rig import Rig
    from epa_rt.gap.recording import Recording
    from epa_rt.identify.answer import Answer
    from epa_rt.identify.data import Trial
    from epa_rt.identify.linear import Scaled
    from epa_rt.models.plant_file import PlantFile

HOLDOUTS = ("both", "trial", "pressure", "none")
CHOICES = ("best", "polynomial", "tang", "physical")


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="logs of a rig (*.mcap)")
    verb.add_argument("--rig", type=Path, help="rig file (default: the one in the log)")
    verb.add_argument(
        "--plant",
        type=Path,
        help="plant file as it is believed (default: the one that --rig names, else the log's)",
    )
    verb.add_argument(
        "--holdout",
        choices=HOLDOUTS,
        default="both",
        help="what is left out in turn to judge a fit (default: both)",
    )
    verb.add_argument(
        "-o",
        "--out",
        type=Path,
        metavar="PLANT.yaml",
        help="write a plant file with the identified muscle",
    )
    verb.add_argument(
        "--model",
        choices=CHOICES,
        default="best",
        help="which model it gets (default: the best on trials left out)",
    )
    add_html_argument(verb, "write the answer as a page with pictures")
    add_json_argument(verb)
    verb.add_argument("--no-physical", action="store_true", help="leave out the physical models")
    verb.add_argument("--no-terms", action="store_true", help="leave out the choice of terms")
    verb.add_argument("--quiet", action="store_true", help="no progress")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.progress import progress_shown
    from epa_rt.cli.write import check_own, check_writable, write_whole
    from epa_rt.identify.report.terminal import console, show

    check_writable(arguments.json, (".json",))
    check_writable(arguments.html, (".html", ".htm"))
    check_writable(arguments.out, (".yaml", ".yml"))
    check_own(arguments.out, "epa identify")
    if arguments.model == "physical" and arguments.no_physical:
        raise VerbError("found --model physical beside --no-physical, expected one of them")
    with progress_shown(arguments.quiet) as progress:
        found, trials, data, plant = identified(arguments, progress)
    out = console()
    show(found, out)
    if arguments.out:
        write_whole(arguments.out, _plant_file(arguments, plant, found, trials, out))
    if arguments.json:
        write_whole(arguments.json, _json_text(found))
    if arguments.html:
        from epa_rt.identify.report.page import identify_page

        write_whole(arguments.html, identify_page(found, trials, data))
    for path in filter(None, (arguments.out, arguments.json, arguments.html)):
        out.print(str(path))
    return COMPLETED


def identified(
    arguments: argparse.Namespace, progress: "Callable[[str, float], None]"
) -> "tuple[Answer, list[Trial], list[Scaled], PlantFile]":
    """The answer, the trials that it was found from, these normalised, and the plant as believed.
    Raises VerbError, ConfigError.
    """
    from epa_rt.identify.data import IdentifyError
    from epa_rt.identify.identify import Asked, identify

    progress("reading", 0.0)
    recordings, rig, plant, plant_path = _opened(arguments)
    if arguments.out and plant_path and arguments.out.resolve() == plant_path.resolve():
        raise VerbError(
            f"{arguments.out}: found the plant file that was read, expected another name"
        )
    try:
        found, trials, data = identify(
            recordings,
            rig,
            plant.params,
            Asked(arguments.holdout, not arguments.no_physical, not arguments.no_terms),
            progress,
        )
    except IdentifyError as error:
        raise VerbError(str(error)) from None
    remarks = (f"{r.name}: {sentence}" for r in recordings for sentence in r.found)
    found = replace(
        found,
        remarks=(*remarks, *found.remarks),
        inputs={
            "logs": [str(path) for path in arguments.logs],
            "rig": str(arguments.rig or "in the log"),
            "plant": str(plant_path or "in the log"),
            "holdout": arguments.holdout,
        },
    )
    return found, trials, data, plant


def _opened(
    arguments: argparse.Namespace,
) -> "tuple[tuple[Recording, ...], Rig, PlantFile, Path | None]":
    """Logs of one rig, that rig, and its plant. Raises VerbError, ConfigError."""
    from epa_rt.cli.gap.inputs import read
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import load_yaml, named_file
    from epa_rt.models.plant_file import load_plant

    refuse_twice(arguments.logs)
    rig_source = load_yaml(arguments.rig) if arguments.rig else None
    rig = rig_from(rig_source) if rig_source else None
    recordings = read(arguments.logs, rig)
    names = sorted({recording.rig for recording in recordings})
    if len(names) > 1:
        raise VerbError(f"found logs of the rigs {', '.join(names)}, expected those of one")
    if rig is not None and names[0] and names[0] != rig.name:
        raise VerbError(
            f"{recordings[0].path}: found a log of the rig '{names[0]}', expected one of"
            f" '{rig.name}'"
        )
    if rig is None:
        rig = _rig_of(recordings[0])
    path = arguments.plant
    if path is None and rig_source is not None and rig.plant:
        path = named_file(rig_source, ("plant",), arguments.rig.parent / rig.plant)
    return recordings, rig, load_plant(path) if path else _plant_of(recordings[0]), path


def _rig_of(recording: "Recording") -> "Rig":
    from epa_rt.gap.rig.read import rig_of

    rig = rig_of(recording)
    if rig is None:
        raise VerbError(
            f"{recording.path}: found no rig file of ours in the log, expected --rig RIG"
        )
    return rig


def _plant_of(recording: "Recording") -> "PlantFile":
    from epa_rt.config.source import parse_yaml
    from epa_rt.models.plant_file import read_plant

    if "plant.yaml" not in recording.attachments:
        raise VerbError(
            f"{recording.path}: found no plant file in the log, expected --rig RIG, which names"
            " one, or --plant PLANT"
        )
    return read_plant(
        parse_yaml(
            recording.attachments["plant.yaml"].decode("utf-8", "replace"),
            f"{recording.path}[plant.yaml]",
        )
    )


def _plant_file(arguments: argparse.Namespace, plant: "PlantFile", found, trials, out) -> str:
    from epa_rt.identify.plant_out import chosen_plant, plant_text

    chosen, score = chosen_plant(arguments.model, plant, found, trials)
    gas = found.gas
    out.print(f"plant file '{chosen.name}': muscle by {score.name} ({score.says})")
    return plant_text(
        chosen,
        (
            (
                "Muscle identified by 'epa identify' from"
                f" {', '.join(path.name for path in arguments.logs)}: {score.name}, R2"
                f" {score.r2:.4f}, RMS {score.rms_n:.2f} N."
            ),
            (
                f"Lengths {min(t.length_m.min() for t in trials) * 1e3:.1f} to"
                f" {max(t.length_m.max() for t in trials) * 1e3:.1f} mm, gauge pressures"
                f" {min(t.gauge_pa.min() for t in trials) / 1e3:.0f} to"
                f" {max(t.gauge_pa.max() for t in trials) / 1e3:.0f} kPa; nothing is known outside."
            ),
            (
                f"Gas: exponent {gas.polytropic_ratio:.3f} and leak {gas.leak_per_s:.1e} 1/s beside"
                f" {gas.dead_volume_m3 * 1e6:.1f} cm^3 of dead volume, which is the plant file's."
            ),
        ),
    )


def _json_text(found) -> str:
    import json

    from epa_rt.identify.answer import as_json

    return json.dumps(as_json(found), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
