"""Processes beside a diagnosis end with it, however it ends, and without a word of their own."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from epa_rt.cli.exits import FAILED, VerbError
from epa_rt.cli.gap.beside import Beside

ROOT = Path(__file__).resolve().parents[2]
ASKS = """
import os, time
from epa_rt.cli.gap.beside import Beside
beside = Beside(1)
print(beside.ask(os.getpid), flush=True)
try:
    beside.ask(time.sleep, 60.0)
except KeyboardInterrupt:
    beside.close()
"""
CASES = """
import signal, sys
from epa_rt.cli.gap.blind.side_by_side import side_by_side
from tests.cli.waiting import its_number
signal.signal(signal.SIGUSR1, signal.default_int_handler)  # Ctrl-C that reaches this one alone
try:
    for number in side_by_side(1, its_number, [(0.0,), (60.0,)], "cases made"):
        print(number, flush=True)
except KeyboardInterrupt:
    sys.exit("stopped")
"""
WORKERS = """
import json, signal, sys, tempfile, threading, time
from pathlib import Path
from epa_rt.benchmark.score import diagnose_all

def says_its_number():
    while not (case / "rig").exists() or not (text := (case / "rig").read_text()):
        time.sleep(0.02)
    print(text, flush=True)

signal.signal(signal.SIGTERM, signal.default_int_handler)  # as epa gap blind has it
with tempfile.TemporaryDirectory() as folder:
    case = Path(folder, "case_000")
    case.mkdir()
    told = {"rig": "rig", "plant": "plant", "logs": [], "holdout": [], "leave_out": []}
    (case / "case.json").write_text(json.dumps(told))
    threading.Thread(target=says_its_number, daemon=True).start()
    try:
        diagnose_all([case], Path(folder), [], "tests.cli.waiting:diagnoser", 1)
    except KeyboardInterrupt:
        sys.exit("stopped")
"""


def ended(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"


@pytest.mark.parametrize(
    ("asking", "number", "ends"),
    [
        (ASKS, signal.SIGINT, 0),
        (ASKS, signal.SIGTERM, -signal.SIGTERM),
        (CASES, signal.SIGKILL, -signal.SIGKILL),
        (CASES, signal.SIGUSR1, 1),
        (WORKERS, signal.SIGTERM, 1),
    ],
)
def test_a_process_beside_ends_with_the_one_that_asked(asking, number, ends):
    """Ctrl-C comes to both at once; the others only to the one that asked."""
    command = [sys.executable, "-c", asking]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=-1, stderr=-1, text=True, start_new_session=True
    ) as asks:
        beside = int(asks.stdout.readline())
        time.sleep(0.2)
        (os.killpg if number == signal.SIGINT else os.kill)(asks.pid, number)
        said = asks.communicate(timeout=30)[1]
        assert asks.returncode == ends
        assert "Traceback" not in said
    until = time.monotonic() + 10.0
    while not ended(beside) and time.monotonic() < until:
        time.sleep(0.02)
    assert ended(beside)


def test_one_that_was_ended_from_outside_is_one_sentence():
    beside = Beside(1)
    try:
        for _ in range(2):
            with pytest.raises(VerbError, match="out of memory") as error:
                beside.ask(os._exit, 9)
            assert error.value.code == FAILED
    finally:
        beside.close()
