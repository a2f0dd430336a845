"""The proposed next experiments of blind cases: run on the hidden rig, added to the logs, and
diagnosed again.
"""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from epa_rt.benchmark.score import diagnose_each

UNANSWERED = "not_separable"


def add_next(
    cases: Path,
    judged: "list[tuple[dict, dict]]",
    answers: Path,
    diagnoser: str,
    hidden: Sequence[Path],
    jobs: int = 1,
) -> int:
    """Gives every answer that says 'not separable' of a case with an effect an ``after_next``: what
    is said with the proposed log too, or why there is none. Answers of a second diagnosis are kept
    beside the first; returns how many there are.

    This process knows the truth by now, and records one experiment after the other; the second
    diagnoses run where the first did, ``jobs`` at once, without it (``hidden`` as in
    diagnose_each).
    """
    open_ones = [
        (truth, said)
        for truth, said in judged
        if said.get("verdict") == UNANSWERED and truth["effects"]
    ]
    asked = []
    for n, (truth, said) in enumerate(open_ones, 1):
        folder, out = cases / truth["case"], answers / f"{truth['case']}_next.json"
        failed = None if out.exists() else _failed(folder, truth, said)
        if failed:
            said["after_next"] = {"error": failed}
        else:
            asked.append((said, folder / "next", out))
        print(
            f"\r{n} of {len(open_ones)} next experiments recorded",
            end="" if n < len(open_ones) else "\n",
            file=sys.stderr,
            flush=True,
        )
    diagnose_each(
        [(folder, out) for _, folder, out in asked],
        hidden,
        diagnoser,
        jobs,
        "next experiments diagnosed",
    )
    for said, _, out in asked:
        said["after_next"] = json.loads(out.read_text(encoding="utf-8"))
    return len(open_ones)


def _failed(folder: Path, truth: dict, said: dict) -> str | None:
    """Records the proposed experiment; why there is none to diagnose, None where there is."""
    text = (said.get("next_experiment") or {}).get("file")
    if not text:
        return "no experiment was proposed"
    outcome = _recorded(folder, truth, text)
    return (
        None if outcome == "completed" else f"the proposed experiment {outcome} on the hidden rig"
    )


def _recorded(folder: Path, truth: dict, text: str) -> str:
    """Runs an experiment file on the hidden rig into the case's ``next`` folder; returns the run's
    outcome.
    """
    from dataclasses import replace

    from epa_rt.cli.gap.blind.make import _record
    from epa_rt.config.rig import load_rig
    from epa_rt.models.plant_file import load_plant
    from sim_backend.backend import SimBackend
    from sim_backend.stand_in.truth import true_plant

    place = folder / "next"
    place.mkdir(exist_ok=True)
    experiment, log, told = place / "next.yaml", place / "next.mcap", place / "case.json"
    experiment.write_text(text, encoding="utf-8")
    log.unlink(missing_ok=True)
    rig, believed = load_rig(folder / "rig.yaml"), load_plant(folder / "plant.yaml")
    plant = true_plant(believed.params, truth)
    backend = SimBackend(
        rig,
        replace(believed, params=plant.params, substeps=plant.substeps),
        7_000_001 + truth["index"],
        None,
        plant.physics,
    )
    outcome, _ = _record(experiment, folder / "rig.yaml", folder / "plant.yaml", backend, log)
    case = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    again = {
        key: [f"../{path}" for path in value] if isinstance(value, list) else f"../{value}"
        for key, value in case.items()
        if key != "leave_out"
    }
    told.write_text(
        json.dumps(
            {**again, "logs": [*again["logs"], "next.mcap"], "leave_out": case["leave_out"]},
            indent=1,
        )
        + "\n",
        encoding="utf-8",
    )
    return outcome
