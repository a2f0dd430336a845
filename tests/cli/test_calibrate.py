"""epa calibrate as an operator types it, on the simulated rig."""

import contextlib
import io
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
import pytest
import yaml

from epa_rt.cli.calibration_age import old_words, used_words
from epa_rt.cli.main import main
from epa_rt.config.rig import load_rig
from tests.cli.shell import ROOT

BENCH, KNEE = "config/rigs/bench.yaml", "config/rigs/knee.yaml"
WRONG = """
effects:
  force_gain: {force_gain: 1.04}
  force_offset: {force_offset: 2 N}
  muscle0_gauge_gain: {muscle0_gauge_gain: 0.97}
"""
MASSES = "points: [0.00 N, 60.00 N, 120.00 N, 180.00 N, 240.00 N]\n"
QUICK = ("--record", "0.3 s", "--settle", "0.1 s", "--quiet")


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


def epa(*words):
    """epa in this process: a new one for each verb would take most of the time."""
    out, error = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        code = main([str(word) for word in words])
    return Done(code, out.getvalue(), error.getvalue())


@pytest.fixture(autouse=True)
def _at_home(monkeypatch):
    monkeypatch.chdir(ROOT)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "wrong.yaml").write_text((ROOT / "config/plants/bench.yaml").read_text() + WRONG)
    text = (ROOT / BENCH).read_text().replace("../plants/bench.yaml", "wrong.yaml")
    (tmp_path / "bench.yaml").write_text(text)
    (tmp_path / "masses.yaml").write_text(MASSES)
    return tmp_path


def force(folder, *more):
    rig, points = folder / "bench.yaml", folder / "masses.yaml"
    words = ["force", "--rig", rig, "--points", points, "-o", folder / "out", *QUICK]
    return epa("calibrate", *words, *more)


def test_a_wrong_gain_is_found_written_and_used(folder):
    done = force(folder, "--ascending", "--descending", "--json", "--operator", "J. D.")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout[done.stdout.index("{") :])
    assert told["gain"] == pytest.approx(50.0 / 1.04, rel=2e-3)
    assert told["offset"] == pytest.approx(-2.0 / 1.04, abs=0.1)
    assert not (folder / "bench.calibration.yaml").exists()
    made = folder / "out/bench.calibration.yaml"
    from epa_rt.logs.reader import LogReader

    with LogReader(next((folder / "out").glob("*.mcap"))) as log:
        assert json.loads(log.attachments["record.json"])["operator"] == "J. D."
    (folder / "bench.calibration.yaml").write_text(made.read_text())
    rig = folder / "bench.yaml"
    named = rig.read_text().replace(
        "rig: bench\n", "rig: bench\ncalibrations: [bench.calibration.yaml]\n", 1
    )
    rig.write_text(named)
    checked = epa("check", rig)
    assert "calibrated: muscle_force_n" in checked.stdout and "from a simulation" in checked.stdout
    assert all(len(line) < 100 for line in checked.stdout.splitlines()[1:3])
    again = force(folder, "--ascending", "--json")
    told = json.loads(again.stdout[again.stdout.index("{") :])
    assert told["against_rig_file"] == pytest.approx(1.0, abs=2e-3)


