"""Runs of the simulated rig that a diagnosis asks for: a log's experiment on another plant file, or
a new experiment.
"""

import itertools
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.beside import Beside
from epa_rt.cli.inputs import EXPERIMENT, PLANT, inputs_of_log
from epa_rt.cli.run import run_simulated
from epa_rt.gap.side_by_side import WORKERS

if TYPE_CHECKING:
    from epa_rt.gap.recording import Recording
    from epa_rt.gap.rig.menu import Item


class Simulator:
    """Runs as fast as they go, through the full loop and a log; logs are numbered in ``folder``.
    Processes beside this one run them, so that two threads may ask at once. A context, which ends
    the processes.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self._numbers = itertools.count(1)
        self._beside = Beside(WORKERS)

    def __enter__(self) -> "Simulator":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._beside.close()

    def again(self, plant: Path, real: "Recording", seed: int) -> "Recording":
        """The experiment of a log on its own rig with another plant file. Raises ConfigError,
        VerbError where it cannot be run.
        """
        files = real.attachments | {PLANT: plant.read_bytes()}
        recording, outcome = self._run(Path(real.path), files, seed)
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
        from epa_rt.config.source import ConfigError

        files = {EXPERIMENT: item.text.encode(), PLANT: plant_text.encode()}
        try:
            recording, outcome = self._run(Path(rig_of.path), rig_of.attachments | files, seed)
        except ConfigError:
            return None
        return recording if outcome == "completed" else None

    def _run(self, log: Path, files: dict[str, bytes], seed: int) -> "tuple[Recording, str]":
        from epa_rt.gap.rig.read import read_recording

        inputs_of_log(log, files)  # what is wrong with them is said here
        out = self._folder / f"run-{next(self._numbers):03d}.mcap"
        outcome, failure = self._beside.ask(_run_into, out, log, files, seed)
        if outcome == "stopped":
            raise KeyboardInterrupt  # the run itself took the operator's Ctrl-C
        if failure:
            raise VerbError(f"recorder: {failure}")
        return read_recording(out), outcome


def _run_into(out: Path, log: Path, files: dict[str, bytes], seed: int) -> tuple[str, str | None]:
    """How a run of a log's files ended, and what the recorder failed by."""
    summary, result = run_simulated(inputs_of_log(log, files), out, seed, None, progress=False)
    return result.outcome, summary.failure
