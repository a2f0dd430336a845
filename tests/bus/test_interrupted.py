"""Ctrl-C under `epa bus run` reaches the command, which ends its run in its own way."""

import os
import signal
import subprocess
import sys
import time

import pytest

from epa_rt.logs.reader import LogReader
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT

RIG = RIGS / "bench.yaml"


@pytest.mark.network
def test_a_run_that_is_interrupted_under_the_bus_ends_at_rest(tmp_path):
    epa = [sys.executable, "-m", "epa_rt"]
    run = [*epa, "run", EXPERIMENTS / "identification.yaml", "--rig", RIG, "--quiet"]
    process = subprocess.Popen(
        [*epa, "bus", "run", "--lock-step", "--rig", RIG, "--"]
        + [*run, "--backend", "ethercat", "-o", tmp_path],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,  # a group of its own, as a terminal's foreground has
    )
    while process.poll() is None and not any(
        log.stat().st_size > 100_000 for log in tmp_path.glob("*.mcap")
    ):
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    said, _ = process.communicate(timeout=120)
    assert process.returncode == 130 and "stopped: the operator asked to stop" in said, said
    assert "at rest; vented); drive off" in said
    (path,) = tmp_path.glob("*.mcap")
    with LogReader(path) as log:
        assert log.ending is not None and log.ending.outcome == "stopped"
