"""Diagnosers that are called in the benchmark's worker processes by tests."""

import os
from pathlib import Path


def careful(rig, plant, logs, holdout, leave_out):
    """Says that there is nothing; fails where a file is missing."""
    assert all(Path(path).exists() for path in (rig, plant, *logs, *holdout))
    return {
        "verdict": "no_gap",
        "says": "nothing",
        "effects": [],
        "location": [],
        "left_out": list(leave_out),
    }


def cheater(rig, plant, logs, holdout, leave_out):
    """Tries to read the sealed truth beside the cases, and says what it got."""
    sealed = Path(rig).parent.parent.with_name(Path(rig).parent.parent.name + ".sealed")
    got = {}
    for name in ("truth.sealed", "truth.key"):
        try:
            got[name] = len((sealed / name).read_bytes())
        except OSError as error:
            got[name] = type(error).__name__
    return {
        "verdict": "no_gap",
        "effects": [],
        "got": got,
        "listed": os.listdir(sealed) if sealed.exists() else None,
    }


def nosy(rig, plant, logs, holdout, leave_out):
    """Reads what lies beside the cases: what score and the oracle have written of them."""
    beside = Path(rig).parent.parent.parent
    got = {
        path.relative_to(beside).as_posix(): path.read_bytes().decode()
        for path in beside.rglob("*")
        if path.suffix in (".json", ".html")
        and not path.is_dir()
        and not path.is_relative_to(beside / "cases")
    }
    return {"verdict": "no_gap", "effects": [], "location": [], "got": got}


def stopped_at(folder: str, n: int, stop: int) -> int:
    """Work of side_by_side that the operator ends at ``stop``; every other one leaves a file and
    takes its time.
    """
    import time

    (Path(folder) / str(n)).touch()
    if n == stop:
        raise KeyboardInterrupt
    time.sleep(0.2)
    return n


def broken(rig, plant, logs, holdout, leave_out):
    raise ValueError("found nothing to say")


SHORT = """experiment: next
loop: motor_position
seed: 1
phases:
  - {name: go_to_no_load, move: {to: no_load, speed: 20 mm/s}}
  - {name: rest, trial: true, for: 1 s}
"""
FORCE = {
    "name": "force_offset",
    "family": "force offset",
    "block": "sensors",
    "confidence": 0.5,
    "not_separable_from": ["end_fittings"],
}


def doubting(rig, plant, logs, holdout, leave_out):
    """Cannot tell two effects apart until it is given one more log."""
    if len(logs) == 1:
        return {
            "verdict": "not_separable",
            "effects": [FORCE],
            "location": [],
            "next_experiment": {"file": SHORT},
        }
    from epa_rt.gap.rig.read import read_recording

    read = read_recording(Path(logs[-1]))
    return {
        "verdict": "explained",
        "effects": [{**FORCE, "not_separable_from": []}],
        "location": [],
        "samples": read.samples,
    }


def dying(rig, plant, logs, holdout, leave_out):
    """Cannot tell two effects apart, and ends in an error once it is given one more log."""
    if len(logs) > 1:
        raise ValueError("found one log too many")
    return {
        "verdict": "not_separable",
        "effects": [FORCE],
        "location": [],
        "next_experiment": {"file": SHORT},
    }


def gone(rig, plant, logs, holdout, leave_out):
    """Takes its whole process with it."""
    os._exit(7)


def helpless(rig, plant, logs, holdout, leave_out):
    """Cannot tell apart and proposes nothing."""
    return {"verdict": "not_separable", "effects": [FORCE], "location": [], "next_experiment": None}
