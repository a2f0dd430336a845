"""Runs of the simulated rig that a diagnosis asks for: a log's experiment on another plant file, or
a new experiment.
"""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import VerbError
from epa_rt.cli.inputs import EXPERIMENT, PLANT, Inputs, inputs_of_log
from epa_rt.cli.run import run_simulated

if TYPE_CHECKING:
    from epa_rt.gap.recording import Recording
    from epa_rt.gap.rig.menu import Item


class Simulator:
    """Runs as fast as they go, through the full loop and a log; logs are numbered in ``folder``."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._count = 0

    def again(self, plant: Path, real: "Recording", seed: int) -> "Recording":
        """The experiment of a log on its own rig with another plant file. Raises ConfigError,
        VerbError where it cannot be run.
        """
        from epa_rt.config.source import load_yaml

        recording, outcome = self._run(
            _with_plant(inputs_of_log(Path(real.path), real.attachments), load_yaml(plant)), seed
        )
        if outcome == "failed":
            raise VerbError(
                f"{plant}: the run of {real.experiment or 'the experiment'} failed on the"
                " simulated rig"
            )
        return recording

    def new(
        self, item: "Item", plant_text: str, rig_of: "Recording", seed: int = 1
    ) -> "Recording | None":
        """A new experiment on the rig of a log; None where it was not completed, or asks for more
        than the rig may do.
        """
        from epa_rt.config.source import ConfigError, parse_yaml

        try:
            inputs = inputs_of_log(
                Path(rig_of.path), rig_of.attachments | {EXPERIMENT: item.text.encode()}
            )
        except ConfigError:
            return None
        recording, outcome = self._run(
            _with_plant(inputs, parse_yaml(plant_text, "plant.yaml")), seed
        )
        return recording if outcome == "completed" else None

    def _run(self, inputs: Inputs, seed: int) -> "tuple[Recording, str]":
        from epa_rt.gap.rig.read import read_recording

        self._count += 1
        summary, result = run_simulated(
            inputs, self._folder / f"run-{self._count:03d}.mcap", seed, None, progress=False
        )
        if result.outcome == "stopped":
            raise KeyboardInterrupt  # the run itself took the operator's Ctrl-C
        if summary.failure:
            raise VerbError(f"recorder: {summary.failure}")
        return read_recording(summary.path), result.outcome


def _with_plant(inputs: Inputs, source) -> Inputs:
    from epa_rt.models.plant_file import read_plant

    return dataclasses.replace(
        inputs,
        plant=read_plant(source),
        attachments=inputs.attachments | {PLANT: source.text.encode()},
    )
