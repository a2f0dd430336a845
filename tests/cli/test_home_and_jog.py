"""epa home and epa jog as an operator types them, on the simulated rig."""

import os
import pty
import re
import select
import subprocess
import sys

import numpy as np
import pytest

from epa_rt.cli.keys import keys_in
from epa_rt.logs.reader import LogReader
from tests.cli.shell import ROOT, epa_here

BENCH, KNEE = "config/rigs/bench.yaml", "config/rigs/knee.yaml"


def test_home_sets_what_the_rig_file_says_and_keeps_it_out_of_config(tmp_path):
    done = epa_here("home", "--rig", BENCH, "--unreferenced", "-o", str(tmp_path), "--quiet")
    assert done.returncode == 0, done.stderr
    assert "scatter" in done.stdout and "became 10.2" in done.stdout
    text = (tmp_path / "bench.zero.yaml").read_text()
    assert "method: taut_strap" in text and "at: 10.27 mm" in text
    assert not (ROOT / "config/rigs/bench.zero.yaml").exists()
    assert sorted(p.name for p in tmp_path.glob("*.mcap")) == [
        "home-bench-001.mcap",
        "set_zero-bench-001.mcap",
    ]
    checked = epa_here("check", str(tmp_path / "bench.zero.yaml"))
    assert checked.returncode == 0 and "zero by taut_strap at 10.27 mm, set " in checked.stdout
    info = epa_here("info", str(tmp_path / "set_zero-bench-001.mcap"))
    assert info.returncode == 0, info.stderr


def test_home_refuses_what_it_cannot_do(tmp_path):
    text = (ROOT / BENCH).read_text().replace("../plants/", f"{ROOT}/config/plants/")
    rig = tmp_path / "bench.yaml"
    rig.write_text(text.replace("method: taut_strap", "method: index"))
    done = epa_here("home", "--rig", str(rig), "-o", str(tmp_path))
    assert done.returncode == 2 and "method index without 'current'" in done.stderr
    rig.write_text(
        "\n".join(x for x in text.splitlines() if "zero: {" not in x and "300 kPa g" not in x)
    )
    done = epa_here("home", "--rig", str(rig), "-o", str(tmp_path))
    assert done.returncode == 2 and "found no motor.zero" in done.stderr
    done = epa_here("home", "--rig", BENCH, "--backend", "ethercat", "--interface", "none0")
    assert done.returncode == 2 and "expected --yes" in done.stderr


def test_home_by_index_says_what_moved_and_where_the_zero_was(tmp_path):
    text = (ROOT / BENCH).read_text().replace("../plants/", f"{ROOT}/config/plants/")
    rig = tmp_path / "bench.yaml"
    index = "zero: {method: index, at: 10.27 mm, direction: decreasing, speed: 4 mm/s,"
    index += " current: 1 A, force: 20 N}"
    rig.write_text(re.sub(r"zero: \{.*?\}", index, text, flags=re.DOTALL))
    done = epa_here("home", "--rig", str(rig), "-o", str(tmp_path), "--quiet")
    assert done.returncode == 0, done.stderr
    assert "became 10.2" in done.stdout and "by +3.81 motor turns" in done.stdout
    assert "method: index" in (tmp_path / "bench.zero.yaml").read_text()
    bus = ("--backend", "ethercat", "--interface", "none0")
    done = epa_here("home", "--rig", str(rig), "-o", str(tmp_path), *bus)
    assert done.returncode == 2 and "expected --yes" in done.stderr  # nothing moves unasked


def test_a_zero_that_was_not_read_back_lets_no_run_start(tmp_path):
    """The drive then says that it is referenced, and to where nobody knows."""
    text = (ROOT / BENCH).read_text().replace("../plants/", f"{ROOT}/config/plants/")
    rig = tmp_path / "bench.yaml"  # a drive that has no time to answer
    text = re.sub(r"zero: \{.*?\}", "zero: {method: here, at: 10.27 mm}", text, flags=re.DOTALL)
    rig.write_text(text.replace("transition_timeout: 0.5 s", "transition_timeout: 30 ms"))
    done = epa_here("home", "--rig", str(rig), "-o", str(tmp_path), "--quiet")
    assert done.returncode == 3 and "home again" in done.stdout, done.stdout + done.stderr
    assert "method: unfinished" in (tmp_path / "bench.zero.yaml").read_text()
    experiment = "config/experiments/identification.yaml"
    bus = ("--backend", "ethercat", "--interface", "none0", "-o", str(tmp_path))
    done = epa_here("run", experiment, "--rig", str(rig), *bus)
    assert done.returncode == 3 and "was not read back" in done.stderr


