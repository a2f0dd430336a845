"""Check rig, experiment and plant files without starting anything.

Each file is read as a run would read it; the first thing that does not fit is named with file,
line, what was found and what was expected. With --rig, experiment files are checked against that
rig.

  epa check config/rigs/*.yaml
  epa check --rig config/rigs/bench.yaml config/experiments/identification.yaml
"""

import argparse
import sys
from pathlib import Path

from epa_rt.cli.exits import BAD_INPUT, COMPLETED


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "files", nargs="+", type=Path, metavar="FILE", help="rig, experiment or plant files"
    )
    verb.add_argument("--rig", type=Path, help="the rig that experiment files are meant for")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.config.rig import load_rig
    from epa_rt.config.source import ConfigError

    rig = load_rig(arguments.rig) if arguments.rig else None
    broken = 0
    for path in arguments.files:
        try:
            print(f"{path}: {describe(path, rig)}")
        except ConfigError as error:
            broken += 1
            print(f"epa check: {error}", file=sys.stderr)
    return BAD_INPUT if broken else COMPLETED


def describe(path: Path, rig: object) -> str:
    """One line on a sound file. Raises ConfigError."""
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import load_yaml

    source = load_yaml(path)
    if path.name.endswith(".zero.yaml"):
        from epa_rt.config.source import validate
        from epa_rt.config.zero_file import ZeroFile

        return validate(source, ZeroFile).facts
    if "rig" in source.data:
        typed = rig_from(source)
        return (
            f"rig {typed.name}, {len(typed.slaves)} slaves, {len(typed.inputs)} measured signals"
            f" and {len(typed.outputs)} commands every {typed.period_s * 1e3:g} ms"
        )
    if "experiment" in source.data:
        if rig is None:
            raise source.error(
                ("experiment",), "an experiment without a rig", "--rig RIG to check it against"
            )
        from epa_rt.experiments.experiment import experiment_from
        from epa_rt.loop.assembly import WiringError, assemble

        experiment = experiment_from(source, rig)
        try:
            assemble(rig, experiment)
        except WiringError as error:
            raise source.error(
                ("experiment",), str(error), "loops that go together in one run"
            ) from None
        return (
            f"experiment {experiment.name}, {len(experiment.phases)} phases, about"
            f" {experiment.duration_s:.0f} s on {rig.name}"
        )
    if "plant" in source.data:
        from epa_rt.models.plant_file import read_plant

        plant = read_plant(source)
        return f"plant {plant.name}, {plant.substeps} sub-steps"
    raise source.error(
        (), "none of the keys rig, experiment, plant", "a rig, experiment or plant file"
    )
