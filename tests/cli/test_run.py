"""epa run from the outside: exit codes, logs, interruptions."""

import json
import os
import subprocess
import sys

import pytest

from epa_rt.cli.main import main
from epa_rt.logs.reader import LogReader
from epa_rt.logs.recorder import Recorder
from epa_rt.realtime.signal_sets import IGNORED, OPERATOR_STOPS
from tests.cli.shell import (
    EXPERIMENTS,
    RIGS,
    ROOT,
    children_of,
    epa,
    epa_here,
    gone,
    paced_run,
    signal,
    start,
    wait_for,
)

SAFE = 5  # state index


def only_log(folder):
    logs = list(folder.glob("*.mcap"))
    assert len(logs) == 1
    return logs[0]


def assert_safe_end(reader: LogReader) -> None:
    _, outputs = reader.raw()
    assert not outputs[-1].any(), "de-energised is safe"
    assert reader.layout.states[int(reader.columns("/cycle")["state"][-1])] == "done"


def run_knee(of, log, seed):
    """A short chirp of the simulated knee, by ``epa`` or ``epa_here``."""
    knee = ("--rig", RIGS / "knee.yaml", "--seed", seed, "-o", log, "--quiet")
    done = of("run", EXPERIMENTS / "knee_chirp_short.yaml", *knee)
    assert done.returncode == 0, done.stderr
    return log


@pytest.fixture(scope="module")
def knee_log(tmp_path_factory):
    """A run with seed 1 in a process of its own."""
    return run_knee(epa, tmp_path_factory.mktemp("knee") / "a.mcap", 1)


def test_the_same_seed_gives_the_same_rows_twice_and_another_seed_others(knee_log, tmp_path):
    """All of the file but the record of who ran it: tests/runs/test_record.py."""
    rows = []
    for path in (knee_log, *(run_knee(epa_here, tmp_path / f"{n}.mcap", n) for n in (1, 2))):
        with LogReader(path) as log:
            found = {
                **log.columns("/cycle", ["inputs_raw", "outputs_raw"]),
                **log.columns("/measured"),
            }
            rows.append([column.tobytes() for column in found.values()])
    assert rows[0] == rows[1]
    assert rows[0] != rows[2]


def test_how_long_a_run_takes_is_said_before_it_starts(tmp_path, monkeypatch, capsys):
    path = tmp_path / "rest.yaml"
    path.write_text(
        "experiment: rest\nloop: motor_speed\nphases:\n  - {name: short, for: 2 s}\n"
        "  - {name: hold, for: 5 h}\n"
    )
    takes, rig = "about 5 h 0 min; longest phase: hold, 5 h 0 min\n", str(RIGS / "bench.yaml")
    assert main(["check", str(path), "--rig", rig]) == 0
    assert capsys.readouterr().out == f"{path}: experiment rest on bench, 2 phases, {takes}"
    monkeypatch.setattr("epa_rt.cli.run.run_simulated", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["run", str(path), "--rig", rig, "-o", str(tmp_path)])
    assert capsys.readouterr().err == f"rest takes {takes}"
    path.write_text(path.read_text().replace("  - {name: hold, for: 5 h}\n", ""))
    assert main(["check", str(path), "--rig", rig]) == 0
    assert " on bench, 1 phase, about 2.0 s; longest " in capsys.readouterr().out
    assert main(["run", str(path), "--rig", rig, "--dry", "-o", str(tmp_path)]) == 0
    assert "about 2.000 s in 1 phase, 0 of them trials" in capsys.readouterr().out


def test_a_log_is_never_overwritten(tmp_path):
    log = tmp_path / "kept.mcap"
    log.write_text("precious")
    done = epa_here("run", EXPERIMENTS / "step.yaml", "--rig", RIGS / "bench.yaml", "-o", log)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1 and "kept.mcap" in done.stderr  # and no word of the plant
    assert log.read_text() == "precious"


def test_a_paced_simulation_waits_for_its_recorder(tmp_path, monkeypatch):
    """Its plant stands still meanwhile, so a slow disk or a busy machine costs time and no row."""
    monkeypatch.setitem(Recorder.__init__.__kwdefaults__, "slots", 16)  # full within a millisecond
    words = ("jog", "--rig", str(RIGS / "bench.yaml"), "--wait", "1 s", "--speed", "20")
    main([*words, "-o", str(tmp_path), "--quiet"])  # a busy machine may end it as late: exit 3
    with LogReader(only_log(tmp_path)) as log:
        cycles = log.columns("/cycle", ["cycle"])["cycle"].tolist()
        assert len(cycles) > 100 and cycles == list(range(len(cycles)))
        assert log.missing == []


