"""Cases of spent evaluation sets, and of the leave-one-out matrix (seed 7), that a rule of the
diagnosis was made for: recorded anew and diagnosed whole.

Minutes each: ``scripts/test.sh -m slow tests/benchmark/test_spent_cases.py``.
"""

import os
from pathlib import Path

import pytest

from epa_rt.benchmark.figures import block_said, named, wrong
from epa_rt.cli.gap.blind.diagnose import diagnose_files
from epa_rt.cli.gap.blind.make import _one
from sim_backend.stand_in.draw import draw, one_of_each

CONFIG = Path(__file__).resolve().parents[2] / "config"
FIFTH, SEVENTH, EIGHTH, NINTH, MATRIX = 550127, 720466, 835207, 914627, 7
CASES = {
    "a late command is no encoder age that breaks the motor's balances": (MATRIX, 0),
    "a spool that is not round is the transmission's, not the drive's": (MATRIX, 12),
    "pressure in the force cell is the sensors'": (MATRIX, 50),
    "a gauge's lag hides in no nominal parameter": (FIFTH, 21),
    "a leaning frame is no spring that pushes": (FIFTH, 40),
    "an encoder 0.08 ms old hides no friction beside it": (FIFTH, 54),
    "what follows its commands to the noise is named": (FIFTH, 59),
    "friction swings three times to a turn of the spool": (EIGHTH, 8),
    "a strap of which no block's word is left is no name for a soft braid": (EIGHTH, 47),
    "zeros that leave a twelfth of free run are no names for a leaning frame": (EIGHTH, 72),
    "play has round flanks, and its strap a speed at them": (SEVENTH, 71),
    "low-speed friction peaks over decades": (SEVENTH, 62),
    "a thick strap winds up on its spool": (NINTH, 9),
    "magnets warm with the housing": (NINTH, 26),
    "creep relaxes over three decades": (EIGHTH, 115),
    "a strap that gives way is not in the gas": (NINTH, 50),
    "a joint's zero is no lock and spring": (NINTH, 55),
}


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(("seed", "index"), CASES.values(), ids=CASES)
def test_is_answered_rightly(seed, index, tmp_path, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", os.environ.get("OMP_NUM_THREADS", "1"))
    specs = one_of_each() if seed == MATRIX else draw(seed, 120)
    spec = next(spec for spec in specs if spec.index == index)
    (tmp_path / "parts").mkdir()
    truth = _one(seed, spec, tmp_path, CONFIG, tmp_path / "parts")
    folder = tmp_path / f"case_{index:03d}"
    answer = diagnose_files(
        folder / "rig.yaml",
        folder / "plant.yaml",
        sorted((folder / "logs").glob("*.mcap")),
        sorted((folder / "holdout").glob("*.mcap")),
        truth["leave_out"],
    ).as_json()
    assert not wrong(truth, answer), (
        answer["verdict"],
        [one["name"] for one in named(answer)],
        block_said(answer),
        truth["effects"],
    )