def test_a_log_says_what_it_was_calibrated_by_and_replays(folder):
    assert force(folder, "--write", folder / "c.yaml").returncode == 0
    rig = folder / "bench.yaml"
    rig.write_text(
        rig.read_text().replace("rig: bench\n", "rig: bench\ncalibrations: [c.yaml]\n", 1)
    )
    text = (folder / "c.yaml").read_text()
    old = re.sub(r"when: .*", "when: '2020-01-31T12:00:00Z'", text)
    (folder / "c.yaml").write_text(old)
    experiment = "config/experiments/identification_short.yaml"
    done = epa("run", experiment, "--rig", rig, "-o", folder, "--quiet")
    assert "OLD CALIBRATION: muscle_force_n was calibrated" in done.stderr, done.stderr
    log = next(folder.glob("identification_short*.mcap"))
    from epa_rt.logs.reader import LogReader

    with LogReader(log) as reader:
        assert "2020-01-31" in reader.metadata["calibration"]["muscle_force_n"]
    (folder / "c.yaml").unlink()
    replayed = epa("replay", log)
    assert replayed.returncode == 0, replayed.stderr
    bus = ("--backend", "ethercat", "--interface", "none0", "-o", folder)
    (folder / "c.yaml").write_text(text)
    for verb in (("run", "config/experiments/identification_short.yaml"), ("jog", "--vent")):
        done = epa(*verb, "--rig", rig, *bus)
        assert done.returncode == 2 and "calibrated on a simulation" in done.stderr


def test_pressure_in_steps_by_the_rigs_own_valves(folder):
    page, picture = folder / "p.html", folder / "p.svg"
    done = epa(
        "calibrate", "pressure", "--rig", folder / "bench.yaml", "-o", folder / "out", *QUICK,
        "--steps", "0 kPa, 200 kPa, 400 kPa, 200 kPa", "--html", page, "--picture", picture,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    one = yaml.safe_load((folder / "out/bench.calibration.yaml").read_text())["signals"][0]
    assert float(one["gain"].split()[0]) == pytest.approx(250e3 / 0.97, rel=2e-3)
    assert "vented" in done.stdout and len(one["points"]) == 4
    assert "muscle_pressure_pa" in page.read_text() and picture.read_text().startswith("<svg")
    log = next((folder / "out").glob("calibrate_pressure*.mcap"))
    again = epa("calibrate", "pressure", "--rig", folder / "bench.yaml", "--from", log,
                "-o", folder / "again", "--json")  # fmt: skip
    assert again.returncode == 0, again.stderr
    told = json.loads(again.stdout)
    assert told["gain"] == pytest.approx(float(one["gain"].split()[0]), rel=1e-9)
    assert "source: simulation" in (folder / "again/bench.calibration.yaml").read_text()


def test_force_by_the_motor_against_a_reference_cell(folder):
    done = epa(
        "calibrate", "force", "--rig", folder / "bench.yaml", "-o", folder / "out", *QUICK,
        "--by", "motor", "--pressure", "300 kPa", "--travels", "5 mm, 12 mm, 18 mm, 24 mm",
        "--json",
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads(done.stdout[done.stdout.index("{") :])
    assert told["gain"] == pytest.approx(50.0 / 1.04, rel=3e-3)


def test_the_motor_goes_to_no_travel_where_travel_has_no_zero(folder):
    done = epa(
        "calibrate", "force", "--rig", folder / "bench.yaml", "-o", folder / "out", *QUICK,
        "--by", "motor", "--pressure", "300 kPa", "--travels", "5 mm, 12 mm", "--unreferenced",
    )  # fmt: skip
    assert done.returncode == 3 and "found no zero of travel" in done.stdout, done.stdout
    from epa_rt.logs.reader import LogReader

    with LogReader(next((folder / "out").glob("*.mcap"))) as log:
        rows = log.columns("/measured", ["motor_travel_m", "muscle_pressure_pa"])
    assert np.ptp(rows["motor_travel_m"]) < 1e-4 and np.ptp(rows["muscle_pressure_pa"]) < 5e3


def test_an_emulated_bus_calibrates_no_rig(folder, monkeypatch):
    from epa_rt.cli.calibrate import Session, _place
    from epa_rt.cli.main import parser

    words = ["calibrate", "force", "--rig", folder / "bench.yaml", "-o", folder / "out"]
    arguments = parser().parse_args([*map(str, words), "--backend", "ethercat"])
    for emulated, place in ((True, folder / "out"), (False, folder)):
        monkeypatch.setattr(
            "drivers.interface.is_emulated_bus", lambda _, emulated=emulated: emulated
        )
        session = Session(arguments)
        assert session.by_hand.is_real is not emulated
        assert _place(arguments, session)[0] == place / "bench.calibration.yaml"


def test_a_joint_by_a_jig(tmp_path):
    (tmp_path / "jig.csv").write_text("reference [deg]\n-30.0\n-15.0\n0.0\n15.0\n30.0\n")
    done = epa("calibrate", "joint", "--rig", KNEE, "--points", tmp_path / "jig.csv",
               "-o", tmp_path, *QUICK, "--json")  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout[done.stdout.index("{") :])
    assert told["against_rig_file"] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("force", "--rig", BENCH), "found no terminal to ask on"),
        (("joint", "--rig", BENCH), "found 0 joint readings on bench (none)"),
        (("pressure", "--rig", KNEE), "found 2 pressure readings on knee"),
        (("force", "--rig", BENCH, "--signal", "x"), "found --signal x"),
        (("force", "--rig", BENCH, "--record", "5 N"), "--record: found '5 N'"),
        (("force", "--rig", BENCH, "--by", "motor"), "without --travels"),
        (("pressure", "--rig", BENCH, "--steps", "0 kPa, 900 kPa"), "--steps: found '900 kPa'"),
        (("force", "--rig", BENCH, "--from", "absent.csv"), "absent.csv:1: found no such file"),
        (("force", "--rig", BENCH, "--from", "README.md"), "README.md:3: found the columns"),
        (("force", "--rig", BENCH, "--points", "absent.yaml"), "absent.yaml:1: found no such"),
        (("force", "--rig", BENCH, "--operator", "a\nb"), "--operator: found"),
        (("force", "--rig", BENCH, "--html", "x.txt"), "found the ending '.txt'"),
        (("pressure", "--rig", BENCH, "--backend", "ethercat", "--interface", "none0"),
         "found no terminal on which an operator reads"),
    ],
)  # fmt: skip
def test_what_is_asked_in_vain_gets_one_sentence(tmp_path, words, says):
    done = epa("calibrate", *words, "-o", tmp_path)
    assert done.returncode == 2 and says in done.stderr, done.stderr
    assert done.stderr.count("\n") == 1


