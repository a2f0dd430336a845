"""Loading the three files of a run, from disk or out of a log; a plant file that is another rig's
is refused.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.emulated import LockStep, interface_here
from epa_rt.cli.exits import VerbError

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.config.source import Located
    from epa_rt.experiments.experiment import Experiment
    from epa_rt.models.plant_file import PlantFile

RIG, EXPERIMENT, PLANT, VERSION = "rig.yaml", "experiment.yaml", "plant.yaml", "version.json"
_LOADS = (
    "a muscle held by the load cell",
    "a mass on a line",
    "a joint",
)  # by kind_code of the plant's load
_PLACES = ("", "load_position_m", "joint_angle_rad")  # the port that measures where such a load is


@dataclass(frozen=True)
class Inputs:
    """Rig, experiment and (for a simulated rig) plant, with the texts that a log carries."""

    rig: "Rig"
    experiment: "Experiment"
    plant: "PlantFile | None"
    attachments: dict[str, bytes]
    unprotected: tuple[str, ...] = ()  # what the rig does without, by reason; a sentence each
    metadata: Mapping[str, Mapping[str, str]] = field(default_factory=dict)  # more for the log


def add_input_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "experiment",
        type=Path,
        metavar="EXPERIMENT",
        help="experiment file (config/experiments/*.yaml)",
    )
    verb.add_argument("--rig", type=Path, required=True, help="rig file (config/rigs/*.yaml)")
    verb.add_argument(
        "--plant",
        type=Path,
        help="plant file of the simulated rig (default: the one the rig names)",
    )


def add_backend_arguments(verb: argparse.ArgumentParser) -> None:
    """What is behind the bytes, and how its bus is reached."""
    verb.add_argument(
        "--backend",
        choices=("sim", "ethercat"),
        default="sim",
        help="what is behind the bytes (default: %(default)s)",
    )
    verb.add_argument(
        "--interface",
        default=interface_here(),
        help="network interface of the bus (default: $EPA_BUS_INTERFACE, else the only candidate)",
    )
    verb.add_argument(
        "--lock-step",
        action=LockStep,
        help="one bus cycle after the other without pace (emulated bus only; refused on a card;"
        " default: as epa bus run has it)",
    )
    verb.add_argument(
        "--take-over",
        action="store_true",
        help="even if another master seems to drive the bus (--backend ethercat)",
    )


def positive_factor(text: str) -> float:
    """A pace from the command line. Raises ArgumentTypeError, ValueError."""
    value = float(text)
    if not 0.0 < value < 1e6:
        raise argparse.ArgumentTypeError(f"found {text}, expected a factor above zero")
    return value


def add_simulation_arguments(verb: argparse.ArgumentParser) -> None:
    """The simulated rig's noise and pace."""
    verb.add_argument(
        "--seed",
        type=int,
        default=1,
        help="seed of the simulated sensors' noise (default: %(default)s)",
    )
    verb.add_argument(
        "--speed",
        type=positive_factor,
        help="pace of the simulated rig; 1 is real time (default: as fast as it goes)",
    )


def add_supply_argument(verb: argparse.ArgumentParser) -> None:
    """The operator's word on what nothing else tells of a wired drive."""
    verb.add_argument(
        "--supply-stayed-on",
        action="store_true",
        help="a wired drive has had its supply since the last run, which nothing else tells where"
        " that run ended near count 0 (--backend ethercat)",
    )


def load_inputs(
    experiment: Path,
    rig: Path,
    plant: Path | None,
    with_plant: bool,
    with_zero: bool = False,
    protected: bool = True,
    emulated: bool = False,
) -> Inputs:
    """Reads the files of a run, ``with_zero`` the zero file beside the rig's. Raises ConfigError
    with file and line, also for a rig file that does not protect, which only a simulation of an
    older case may use (``protected`` False).
    """
    from epa_rt.cli.sound_rig import SoundRig, sound_rig
    from epa_rt.cli.zero import load_rig_source
    from epa_rt.config.source import load_yaml

    rig_source, typed = load_rig_source(rig, with_zero, emulated)
    sound = sound_rig(rig_source) if protected else SoundRig(typed, ())
    found = load_plant_of(rig, sound.rig, plant) if with_plant else None
    inputs = _typed(rig_source, sound.rig, load_yaml(experiment), found)
    return replace(inputs, unprotected=sound.unprotected)


