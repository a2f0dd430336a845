"""The ring: it wraps, it waits or it counts."""

import contextlib
import os
import signal

import pytest
from log_samples import sample_of, wait_for_end

import epa_rt.logs.recorder
import epa_rt.logs.recorder_child
from epa_rt.logs.reader import LogReader
from epa_rt.logs.ring import Ring

SLOTS = 64


@pytest.fixture
def stopped():
    """Stops recorder processes for a while, as a disk that hangs would."""
    pids = []

    def stop(pid):
        os.kill(pid, signal.SIGSTOP)
        os.waitid(os.P_PID, pid, os.WSTOPPED | os.WNOWAIT)
        pids.append(pid)

    yield stop
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)


@pytest.mark.parametrize("how", [{}, {"lossless": False, "may_wait": True}], ids=str)
def test_a_small_ring_loses_nothing_where_it_may_wait(open_recorder, tmp_path, how):
    recorder = open_recorder(slots=SLOTS, **how)
    for cycle in range(3000):
        recorder.sample(**sample_of(cycle))
    assert recorder.failure is None
    assert recorder.close("finished", "").samples == 3000
    with LogReader(tmp_path / "log.mcap") as log:
        assert log.columns("/cycle", ["cycle"])["cycle"].tolist() == list(range(3000))


def test_an_event_larger_than_the_ring_goes_through_where_it_may_wait(open_recorder, tmp_path):
    text = "x" * 100_000
    recorder = open_recorder(slots=SLOTS)
    recorder.event(1, 2, "request", text)
    recorder.close("finished", "")
    with LogReader(tmp_path / "log.mcap") as log:
        assert log.events()[0].text == text


def test_samples_that_find_the_ring_full_are_dropped_and_counted(open_recorder, stopped, tmp_path):
    recorder = open_recorder(slots=SLOTS, lossless=False)
    stopped(recorder.pid)
    for cycle in range(SLOTS + 5):
        assert recorder.failure is None or cycle > SLOTS
        recorder.sample(**sample_of(cycle))
    recorder.event(1, 1, "valve", "one too many")
    assert recorder.failure == "recorder lost 1 sample: its buffer was full"
    os.kill(recorder.pid, signal.SIGCONT)
    summary = recorder.close("tripped", "recorder")
    assert (summary.samples, summary.lost_samples, summary.lost_events) == (SLOTS, 5, 1)
    assert summary.failure == "recorder lost 5 samples and 1 event: its buffer was full"
    with LogReader(tmp_path / "log.mcap") as log:
        assert log.columns("/cycle", ["cycle"])["cycle"].tolist() == list(range(SLOTS))
        assert log.missing == [
            "5 samples and 1 events were lost while recording: the recorder could not keep up"
        ]


def test_waiting_ends_when_the_recorder_dies(open_recorder):
    recorder = open_recorder(slots=SLOTS)
    os.kill(recorder.pid, signal.SIGKILL)
    wait_for_end(recorder.pid)
    for cycle in range(SLOTS + 3):
        recorder.sample(**sample_of(cycle))
    assert recorder.failure == "recorder died (signal 9)"
    # those that wait in the ring for a dead recorder are lost as well
    assert recorder.close("tripped", "recorder").lost_samples == SLOTS + 3


def test_waiting_ends_when_the_recorder_hangs(open_recorder, stopped, monkeypatch):
    monkeypatch.setattr(epa_rt.logs.recorder, "_STUCK_AFTER_S", 0.01)
    monkeypatch.setattr(epa_rt.logs.recorder_child, "CLOSE_TIMEOUT_S", 0.01)
    recorder = open_recorder(slots=SLOTS)
    stopped(recorder.pid)
    for cycle in range(SLOTS + 2):
        recorder.sample(**sample_of(cycle))
    assert recorder.failure == "recorder lost 2 samples: its buffer was full"
    summary = recorder.close("tripped", "recorder")
    assert (summary.failure, summary.lost_samples) == (
        "recorder did not finish the log within 0.01 s",
        SLOTS + 2,  # those in the ring of a recorder that had to be killed are lost as well
    )


def test_a_ring_has_a_power_of_two_of_slots():
    with pytest.raises(ValueError, match="found 100 slots, expected a power of two"):
        Ring.create(100, 64)