def test_a_mass_beyond_the_converter_is_refused_and_its_log_kept(folder):
    (folder / "masses.yaml").write_text("points: [0.00 N, 200.00 N, 700.00 N]\n")
    done = force(folder)
    assert done.returncode == 2 and "point 3 (masses.yaml:1): found a reading" in done.stderr
    log = next((folder / "out").glob("*.mcap"))
    words = ("calibrate", "force", "--rig", folder / "bench.yaml", "--from", log, "-o", folder)
    assert "beyond the converter" in epa(*words).stderr
    assert epa(*words, "--leave-out", "3").returncode == 0
    assert "--leave-out: found '4'" in epa(*words, "--leave-out", "4").stderr


def test_spoilt_tables_leave_the_former_file_alone(folder):
    kept = folder / "c.yaml"
    table = folder / "t.csv"
    sound = "reference [N],reading [V]\n" + "".join(f"{50 * i}.0,{i}.0\n" for i in range(6))
    words = ("calibrate", "force", "--rig", folder / "bench.yaml", "--from", table, "--write", kept)
    table.write_text(sound)
    assert epa(*words).returncode == 0
    before = kept.read_text()
    for text, says in (
        (sound.replace("100.0,2.0", "100.0,3.0").replace("150.0,3.0", "150.0,2.0"), "swapped"),
        (sound.replace(",", " ", 0).replace("[N]", "[kN]"), "too large by 1000"),
        (sound.replace("250.0,5.0", "250.0,12.0"), "end of what the converter"),
    ):
        table.write_text(text)
        done = epa(*words)
        assert done.returncode == 2 and says in done.stderr, done.stderr
    assert kept.read_text() == before
    table.write_text(sound.replace(".0,", ".5,"))
    done = epa(*words)
    said = " ".join(done.stdout.split())
    assert "gain 50 N/V became 50 N/V, offset 0 N became 0.5 N; the former is not kept" in said


