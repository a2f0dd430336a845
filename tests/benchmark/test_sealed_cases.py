"""Six sealed cases through the command line: recorded anew from their seal, diagnosed by processes
that cannot see the truth, and scored.

The set is that of ``epa gap blind make --short --seed 631801 --cases 6``, without its logs.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from epa_rt.benchmark.compare import scored

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SURE = 0.8  # probability from which a wrong name is held against the diagnosis
CASES, RIGHT = 6, 5
LOG_SCORE = -1.5  # of the truth, mean: 0.001 for one, and 0.8 for the others


def epa(*words: object) -> str:
    command = [sys.executable, "-m", "epa_rt", "gap", "blind", *map(str, words)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.timeout(1200)
def test_six_sealed_cases_are_recorded_diagnosed_and_scored(tmp_path):
    for folder in ("six", "six.sealed"):
        shutil.copytree(HERE / folder, tmp_path / folder)
    assert f"{CASES} cases recorded, 0 were there" in epa("again", tmp_path / "six")
    assert f"0 cases recorded, {CASES} were there" in epa("again", tmp_path / "six")
    epa("score", tmp_path / "six", "--json", tmp_path / "said.json")
    found = json.loads((tmp_path / "said.json").read_text(encoding="utf-8"))
    assert len(found["cases"]) == CASES
    of_all = scored([(one["truth"], one["said"]) for one in found["cases"]])
    said = [(one["truth"]["kind"], one["said"]["says"]) for one in found["cases"]]
    assert of_all.right >= RIGHT, said
    assert of_all.log_score > LOG_SCORE, said
    assert not [sure for sure, right in of_all.names if sure >= SURE and not right], said