def load_plant_of(rig: Path, typed: "Rig", plant: Path | None) -> "tuple[Located, PlantFile]":
    """The plant file of a rig as text and as numbers; ``plant`` None: the one that the rig names.

    Raises ConfigError, also where it moves another load than the rig or lacks one of its muscles.
    The rig's load is the one that it measures; where it measures none, the one of the plant that it
    names.
    """
    from epa_rt.config.source import ConfigError, load_yaml, named_file
    from epa_rt.models.plant_file import read_plant

    own = rig.parent / typed.plant
    try:
        source = load_yaml(plant or own)
    except ConfigError:
        if plant is None:
            named_file(load_yaml(rig), ("plant",), own)
        raise
    read = read_plant(source)
    kind, expected = _kind(read), _measured_kind(typed)
    if expected is None and plant is not None:
        expected = _kind_in(own)
    if expected not in (None, kind):
        raise source.error(
            ("load", "kind_code"),
            f"{_LOADS[kind]} (kind_code {kind}), a plant of another rig",
            f"{_LOADS[expected]} (kind_code {expected}), which the rig '{typed.name}' has",
        )
    present = int((read.params["muscle"]["present"][0] > 0.5).sum())
    if present < len(typed.muscles):
        raise source.error(
            ("muscle1", "present"),
            f"a plant with {present} muscle{'s' * (present != 1)}",
            f"{len(typed.muscles)}, which the rig '{typed.name}' has",
        )
    return source, read


def _kind(plant: "PlantFile") -> int:
    return int(plant.params["load"]["kind_code"][0])


def _measured_kind(rig: "Rig") -> int | None:
    ports = {row.port for row in rig.inputs}
    return next((i for i in (2, 1) if _PLACES[i] in ports), None)


def _kind_in(own: Path) -> int | None:
    """The load of the plant that a rig names; None where that file is not there or not sound: it is
    not the one that is run.
    """
    from epa_rt.config.source import ConfigError
    from epa_rt.models.plant_file import load_plant

    try:
        return _kind(load_plant(own))
    except ConfigError:
        return None


def inputs_of_log(path: Path, attachments: dict[str, bytes]) -> Inputs:
    """The same out of a log's attachments. Raises VerbError where one is missing, ConfigError where
    it is broken.
    """
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import parse_yaml
    from epa_rt.models.plant_file import read_plant

    def source(name: str) -> "Located":
        if name not in attachments:
            raise VerbError(
                f"{path}: found no attachment {name}, expected a log that carries its files"
            )
        try:
            text = attachments[name].decode("utf-8")
        except UnicodeDecodeError as error:
            raise VerbError(
                f"{path}[{name}]: found bytes that are not UTF-8 text (offset {error.start}),"
                " expected a YAML file"
            ) from None
        return parse_yaml(text, f"{path}[{name}]")

    rig_source = source(RIG)
    plant_source = source(PLANT) if PLANT in attachments else None
    plant = None if plant_source is None else (plant_source, read_plant(plant_source))
    return _typed(rig_source, rig_from(rig_source), source(EXPERIMENT), plant)


def _typed(
    rig_source: "Located",
    rig: "Rig",
    experiment: "Located",
    plant: "tuple[Located, PlantFile] | None",
) -> Inputs:
    from epa_rt.experiments.experiment import experiment_from

    attachments = {RIG: rig_source.text.encode(), EXPERIMENT: experiment.text.encode()}
    typed_experiment = experiment_from(experiment, rig)
    plant_source, typed_plant = plant or (None, None)
    if plant_source is not None:
        attachments[PLANT] = plant_source.text.encode()
    attachments[VERSION] = json.dumps(code_version(), sort_keys=True).encode()
    return Inputs(rig, typed_experiment, typed_plant, attachments)


def refuse_twice(paths: Sequence[Path]) -> None:
    """Raises VerbError where a log is named twice, by whatever path."""
    places = [realpath(path) for path in paths]  # Path.resolve raises where links go in a circle
    for path, place in zip(paths, places, strict=True):
        if places.count(place) > 1:
            raise VerbError(f"found {path} twice, expected every log once")


def code_version() -> dict[str, str]:
    """Version of this package and a digest of its sources, so that a log says which code made
    it.
    """
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
            digest.update(
                file.relative_to(root.parent).as_posix().encode() + b"\0" + file.read_bytes()
            )
    return {"package": package, "sources_sha256": digest.hexdigest()}