def test_age_is_told_from_the_day(folder):
    assert force(folder, "--write", folder / "c.yaml").returncode == 0
    rig = folder / "bench.yaml"
    rig.write_text(
        rig.read_text().replace(
            "rig: bench\n", "rig: bench\ncalibrations: [c.yaml]\ncalibration_valid_for: 30 day\n", 1
        )
    )
    typed = load_rig(rig)
    made = datetime.fromisoformat(typed.applied_calibrations[0].when)
    assert old_words(typed, made + timedelta(days=29)) == ()
    assert "31 days ago, more than 30" in old_words(typed, made + timedelta(days=31))[0]
    assert "still to come" in old_words(typed, made - timedelta(days=2))[0]
    assert used_words(typed, made + timedelta(days=31))[0].endswith("31 days old OLD")


def talk(words, answers, seconds=120):
    """A calibration on a pseudo terminal: each answer (keys, or a signal) once it is asked for."""
    ours, theirs = pty.openpty()
    child = subprocess.Popen(
        [sys.executable, "-m", "epa_rt", *map(str, words)],
        cwd=ROOT, stdin=theirs, stdout=theirs, stderr=theirs,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    os.close(theirs)
    said, left, seen = b"", list(answers), 0
    try:
        while select.select([ours], [], [], seconds)[0]:
            try:
                data = os.read(ours, 4096)
            except OSError:
                break
            if not data:
                break
            said += data
            if left and said.count(b"> ") > seen:
                seen = said.count(b"> ")
                answer = left.pop(0)
                if isinstance(answer, bytes):
                    os.write(ours, answer)
                else:
                    child.send_signal(answer)
        code = child.wait(timeout=seconds)
    finally:
        child.kill()
        os.close(ours)
    return said.decode("utf-8", "replace").replace("\r\n", "\n"), code


def test_the_operator_is_asked_point_by_point(folder):
    words = ["calibrate", "force", "--rig", folder / "bench.yaml", "-o", folder / "out", *QUICK]
    answers = [
        b"0.00 N\n", b"60.00 X\x7fN\n", b"five\n", b"120.00 N\n", b"again\n", b"120.00 N\n",
        b"24\x15240.00 N\n", b"done\n",
    ]  # fmt: skip
    said, code = talk([*words, "--speed", "8"], answers)
    assert code == 0, said
    assert "hang the mass" in said and "found 'five'" in said and "point 3 is dropped" in said
    assert re.search(r"   now -?[\d.e-]+ N\x1b", said)  # what the cell says while one is asked
    assert "nothing moves" in said and "points           4, 0 N to 240 N" in said
    assert all(len(line) < 100 for line in said.splitlines() if "/" not in line)


def test_the_operator_stops_and_nothing_is_written(folder):
    words = ["calibrate", "pressure", "--rig", folder / "bench.yaml", "-o", folder / "out", *QUICK]
    said, code = talk([*words, "--speed", "4"], [b"0.0 kPa\n", signal.SIGINT])
    assert code == 130, said
    assert "no calibration was written" in said and "vented" in said
    assert not (folder / "out/bench.calibration.yaml").exists()


def test_a_gauge_that_says_something_else_ends_it_vented(folder):
    """psi for kPa: at 120 kPa the gauge is said to read 17 kPa."""
    words = ["calibrate", "pressure", "--rig", folder / "bench.yaml", "-o", folder / "out", *QUICK]
    steps = ["--steps", "0 kPa, 300 kPa, 500 kPa", "--speed", "8"]
    said, code = talk([*words, *steps], [b"0.0 kPa\n", b"43.5 kPa\n"])
    assert code == 3, said
    assert "the reference says 43.5 kPa where" in said and "no calibration was written" in said
