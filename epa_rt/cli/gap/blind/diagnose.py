"""The diagnosis as the blind benchmark calls it: files in, answer out, with the gate."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from epa_rt.gap.diagnosis import Diagnosis


def diagnose_files(
    rig: Path, plant: Path, logs: Sequence[Path], holdout: Sequence[Path], leave_out: Sequence[str]
) -> "Diagnosis":
    """Diagnoses the logs of a rig against a plant file as the command line does, checks included,
    with effects left out of the catalogue (those it has for this rig).

    Where effects cannot be told apart it looks for the next experiment; where any is named, for
    what the gate says. Raises VerbError where the logs are refused.
    """
    from dataclasses import replace

    from epa_rt.cli.gap.diagnose import diagnose_logs, gated
    from epa_rt.cli.gap.plan import planned
    from epa_rt.gap.rig.subjects import open_subject

    known = {effect.name for effect in open_subject(rig, plant).catalogue}
    without = [name for name in leave_out if name in known]
    given, answer = diagnose_logs(rig, plant, logs, holdout, without)
    if not answer.effects:
        return answer
    try:
        if answer.verdict == "not_separable":
            answer = replace(
                answer, next_experiment=planned(given, answer, lambda stage, share: None)
            )
        return replace(answer, gate=gated(given, answer, None, lambda stage, share: None).report)
    except Exception as error:
        # the answer stands without them, and the figures count the gate as missing, the experiment
        # as none
        return replace(answer, gate={"error": f"{type(error).__name__}: {error}"})
