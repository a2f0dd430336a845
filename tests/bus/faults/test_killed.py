"""kill -9 of the master mid-motion: the slaves' own watchdogs make the rig safe, the recorder closes the log."""

import json
import os
import subprocess
import sys

import pytest

from tests.bus.faults.runs import ROOT, UNSHARE, why_not
from tests.bus.faults.scenarios import WATCHDOG_CYCLES

pytestmark = [pytest.mark.skipif(why_not() is not None, reason=f"no network of one's own: {why_not()}"), pytest.mark.timeout(300)]


def test_a_master_that_is_killed_leaves_the_rig_to_the_watchdogs_and_the_log_to_the_recorder():
    done = subprocess.run([*UNSHARE, sys.executable, "-W", "error", "-m", "tests.bus.faults.killed"], cwd=ROOT, capture_output=True, text=True, timeout=280,
                          check=False, env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert done.returncode == 0, done.stderr[-3000:]
    facts = json.loads(done.stdout.splitlines()[-1])
    assert facts["was_on"] and facts["was_moving"] and facts["was_holding"]
    assert 95 <= facts["safe_at"] - facts["last_frame_cycle"] <= WATCHDOG_CYCLES + 3  # in the emulator's own time; a step is cut up where it had to wait
    assert facts["missing"] == []
    assert "died" in " ".join([facts["cause"], *facts["texts"]])
