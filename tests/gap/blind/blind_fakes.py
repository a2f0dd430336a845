"""Diagnosers that are called in the benchmark's worker processes by tests."""

import os
from pathlib import Path


def careful(rig, plant, logs, holdout, leave_out):
    """Says that there is nothing; fails where a file is missing."""
    assert all(Path(path).exists() for path in (rig, plant, *logs, *holdout))
    return {"verdict": "no_gap", "says": "nothing", "effects": [], "location": [], "left_out": list(leave_out)}


def cheater(rig, plant, logs, holdout, leave_out):
    """Tries to read the sealed truth beside the cases, and says what it got."""
    sealed = Path(rig).parent.parent.with_name(Path(rig).parent.parent.name + ".sealed")
    got = {}
    for name in ("truth.sealed", "truth.key"):
        try:
            got[name] = len((sealed / name).read_bytes())
        except OSError as error:
            got[name] = type(error).__name__
    return {"verdict": "no_gap", "effects": [], "got": got, "listed": os.listdir(sealed) if sealed.exists() else None}


def broken(rig, plant, logs, holdout, leave_out):
    raise ValueError("found nothing to say")


SHORT = """experiment: next
loop: motor_position
seed: 1
phases:
  - {name: go_to_no_load, move: {to: no_load, speed: 20 mm/s}}
  - {name: rest, trial: true, for: 1 s}
"""
FORCE = {"name": "force_offset", "family": "force offset", "block": "sensors", "confidence": 0.5, "not_separable_from": ["end_fittings"]}


def doubting(rig, plant, logs, holdout, leave_out):
    """Cannot tell two effects apart until it is given one more log."""
    if len(logs) == 1:
        return {"verdict": "not_separable", "effects": [FORCE], "location": [], "next_experiment": {"file": SHORT}}
    from epa_rt.gap.read import read_recording

    read = read_recording(Path(logs[-1]))
    return {"verdict": "explained", "effects": [{**FORCE, "not_separable_from": []}], "location": [], "samples": read.samples}


def helpless(rig, plant, logs, holdout, leave_out):
    """Cannot tell apart and proposes nothing."""
    return {"verdict": "not_separable", "effects": [FORCE], "location": [], "next_experiment": None}
