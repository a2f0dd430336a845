"""epa run --resume: the files of a run cut down to the repetitions that a broken-off log lacks."""

from dataclasses import replace
from pathlib import Path
from typing import TextIO

from epa_rt.cli.exits import VerbError
from epa_rt.cli.inputs import EXPERIMENT, Inputs
from epa_rt.logs.plain_text import plain


def resumed_inputs(
    inputs: Inputs, log: Path, backend: str, says_to: TextIO | None = None
) -> Inputs | None:
    """The inputs of the run that goes on from ``log``; None where nothing is left. Says either, on
    ``says_to`` (default: stdout).

    Raises VerbError where the log cannot be read or is of other files, ConfigError.
    """
    from epa_rt.logs.reader import LogError
    from epa_rt.runs.resume import ATTACHMENT, ResumeError, resumed

    try:
        found = resumed(log, inputs.attachments, inputs.experiment, inputs.rig, backend)
    except (ResumeError, LogError) as error:
        raise VerbError(str(error)) from None
    except OSError as error:
        raise VerbError(f"{log}: cannot be read ({error.strerror})") from None
    print(plain(found.says), file=says_to)
    if found.experiment is None:
        return None
    return replace(
        inputs,
        experiment=found.experiment,
        attachments=inputs.attachments
        | {EXPERIMENT: found.experiment.text.encode(), ATTACHMENT: found.note},
    )
