"""Loading the three files of a run, from disk or out of a log."""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import VerbError

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.config.source import Located
    from epa_rt.experiments.experiment import Experiment
    from epa_rt.models.plant_file import PlantFile

RIG, EXPERIMENT, PLANT, VERSION = "rig.yaml", "experiment.yaml", "plant.yaml", "version.json"


@dataclass(frozen=True)
class Inputs:
    """Rig, experiment and (for a simulated rig) plant, with the texts that a log carries."""

    rig: "Rig"
    experiment: "Experiment"
    plant: "PlantFile | None"
    attachments: dict[str, bytes]


def add_input_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("experiment", type=Path, metavar="EXPERIMENT", help="experiment file (config/experiments/*.yaml)")
    verb.add_argument("--rig", type=Path, required=True, help="rig file (config/rigs/*.yaml)")
    verb.add_argument("--plant", type=Path, help="plant file of the simulated rig (default: the one the rig names)")


def load_inputs(experiment: Path, rig: Path, plant: Path | None, with_plant: bool) -> Inputs:
    """Reads the files. Raises ConfigError with file and line."""
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import load_yaml

    rig_source = load_yaml(rig)
    rig_typed = rig_from(rig_source)
    plant_source = load_yaml(plant or rig.parent / rig_typed.plant) if with_plant else None
    return _typed(rig_source, rig_typed, load_yaml(experiment), plant_source)


def inputs_of_log(path: Path, attachments: dict[str, bytes]) -> Inputs:
    """The same out of a log's attachments. Raises VerbError where one is missing, ConfigError where it is broken."""
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import parse_yaml

    def source(name: str) -> "Located":
        if name not in attachments:
            raise VerbError(f"{path}: found no attachment {name}, expected a log that carries its files")
        try:
            text = attachments[name].decode("utf-8")
        except UnicodeDecodeError as error:
            raise VerbError(f"{path}[{name}]: found bytes that are not UTF-8 text (offset {error.start}), expected a YAML file") from None
        return parse_yaml(text, f"{path}[{name}]")

    rig_source = source(RIG)
    plant_source = source(PLANT) if PLANT in attachments else None
    return _typed(rig_source, rig_from(rig_source), source(EXPERIMENT), plant_source)


def _typed(rig_source: "Located", rig: "Rig", experiment: "Located", plant: "Located | None") -> Inputs:
    from epa_rt.experiments.experiment import experiment_from

    typed_plant = None
    attachments = {RIG: rig_source.text.encode(), EXPERIMENT: experiment.text.encode()}
    typed_experiment = experiment_from(experiment, rig)
    if plant is not None:
        from epa_rt.models.plant_file import read_plant

        typed_plant = read_plant(plant)
        attachments[PLANT] = plant.text.encode()
    attachments[VERSION] = json.dumps(code_version(), sort_keys=True).encode()
    return Inputs(rig, typed_experiment, typed_plant, attachments)


def code_version() -> dict[str, str]:
    """Version of this package and a digest of its sources, so that a log says which code made it."""
    import hashlib
    from importlib.metadata import PackageNotFoundError, version

    import epa_rt

    try:
        package = version("epa-rt")
    except PackageNotFoundError:
        package = "not installed"
    root = Path(epa_rt.__file__).parent
    digest = hashlib.sha256()
    for folder in (root, root.parent / "sim_backend", root.parent / "drivers"):
        for file in sorted(folder.rglob("*.py")):
            digest.update(file.relative_to(root.parent).as_posix().encode() + b"\0" + file.read_bytes())
    return {"package": package, "sources_sha256": digest.hexdigest()}
