"""Either process killed: the other notices, and the log says why it ends."""

import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

from log_samples import sample_of, wait_for_end

from epa_rt.logs.reader import LogReader

PRODUCER = """
import sys, time
sys.path.insert(0, sys.argv[1])
from log_samples import ATTACHMENTS, LAYOUT, METADATA, sample_of
from epa_rt.logs.recorder import Recorder
recorder = Recorder(sys.argv[2], LAYOUT, ATTACHMENTS, METADATA, lossless=sys.argv[3] == "lossless")
recorder.open()
for cycle in range(3000):
    recorder.sample(**sample_of(cycle))
print(recorder.pid, flush=True)
time.sleep(600)
"""


def kill_producer(path: Path, mode: str) -> None:
    """Have a process record 3000 samples, kill it, and wait until its recorder has ended too."""
    command = [sys.executable, "-c", PRODUCER, str(Path(__file__).parent), str(path), mode]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as producer:
        recorder = os.pidfd_open(int(producer.stdout.readline()))
        try:
            producer.kill()
            assert select.select([recorder], [], [], 60)[0], "the recorder outlived the loop"
        finally:
            os.close(recorder)


def test_the_recorder_closes_the_log_when_the_loop_is_killed(tmp_path):
    for mode in ("lossless", "real time"):
        path = tmp_path / f"{mode}.mcap"
        kill_producer(path, mode)
        with LogReader(path) as log:
            assert log.columns("/cycle", ["cycle"])["cycle"].tolist() == list(range(3000))
            assert (log.outcome, log.missing) == ("died", [])
            assert log.events()[-1].kind == "trip"
            assert (
                log.events()[-1].text
                == log.ending.cause
                == "loop process died; the last recorded cycle is 2999"
            )


def test_the_loop_hears_at_once_of_a_recorder_that_was_killed(open_recorder, tmp_path):
    recorder = open_recorder()
    for cycle in range(5000):
        recorder.sample(**sample_of(cycle))
    os.kill(recorder.pid, signal.SIGKILL)
    wait_for_end(recorder.pid)
    calls = next(call for call in range(1, 201) if recorder.failure)
    assert calls <= 64
    assert recorder.failure == "recorder died (signal 9)"
    summary = recorder.close("tripped", "recorder died")
    assert summary.failure == "recorder died (signal 9)"
    with LogReader(tmp_path / "log.mcap") as log:
        there = len(log.columns("/cycle")["cycle"])
        assert log.outcome == "tripped" and log.ending.failure == summary.failure
        assert log.ending.lost_samples == summary.lost_samples == 5000 - there > 0
        assert summary.samples == there
        assert "no footer" in log.missing[-2]
        assert log.missing[-1].startswith(f"{5000 - there} samples and 1 events were lost while")


def test_neither_interrupt_nor_terminate_stops_the_recorder(open_recorder):
    recorder = open_recorder()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        os.kill(recorder.pid, number)
    recorder.sample(**sample_of(0))
    assert recorder.close("finished", "").samples == 1
    assert recorder.failure is None


def test_samples_in_real_time_reach_the_file_though_no_chunk_is_full(open_recorder, tmp_path):
    recorder = open_recorder(lossless=False)
    recorder.sample(**sample_of(0))
    for _ in range(600):  # bounded, and done as soon as the sample is there
        with LogReader(tmp_path / "log.mcap") as log:
            if len(log.columns("/cycle", ["cycle"])["cycle"]):
                return
        time.sleep(0.05)
    raise AssertionError("the sample never reached the file")
