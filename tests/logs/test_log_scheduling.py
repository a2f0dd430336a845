"""The recorder keeps out of the loop's way."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

REAL_TIME_PRODUCER = """
import os, sys
sys.path.insert(0, sys.argv[1])
from log_samples import LAYOUT
from epa_rt.logs.recorder import Recorder
cores = os.sched_getaffinity(0)
try:
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
except PermissionError:
    print("refused")
    sys.exit()
os.sched_setaffinity(0, {min(cores)})
recorder = Recorder(sys.argv[2], LAYOUT, {}, {}, lossless=False)
recorder.open()
print(os.sched_getscheduler(recorder.pid) == os.SCHED_OTHER)
print(len(cores) == 1 or min(cores) not in os.sched_getaffinity(recorder.pid))
recorder.close("finished", "")
"""


def test_the_recorder_leaves_the_loops_priority_and_core(tmp_path):
    command = [
        sys.executable,
        "-c",
        REAL_TIME_PRODUCER,
        str(Path(__file__).parent),
        str(tmp_path / "log.mcap"),
    ]
    answer = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    if answer == ["refused"]:
        pytest.skip("this user may not take real-time priority")
    assert answer == ["True", "True"]


def test_the_recorder_is_nice_in_real_time_only(open_recorder, tmp_path):
    own = os.getpriority(os.PRIO_PROCESS, 0)
    fast = open_recorder(tmp_path / "simulated.mcap")
    polite = open_recorder(tmp_path / "real_time.mcap", lossless=False)
    assert os.getpriority(os.PRIO_PROCESS, fast.pid) == own
    assert os.getpriority(os.PRIO_PROCESS, polite.pid) == min(own + 10, 19)


def test_the_recorder_has_a_session_of_its_own(open_recorder):
    assert os.getsid(open_recorder().pid) != os.getsid(0)