def test_jog_brings_a_rig_back_by_options_in_their_order(tmp_path):
    out = ("-o", str(tmp_path), "--quiet")
    back = ("--start-travel", "40 mm", "--move", "-12mm", "--at", "6 mm/s", "--wait", "0.1 s")
    done = epa_here("jog", "--rig", BENCH, *back, "--vent", *out)
    assert done.returncode == 0 and "completed" in done.stdout, done.stderr
    done = epa_here("jog", "--rig", BENCH, "--start-travel", "40 mm", "--move", "1 mm", *out)
    assert done.returncode == 3 and "a move to 41.00 mm was not made" in done.stdout


def test_jog_fills_one_of_two_muscles_and_goes_on(tmp_path):
    """The other one is told nothing, and is not waited for."""
    air = ("--fill", "spam", "50 kPa", "--wait", "0.1 s", "--vent")
    done = epa_here("jog", "--rig", KNEE, *air, "-o", str(tmp_path), "--quiet")
    assert done.returncode == 0 and "completed" in done.stdout, done.stderr
    with LogReader(tmp_path / "jog-knee-001.mcap") as log:
        filled = log.columns("/measured", ["spam_pressure_pa", "ppam_pressure_pa"])
        most = {name: np.max(values) for name, values in filled.items()}
    assert most["spam_pressure_pa"] == pytest.approx(151e3, abs=3e3)
    assert most["ppam_pressure_pa"] < 105e3


def test_jog_reads_a_script_and_says_what_is_wrong_with_its_line(tmp_path):
    script = tmp_path / "back.txt"
    script.write_text("# up and down\nmove 1 mm\n\nfill muscle 30 kPa  # a little\nvent\n")
    done = epa_here("jog", "--rig", BENCH, "--script", str(script), "-o", str(tmp_path), "--quiet")
    assert done.returncode == 0, done.stderr
    script.write_text("move 1 mm\nfly 3 mm\n")
    done = epa_here("jog", "--rig", BENCH, "--script", str(script))
    assert done.returncode == 2 and f"{script}:2: fly 3 mm: found" in done.stderr
    script.write_text("# nothing\n")
    done = epa_here("jog", "--rig", BENCH, "--script", str(script))
    assert done.returncode == 2 and "found no order" in done.stderr


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "found no terminal to read keys from"),
        (("--at", "3 mm/s"), "found no --move before it"),
        (("--move", "far"), "move far: found 'far'"),
        (("--start-travel", "4 N", "--vent"), "--start-travel: found '4 N'"),
    ],
)
def test_jog_refuses_with_one_sentence(options, said):
    done = epa_here("jog", "--rig", BENCH, *options)
    assert done.returncode == 2 and said in done.stderr and "Traceback" not in done.stderr


def test_keys_of_a_terminal():
    assert keys_in(b"\x1b[C\x1b[Dq\x1bOAV\x1b") == ["right", "left", "q", "up", "v", "escape"]
    assert keys_in(b"\x1b[Zm") == ["m"]


def test_keys_move_the_rig_on_a_terminal_and_q_ends_it(tmp_path):
    """Through a pseudo terminal, as it is used; the line fits 80 columns."""
    ours, theirs = pty.openpty()
    words = ["jog", "--rig", BENCH, "--speed", "4", "-o", str(tmp_path)]
    child = subprocess.Popen(
        [sys.executable, "-m", "epa_rt", *words],
        cwd=ROOT,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    os.close(theirs)
    said, moved = b"", False
    try:
        while select.select([ours], [], [], 60.0)[0]:
            try:
                said += os.read(ours, 4096)
            except OSError:  # the other end is closed
                break
            if b"mm/s |" in said:
                os.write(ours, b"\x1b[C" if not moved else b"q")
                moved = moved or b" 7.0" in said or b" 6.9" in said
    finally:
        os.close(ours)
        code = child.wait(30)
    text = said.decode()
    assert code == 0 and moved and "completed" in text, text
    lines = [line for line in text.replace("\n", "\r").split("\r") if "mm/s |" in line]
    assert lines and all(len(line) < 80 for line in lines)


def test_a_jog_by_orders_shows_the_pressure_on_a_terminal(tmp_path):
    ours, theirs = pty.openpty()
    words = ["jog", "--rig", BENCH, "--fill", "muscle", "50 kPa", "--vent", "-o", str(tmp_path)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-m", "epa_rt", *words], cwd=ROOT, stderr=theirs, env=environment
    ) as child:
        os.close(theirs)
        said = b""
        try:
            while data := os.read(ours, 4096):
                said += data
        except OSError:  # the other end is closed
            pass
        finally:
            os.close(ours)
        assert child.wait(60) == 0
    shown = re.findall(r"\| muscle +([\d.-]+) kPa gauge", said.decode())
    assert any(45.0 < float(one) < 55.0 for one in shown), said
