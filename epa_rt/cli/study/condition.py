"""One condition of the knee study, through the loop on the simulated rig."""

import tempfile
from pathlib import Path

from epa_rt.cli.exits import FAILED, OF_OUTCOME, VerbError


def run_condition(rig: Path, text: str) -> tuple[dict, float]:
    """Runs an experiment on a rig's simulated plant; columns of its trial from its start, and the
    cycle (s). Raises VerbError where it does not complete.
    """
    from epa_rt.cli.inputs import load_inputs
    from epa_rt.cli.run import run_simulated
    from epa_rt.config.source import ConfigError
    from epa_rt.gap.rig.read import read_recording

    with tempfile.TemporaryDirectory() as place:
        experiment = Path(place) / "condition.yaml"
        experiment.write_text(text, encoding="utf-8")
        try:
            inputs = load_inputs(experiment, rig, None, with_plant=True)
        except ConfigError as error:  # of a file that nobody will find
            raise VerbError(
                f"condition of {rig.name}: {error.where}: found {error.found}, expected"
                f" {error.expected}"
            ) from None
        summary, result = run_simulated(
            inputs, Path(place) / "condition.mcap", 1, None, progress=False
        )
        if result.outcome == "stopped":
            raise KeyboardInterrupt
        if result.outcome != "completed" or summary.failure:
            raise VerbError(
                f"{inputs.experiment.description or inputs.experiment.name}:"
                f" {result.outcome}{': ' + result.cause if result.cause else ''}",
                FAILED if summary.failure else OF_OUTCOME[result.outcome],
            )
        recording = read_recording(summary.path)
    trial = next(span for span in recording.spans if span.trial)
    return {
        name: column[trial.start : trial.stop] for name, column in recording.columns.items()
    }, recording.period_s
