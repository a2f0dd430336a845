"""A queue runs unattended, ends at the first trip, and goes on where it was broken off."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from epa_rt.cli.main import main
from epa_rt.config.source import ConfigError
from epa_rt.logs.reader import LogReader
from epa_rt.runs.queue import load_queue
from epa_rt.runs.queue_state import StateError, fresh_state, load_state, save_state, state_path
from tests.runs.series import RIG, ROOT, experiment_file

MOVE = """
experiment: move
loop: motor_speed
phases:
  - {name: out, move: {to: 5 mm, speed: 40 mm/s}}
  - {name: back, move: {to: no_load, speed: 40 mm/s}}
"""
TRIPS = """
experiment: trips
loop: motor_speed
phases:
  - {name: fill, valves: {all: {set: 640 kPa gauge}}, until: valves_settled, timeout: 20 ms}
"""


@pytest.fixture
def queue(tmp_path):
    """Writes a queue file of these experiments; its path."""

    def written(*experiments: str, more: str = "") -> object:
        rows = []
        for i, text in enumerate(experiments):
            (tmp_path / f"e{i}.yaml").write_text(text)
            rows.append(f"  - {{experiment: e{i}.yaml{more}}}\n")
        path = tmp_path / "week.yaml"
        path.write_text(f"queue: week\nrig: {RIG}\nout: logs\nruns:\n{''.join(rows)}")
        return path

    return written


def state(path):
    return json.loads(state_path(path, "sim").read_text())["runs"]


def test_each_run_is_one_log_with_its_id_and_notes_and_a_second_call_runs_nothing(queue, capsys):
    path = queue(MOVE, more=", repeat: 2, notes: muscle 7")
    assert main(["queue", str(path), "--quiet"]) == 0
    logs = sorted((path.parent / "logs").glob("*.mcap"))
    assert [log.name for log in logs] == ["week-001-e0-bench.mcap", "week-002-e0-bench.mcap"]
    ids = []
    for log in logs:
        with LogReader(log) as reader:
            facts = reader.metadata["queue"]
            ids.append(facts["id"])
            assert (facts["notes"], facts["of"]) == ("muscle 7", "2")
            assert reader.metadata["run"]["seed"] == str(len(ids))
    assert len(set(ids)) == 2
    capsys.readouterr()
    assert main(["queue", str(path), "--quiet"]) == 0
    assert "all 2 runs are over" in capsys.readouterr().out
    assert sorted((path.parent / "logs").glob("*.mcap")) == logs


def test_a_preview_moves_nothing_and_says_how_long(queue, capsys):
    path = queue(MOVE, TRIPS)
    assert main(["queue", str(path), "--dry"]) == 0
    said = capsys.readouterr().out
    assert "nothing has moved" in said and "about" in said
    assert max(map(len, said.replace(str(path.parent), "").splitlines())) <= 80
    assert sorted(p.name for p in path.parent.iterdir()) == ["e0.yaml", "e1.yaml", "week.yaml"]


def test_a_trip_ends_the_queue_and_somebody_has_to_look(queue, capsys):
    path = queue(MOVE, TRIPS, MOVE)
    assert main(["queue", str(path), "--quiet"]) == 3
    said = capsys.readouterr().out
    assert "QUEUE STOPPED at run 2 (e1 on bench), tripped: " in said and "\nend: motor" in said
    assert [run["status"] for run in state(path)] == ["completed", "tripped", "waiting"]
    assert main(["queue", str(path), "--quiet"]) == 3
    assert "expected somebody to look at the rig" in capsys.readouterr().err
    assert main(["queue", str(path), "--quiet", "--retry"]) == 3
    assert len(state(path)[1]["logs"]) == 2
    assert main(["queue", str(path), "--quiet", "--skip"]) == 0
    assert [run["status"] for run in state(path)] == ["completed", "skipped", "completed"]


def test_a_trip_that_nobody_wrote_down_is_found_in_its_log(queue, capsys):
    path = queue(TRIPS, MOVE)
    assert main(["queue", str(path), "--quiet", "--operator", "ada", "--note", "by night"]) == 3
    file = state_path(path, "sim")
    killed = json.loads(file.read_text())
    killed["runs"][0] |= {"status": "running", "quiet": None, "cause": "", "end": ""}
    whole = path.parent / "logs/week-001-e0-bench.mcap"
    with LogReader(whole) as reader:
        record = json.loads(reader.attachments["record.json"])
        assert (record["operator"], record["notes"]) == ("ada", ["by night"])
    capsys.readouterr()
    for size in (None, whole.stat().st_size - 100):  # whole, and cut as by a kill
        file.write_text(json.dumps(killed))
        if size is not None:
            os.truncate(whole, size)
        assert main(["queue", str(path), "--quiet"]) == 3
        assert "expected somebody to look at the rig" in capsys.readouterr().err
        assert [run["status"] for run in state(path)] == ["tripped", "waiting"]


def test_a_stop_that_comes_too_late_for_its_run_still_ends_the_queue(queue, capsys, monkeypatch):
    from epa_rt.logs.recorder import Recorder

    close = Recorder.close

    def close_slowly(self, *words):
        os.kill(os.getpid(), signal.SIGINT)  # while the log is being closed
        return close(self, *words)

    monkeypatch.setattr(Recorder, "close", close_slowly)
    path = queue(MOVE, MOVE)
    assert main(["queue", str(path), "--quiet"]) == 130
    assert "QUEUE STOPPED after run 1" in capsys.readouterr().out
    assert [run["status"] for run in state(path)] == ["completed", "waiting"]


def test_one_bad_experiment_in_the_series_and_nothing_moves(queue, capsys):
    path = queue(MOVE, MOVE.replace("motor_speed", "joint_angle"))
    assert main(["queue", str(path), "--quiet"]) == 2
    assert "e1.yaml" in capsys.readouterr().err
    assert not list(path.parent.rglob("*.mcap")) and not list(path.parent.glob("*.json"))


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("experiment: e1.yaml", "experiment: none.yaml", "6: runs[1].experiment"),
        ("experiment: e1.yaml", "experiment: e1.yaml, rig: none.yaml", "6: runs[1].rig"),
        (
            "experiment: e1.yaml",
            "experiment: e1.yaml, options: {plant: none.yaml}",
            "6: runs[1].options.plant",
        ),
        (f"rig: {RIG}", "rig: none.yaml", "2: rig"),
    ],
)
def test_a_file_that_is_not_there_is_told_at_the_line_that_names_it(old, new, place, queue, capsys):
    path = queue(MOVE, TRIPS)
    assert main(["check", str(path)]) == 0, "a queue that names a rig is no rig file"
    capsys.readouterr()
    path.write_text(path.read_text().replace(old, new))
    for words in (["queue", str(path), "--dry"], ["check", str(path)]):
        assert main(words) == 2
        said = " ".join(capsys.readouterr().err.split())
        assert f"{path}:{place}: found no such file as {path.parent / 'none.yaml'}, " in said


def test_an_experiment_file_is_a_queue_of_one(tmp_path):
    path = tmp_path / "next.yaml"
    path.write_text(MOVE)
    words = ["queue", str(path), "--rig", str(RIG), "-o", str(tmp_path / "out"), "--quiet"]
    assert main(words) == 0
    assert (tmp_path / "out/move-001-next-bench.mcap").exists()
    with pytest.raises(ConfigError, match="an experiment without a rig"):
        load_queue(path)


def test_runs_that_have_begun_stay_as_they_were_and_later_ones_may_change(queue, tmp_path):
    path = queue(MOVE, TRIPS)
    first = load_queue(path)
    done = fresh_state(first)
    done = done.with_run(1, done.runs[0].model_copy(update={"status": "completed"}))
    file = tmp_path / "state.json"
    save_state(file, done)
    path.write_text(path.read_text() + "  - {experiment: e1.yaml}\n")
    assert [run.status for run in load_state(file, load_queue(path)).runs] == [
        "completed",
        "waiting",
        "waiting",
    ]
    path.write_text(path.read_text().replace("e0.yaml", "e1.yaml"))
    with pytest.raises(StateError, match="as run 1"):
        load_state(file, load_queue(path))
    for damaged in ("", "{", "[]", '{"queue": 1}', "[" * 10_000):
        file.write_text(damaged)
        with pytest.raises(StateError, match="damaged"):
            load_state(file, first)


def test_a_queue_killed_with_its_recorder_goes_on_with_what_its_log_lacks(tmp_path):
    experiment_file(tmp_path)
    path = tmp_path / "night.yaml"
    path.write_text(
        f"queue: night\nrig: {RIG}\nout: logs\nruns:\n"
        "  - {experiment: three.yaml, options: {speed: 4}}\n"
    )
    command = [sys.executable, "-m", "epa_rt", "queue", str(path), "--quiet"]
    process = subprocess.Popen(command, cwd=ROOT, start_new_session=True, stdout=subprocess.DEVNULL)
    log = tmp_path / "logs/night-001-three-bench.mcap"
    try:
        while process.poll() is None and not (log.exists() and _trials(log) >= 1):
            time.sleep(0.1)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    assert [run["status"] for run in state(path)] == ["running"]
    done = _trials(log)
    assert 1 <= done < 3
    assert main(["queue", str(path), "--quiet"]) == 0
    assert [run["status"] for run in state(path)] == ["completed"]
    assert _trials(tmp_path / "logs/night-001-three-bench-2.mcap") == 3 - done


def _trials(log) -> int:
    """Trials that ended as planned; 0 of a file that has only begun."""
    try:
        with LogReader(log) as reader:
            ends = [e for e in reader.events() if e.kind == "phase_end"]
    except Exception:  # its head is being written
        return 0
    return sum(e.text.startswith("trial") for e in ends)
