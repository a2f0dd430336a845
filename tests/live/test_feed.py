"""The recorder's side of a live view: what viewers get, and what they cannot do to the log."""

import json
import os
import signal
import stat
import tempfile
import time
from pathlib import Path

import pytest

from epa_rt.live.attach import Answer, Attached, NotOn, find
from epa_rt.logs.feed.client import ROWS_WAITING_BYTES
from epa_rt.logs.feed.feed import MOST_CLIENTS
from epa_rt.logs.feed.place import own_folder, sockets
from epa_rt.logs.feed.wire import WireError, request
from epa_rt.logs.reader import LogReader
from epa_rt.loop.requests import NONE, STOP, STOP_AT_ONCE, OperatorRequests
from epa_rt.loop.viewers import ViewerRequests
from tests.live.feeding import Reader, raw_viewer, recorder_at, sample

SAMPLES = 20_000


@pytest.fixture
def runtime(monkeypatch):
    """A runtime folder of this test's own; its path is short enough for a socket."""
    with tempfile.TemporaryDirectory() as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        yield Path(folder)


def test_a_viewer_gets_every_cycle_and_every_event_in_order_and_then_the_end(tmp_path, runtime):
    log = tmp_path / "log.mcap"
    recorder = recorder_at(log, lossless=True)
    recorder.event(0, 0, "state", "bring_up")  # before the viewer comes
    reader = Reader(log)
    for cycle in range(SAMPLES):
        sample(recorder, cycle)
        if cycle % 500 == 0:
            recorder.event(cycle, cycle, "phase", str(cycle))
            reader.take()
    reader.take_all(recorder)
    assert reader.cycles == list(range(SAMPLES)) and not reader.attached.skipped_rows
    assert [event.number for event in reader.events] == list(range(1, SAMPLES // 500 + 3))
    assert reader.events[-1].kind == "end" and reader.over.is_said
    assert not sockets(log), "the socket is left"


def test_a_viewer_that_hangs_loses_rows_that_are_counted_and_no_event(tmp_path, runtime):
    log = tmp_path / "log.mcap"
    recorder = recorder_at(log, lossless=True)
    reader = Reader(log)
    for cycle in range(SAMPLES):
        sample(recorder, cycle)
        if cycle % 500 == 0:
            recorder.event(cycle, cycle, "trip", f"cause {cycle}")
    while recorder._ring.words[8] != recorder._ring.words[0]:  # all is taken from the ring
        time.sleep(0.01)
    reader.take()  # it hung until now
    summary = reader.take_all(recorder)
    assert summary.samples == SAMPLES and summary.failure is None
    lost = SAMPLES - len(reader.cycles)
    assert lost > 0 and lost == reader.attached.skipped_rows
    assert len(reader.cycles) * 256 < 2 * ROWS_WAITING_BYTES
    assert [event.number for event in reader.events] == list(range(1, SAMPLES // 500 + 2))


@pytest.mark.parametrize(
    "hostile",
    [
        b"x" * 3_000_000,
        b"\n" * 100_000,
        b'{"ask": "mark"}\n' * 5000,
        b"[" * 1500 + b"\n",
        b'{"ask": "stop", "text": 7, "who": []}\n{"ask": "fly"}\n\xff\xfe\n',
    ],
    ids=["endless line", "empty lines", "flood", "nested", "nonsense"],
)
def test_a_viewer_that_floods_is_dropped_or_answered_and_the_log_is_whole(
    hostile, tmp_path, runtime
):
    log = tmp_path / "log.mcap"
    recorder = recorder_at(log, lossless=True)
    viewer = raw_viewer(log)
    viewer.settimeout(0.2)
    for cycle in range(2000):
        sample(recorder, cycle)
    try:
        viewer.sendall(hostile)
    except OSError:
        pass  # dropped, or not read any faster
    for cycle in range(2000, 4000):
        sample(recorder, cycle)
    summary = recorder.close("completed", "")
    viewer.close()
    assert summary.samples == 4000 and summary.failure is None
    with LogReader(log) as found:
        assert not found.missing


def test_viewers_that_die_and_too_many_of_them_cost_nothing(tmp_path, runtime):
    log = tmp_path / "log.mcap"
    recorder = recorder_at(log, lossless=True)
    viewers = [raw_viewer(log) for _ in range(3 * MOST_CLIENTS)]
    for cycle in range(3000):
        sample(recorder, cycle)
        if cycle % 100 == 0 and viewers:
            viewers.pop().close()
    last = _reader_with_room(log)
    recorder.event(3000, 0, "phase", "seen by who came last")
    summary = last.take_all(recorder)
    assert summary.samples == 3000
    assert "phase" in [event.kind for event in last.events]


def _reader_with_room(log) -> Reader:
    """Those that died before may still stand in line."""
    end_s = time.monotonic() + 60.0
    while True:
        try:
            return Reader(log)
        except NotOn as error:
            assert "as many viewers" in str(error) and time.monotonic() < end_s
        time.sleep(0.02)


def test_the_socket_is_this_users_alone(tmp_path, runtime):
    recorder = recorder_at(tmp_path / "log.mcap", lossless=True)
    path = find(tmp_path / "log.mcap")
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    recorder.close("completed", "")


def test_a_folder_that_others_may_enter_is_not_taken(tmp_path, runtime, monkeypatch):
    (runtime / "epa_rt").mkdir(mode=0o755)
    (runtime / "epa_rt").chmod(0o755)
    monkeypatch.setattr(
        "epa_rt.logs.feed.place.folders", lambda: [runtime / "epa_rt"], raising=True
    )
    with pytest.raises(OSError, match="this user alone"):
        own_folder()


def test_a_run_is_found_by_log_folder_or_alone_and_one_that_is_over_is_said(
    tmp_path, runtime, monkeypatch
):
    # other tests' runs are on as well, in the other folders that are looked into
    monkeypatch.setattr("epa_rt.logs.feed.place.folders", lambda: [runtime / "epa_rt"])
    log, other = tmp_path / "a.mcap", tmp_path / "b.mcap"
    first = recorder_at(log, lossless=True)
    link = tmp_path / "link.mcap"
    link.symlink_to(log)
    assert find(log) == find(link) == find(tmp_path) == find(None)
    second = recorder_at(other, lossless=True)
    with pytest.raises(NotOn, match="found 2 runs"):
        find(None)
    second.close("completed", "")
    os.kill(first.pid, signal.SIGKILL)  # what it left is not taken for a run
    os.waitid(os.P_PID, first.pid, os.WEXITED | os.WNOWAIT)
    first.close("completed", "")
    for gone in (log, other):
        with pytest.raises(NotOn, match="the run is over"):
            find(gone)
    with pytest.raises(NotOn, match="no such log"):
        find(tmp_path / "c.mcap")
    with pytest.raises(NotOn, match="found no run"):
        find(None)


def test_a_log_without_a_place_for_its_socket_is_recorded_all_the_same(
    tmp_path, runtime, monkeypatch
):
    blocked = runtime / "epa_rt"
    blocked.write_text("in the way")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    recorder = recorder_at(tmp_path / "log.mcap", lossless=True)
    sample(recorder, 0)
    assert recorder.close("completed", "").samples == 1


@pytest.mark.parametrize("line", [b"", b"[]", b'{"ask": "fly"}', b'{"ask": ["stop"]}', b"\xff"])
def test_what_is_no_request_is_refused(line):
    with pytest.raises(WireError):
        request(line)


def test_a_request_steers_no_terminal():
    asked = request(json.dumps({"ask": "mark", "text": "a\x1b[2J\nb" + "c" * 999}).encode())
    assert asked["text"].isprintable() and len(asked["text"]) <= 200


def test_requests_of_viewers_reach_the_loop_and_marks_are_events(tmp_path, runtime):
    requests = OperatorRequests()
    viewers = ViewerRequests(requests)
    log = tmp_path / "log.mcap"
    recorder = recorder_at(log, lossless=True, asks_fd=viewers.recorders_fd)
    with Attached(find(log)) as viewer, viewers.taken():
        assert viewer.facts.takes_requests and requests.poll(0) == NONE
        viewer.ask("mark", "here", "me")
        _wait(lambda: requests.poll(1) or requests.log)
        assert requests.log == [("mark", "here", {"who": "me"})] and requests.poll(2) == NONE
        viewer.ask("stop", who="me")
        _wait(lambda: requests.poll(3) == STOP)
        for again in (4000, 8000):  # a key that is held down asks again and again
            time.sleep(0.06)
            viewer.ask("stop")
            _wait_for_answer(viewer)
            assert requests.poll(again) == STOP
        viewer.ask("stop_at_once", who="me")
        _wait(lambda: requests.poll(8001) == STOP_AT_ONCE)
    assert [text for _, text, _ in requests.log[1:]] == [
        "stop, asked by me",
        "stop at once, asked by me",
    ]
    recorder.close("stopped", "")


def test_the_loop_outlives_the_recorder_on_the_path_of_requests(tmp_path, runtime):
    requests = OperatorRequests()
    viewers = ViewerRequests(requests)
    recorder = recorder_at(tmp_path / "log.mcap", lossless=True, asks_fd=viewers.recorders_fd)
    before = signal.getsignal(signal.SIGIO)
    with viewers.taken():
        os.kill(recorder.pid, signal.SIGKILL)
        os.waitid(os.P_PID, recorder.pid, os.WEXITED | os.WNOWAIT)
        assert requests.poll(0) == NONE
    assert signal.getsignal(signal.SIGIO) is before
    assert "died" in (recorder.close("failed", "").failure or "")


def _wait(holds) -> None:
    end_s = time.monotonic() + 60.0
    while not holds():
        assert time.monotonic() < end_s, "waited in vain"
        time.sleep(0.005)


def _wait_for_answer(viewer: Attached) -> None:
    _wait(lambda: any(isinstance(found, Answer) for found in viewer.messages(0.1)))
