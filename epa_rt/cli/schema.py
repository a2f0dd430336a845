"""Write the JSON schemas of rig, plant, experiment and queue files, so that an editor completes and
checks them.

  epa schema -o config/schema
Then, in the first line of a rig file:  # yaml-language-server: $schema=../schema/rig.json
"""

import argparse
import json
from pathlib import Path

from epa_rt.cli.exits import COMPLETED
from epa_rt.cli.write import write_whole


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "-o", "--out", type=Path, help="folder to write to (default: print to the screen)"
    )


def schemas() -> dict[str, dict]:
    """JSON schema by file kind."""
    from epa_rt.config.experiment import ExperimentFile
    from epa_rt.config.meanings import with_meanings
    from epa_rt.config.queue import QueueFile
    from epa_rt.config.rig import Rig
    from epa_rt.models.catalogue_page import plant_schema

    return {
        "rig": with_meanings(Rig.model_json_schema()),
        "plant": plant_schema(),
        "experiment": with_meanings(ExperimentFile.model_json_schema(by_alias=True)),
        "queue": with_meanings(QueueFile.model_json_schema()),
    }


def main(arguments: argparse.Namespace) -> int:
    for kind, schema in schemas().items():
        text = json.dumps(schema, indent=2, sort_keys=True) + "\n"
        if arguments.out is None:
            print(text, end="")
            continue
        path = arguments.out / f"{kind}.json"
        write_whole(path, text)
        print(path)
    return COMPLETED