SHORT = """
experiment: short
loop: motor_speed
seed: 1
phases:
  - {name: rest, for: 2 s}
"""


def test_two_runs_at_once_into_one_folder_are_two_logs(tmp_path):
    (tmp_path / "short.yaml").write_text(SHORT)
    words = ("run", tmp_path / "short.yaml", "--rig", RIGS / "bench.yaml", "-o", tmp_path)
    words = (*words, "--quiet", "--seed")
    runs = [start(*words, seed) for seed in (1, 2)]
    for process in runs:
        out, err = process.communicate(timeout=600)
        assert process.returncode == 0, (out, err)
    logs = sorted(tmp_path.glob("*.mcap"))
    assert len(logs) == 2
    seeds = set()
    for log in logs:
        with LogReader(log) as reader:
            assert (reader.outcome, reader.missing) == ("completed", [])
            seeds.add(reader.metadata["run"]["seed"])
    assert seeds == {"1", "2"}


def test_a_link_into_nowhere_is_a_name_that_is_taken(tmp_path):
    log = tmp_path / "link.mcap"
    log.symlink_to(tmp_path / "elsewhere.mcap")
    done = epa_here("run", EXPERIMENTS / "step.yaml", "--rig", RIGS / "bench.yaml", "-o", log)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert not (tmp_path / "elsewhere.mcap").exists()


MIXED = """
experiment: mixed
loop: motor_speed
seed: 1
phases:
  - {name: a, move: {to: 3 mm, speed: 40 mm/s}}
  - {name: b, loop: motor_torque, step: {levels: [5 mNm], rise: 100 ms, dwell: 1 s, times: 1}}
"""


@pytest.mark.parametrize("words", [("check",), ("run", "--dry"), ("run",)])
def test_loops_that_need_different_drive_modes_are_refused_by_every_verb(words, tmp_path):
    (tmp_path / "mixed.yaml").write_text(MIXED)
    out = () if words == ("check",) else ("-o", tmp_path / "out")
    done = epa_here(*words, tmp_path / "mixed.yaml", "--rig", RIGS / "bench.yaml", *out)
    assert done.returncode == 2 and "different drive modes" in done.stderr
    assert not list(tmp_path.rglob("*.mcap"))


def test_a_terminal_without_the_characters_gets_the_table_all_the_same(tmp_path):
    plain = os.environ | {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    done = epa(
        "run",
        EXPERIMENTS / "step.yaml",
        "--rig",
        RIGS / "bench.yaml",
        "--dry",
        "-o",
        tmp_path,
        env=plain,
    )
    assert done.returncode == 0, done.stderr
    assert "within every limit" in done.stdout


def test_schemas_that_cannot_be_written_are_said_so(tmp_path):
    (tmp_path / "file").write_text("")
    done = epa_here("schema", "-o", tmp_path / "file")
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "file, in which nothing can be written (" in done.stderr


@pytest.mark.parametrize(
    "number", [signal.SIGINT, signal.SIGTERM, pytest.param(signal.SIGHUP, marks=pytest.mark.slow)]
)
def test_a_signal_ends_the_run_safe_and_the_log_whole(number, tmp_path):
    process = paced_run(tmp_path)
    process.send_signal(number)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 130, (out, err)
    assert "stopped" in out and "drive off" in out
    with LogReader(only_log(tmp_path)) as reader:
        assert (reader.outcome, reader.missing) == ("stopped", [])
        assert_safe_end(reader)


def test_signals_without_a_meaning_and_ctrl_z_do_not_end_or_freeze_a_run_and_sigquit_stops_it(
    tmp_path,
):
    process = paced_run(tmp_path)
    size = only_log(tmp_path).stat().st_size
    for number in (*IGNORED, signal.SIGTSTP):
        process.send_signal(number)
    for pid in children_of(process.pid):  # the recorder is as hard of hearing
        for number in (*IGNORED, *OPERATOR_STOPS, signal.SIGTSTP):
            os.kill(pid, number)
    wait_for(
        lambda: process.poll() is not None or only_log(tmp_path).stat().st_size > size + 60_000
    )
    assert process.poll() is None
    process.send_signal(signal.SIGQUIT)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 130, (out, err)
    assert err.count("Ctrl-Z is refused while a run is on") == 1
    assert "SIGQUIT: stopping; again after 0.3 s: power off at once" in err
    with LogReader(only_log(tmp_path)) as reader:
        assert (reader.outcome, reader.missing) == ("stopped", [])
        assert_safe_end(reader)


def test_a_loop_that_is_killed_leaves_a_log_that_says_so(tmp_path):
    process = paced_run(tmp_path)
    recorders = children_of(process.pid)
    process.kill()
    process.communicate(timeout=300)
    wait_for(lambda: all(gone(pid) for pid in recorders))
    with LogReader(only_log(tmp_path)) as reader:
        assert reader.missing == []
        assert any("died" in event.text for event in reader.events())
        assert reader.columns("/cycle")["cycle"].size > 500


def test_a_recorder_that_is_killed_ends_the_run_safe(tmp_path):
    process = paced_run(tmp_path)
    for pid in children_of(process.pid):
        os.kill(pid, signal.SIGKILL)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 3, (out, err)
    assert "recorder" in out and "drive off" in out
    with LogReader(only_log(tmp_path)) as reader:
        there = reader.columns("/cycle")["cycle"].size
        assert there > 0 and reader.outcome == "tripped"
        lost = f"LOST: {reader.ending.lost_samples} samples are not in the log"
        assert lost in out and reader.ending.lost_samples > 0
        assert f"({there} cycles" not in out and "no footer" in reader.missing[-2]


def test_a_full_disk_ends_the_run_safe_and_leaves_what_was_written(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    private = ["unshare", "--user", "--map-root-user", "--mount"]
    if (
        subprocess.run(
            [*private, "mount", "-t", "tmpfs", "none", disk], capture_output=True
        ).returncode
        != 0
    ):
        pytest.skip(
            "this kernel does not let an ordinary user mount a small disk of its own (unshare"
            " --mount)"
        )
    script = (
        f"mount -t tmpfs -o size=400k none {disk}; {sys.executable} -m epa_rt run"
        f" {EXPERIMENTS}/knee_chirp_short.yaml --rig {RIGS}/knee.yaml -o {disk} --quiet; code=$?;"
        f" cp {disk}/*.mcap {tmp_path}; exit $code"
    )
    done = subprocess.run(
        [*private, "sh", "-c", script], cwd=ROOT, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 3, (done.stdout, done.stderr)
    assert "no space left" in done.stdout and "drive off" in done.stdout
    with LogReader(only_log(tmp_path)) as reader:
        assert reader.columns("/cycle")["cycle"].size > 0
        assert f"LOST: {reader.ending.lost_samples} samples are not in the log" in done.stdout
        assert reader.outcome == "tripped" and "no space left" in reader.missing[0]
        assert any(event.kind == "trip" for event in reader.events())


def test_a_run_that_trips_says_the_cause_and_exits_with_three(tmp_path):
    text = (
        (RIGS / "bench.yaml").read_text().replace("limits: [-40 N, 350 N]", "limits: [-40 N, 30 N]")
    )
    text = text.replace("../plants/bench.yaml", str(RIGS.parent / "plants/bench.yaml"))
    (tmp_path / "weak.yaml").write_text(text)
    done = epa_here(
        "run",
        EXPERIMENTS / "identification_short.yaml",
        "--rig",
        tmp_path / "weak.yaml",
        "-o",
        tmp_path,
        "--quiet",
    )
    assert done.returncode == 3
    assert "over-force: muscle_force_n" in done.stdout
    with LogReader(only_log(tmp_path)) as reader:
        assert reader.outcome == "tripped"
        assert any(
            event.kind == "trip" and event.data["cause"] == "over-force"
            for event in reader.events()
        )
        assert_safe_end(reader)


def test_the_log_carries_its_files_and_its_code(knee_log):
    with LogReader(knee_log) as reader:
        assert reader.attachments["rig.yaml"] == (RIGS / "knee.yaml").read_bytes()
        assert (
            reader.attachments["experiment.yaml"]
            == (EXPERIMENTS / "knee_chirp_short.yaml").read_bytes()
        )
        assert set(json.loads(reader.attachments["version.json"])) == {"package", "sources_sha256"}
        assert reader.metadata["run"]["seed"] == "1"


@pytest.mark.parametrize(
    "words",
    [[], ["--help"], ["run"], ["nonsense"], ["run", "x.yaml", "--rig", "y.yaml", "--speed", "-1"]],
)
def test_help_and_wrong_words_are_answered_without_a_traceback(words):
    done = epa(*words)
    assert done.returncode == (0 if words in ([], ["--help"]) else 2)
    assert "Traceback" not in done.stderr
