"""epa info, plot and report from the outside."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from epa_rt.cli.damage import NOT_WHOLE
from epa_rt.cli.info import text_of
from epa_rt.cli.main import main
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT, epa_here


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("looking") / "run.mcap"
    done = epa_here(
        "run",
        EXPERIMENTS / "identification_short.yaml",
        "--rig",
        RIGS / "bench.yaml",
        "-o",
        path,
        "--quiet",
    )
    assert done.returncode == 0, done.stderr
    return path


@pytest.fixture
def cut(log, tmp_path):
    data = log.read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: len(data) // 2])
    return path


@pytest.fixture
def not_a_log(tmp_path):
    path = tmp_path / "notes.txt"
    path.write_text("not a log")
    return path


def test_info_says_how_the_run_ended_and_what_it_holds(log, capsys):
    assert main(["info", str(log)]) == 0
    text = capsys.readouterr().out
    for words in (
        "outcome    completed",
        "identification_short on the rig bench",
        "/cycle 29",
        "rig.yaml",
        "nothing (the file ends",
    ):
        assert words in text


def test_info_for_machines_agrees_with_the_log(log, capsys):
    from epa_rt.logs.reader import LogReader

    assert main(["info", "--json", "--events", "--check", str(log)]) == 0
    (facts,) = json.loads(capsys.readouterr().out)
    with LogReader(log) as reader:
        cycles, events = len(reader.columns("/cycle", ["cycle"])["cycle"]), reader.events()
    assert facts["topics"]["/cycle"] == facts["topics"]["/measured"] == facts["cycles"] == cycles
    assert facts["topics"]["/event"] == len(facts["events"]) == len(events)
    assert facts["duration_s"] == pytest.approx(cycles * 1e-3)
    assert facts["outcome"] == "completed" and facts["missing"] == [] and facts["checked"]


def test_info_counts_what_a_cut_log_still_has(cut, capsys):
    assert main(["info", str(cut)]) == 0
    text = capsys.readouterr().out
    assert "the file was cut at byte" in text and "outcome    unknown" in text


def test_info_notices_damage_when_asked_to_check(log, tmp_path, capsys):
    data = bytearray(log.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    assert main(["info", "--check", str(log)]) == 0
    assert main(["info", "--check", str(path)]) == 1
    assert "damaged" in capsys.readouterr().out


def test_info_of_a_file_that_is_no_log_is_one_sentence(not_a_log, log, capsys):
    assert main(["info", str(not_a_log), str(log)]) == 2
    found = capsys.readouterr()
    assert found.err.count("\n") == 1 and "expected an MCAP log" in found.err
    assert "completed" in found.out, "the other log is described all the same"


@pytest.mark.parametrize(
    "verb", [("info",), ("plot",), ("report",), ("replay",), ("gap", "localise")]
)
def test_a_pipe_is_no_log_and_nobody_waits_for_one(verb, tmp_path):
    pipe = tmp_path / "pipe.mcap"
    os.mkfifo(pipe)
    rig = ("--rig", RIGS / "bench.yaml") if verb[0] == "gap" else ()
    done = epa_here(*verb, *rig, pipe)
    assert (
        done.returncode == 2
        and done.stderr.count("\n") == 1
        and "found a pipe, expected a log" in done.stderr
    )


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
def test_an_output_that_is_full_is_one_sentence(log):
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "epa_rt", "info", str(log)]
        done = subprocess.run(
            command, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True, timeout=600
        )
    assert (
        done.returncode == 4
        and done.stderr == "epa info: what it says cannot be written (No space left on device)\n"
    )


def test_info_text_of_a_log_does_not_steer_the_terminal(log):
    from epa_rt.cli.info import facts_of

    facts = facts_of(log) | {"cause": "\x1b[2J\x9b31m", "outcome": "tripped"}
    assert not any(
        ord(sign) < 32 and sign != "\n" or 0x7F <= ord(sign) < 0xA0 for sign in text_of(facts)
    )


@pytest.mark.parametrize("verb", ["report", "plot"])
@pytest.mark.parametrize(
    "name, words",
    [
        ("notes.txt", "expected an MCAP log"),
        ("nothing.mcap", "no such file"),
        (".", "found a folder"),
    ],
)
def test_a_page_of_what_is_no_log_is_refused_in_one_sentence(
    verb, name, words, not_a_log, tmp_path, capsys
):
    assert main([verb, str(tmp_path / name), "--html", str(tmp_path / "page.html")]) == 2
    error = capsys.readouterr().err
    assert (
        error.startswith(f"epa {verb}: ")
        and error.count("\n") == 1
        and words in error.lower().replace("mcap", "MCAP")
    )
    assert not (tmp_path / "page.html").exists()


def test_report_writes_its_page_beside_the_log(log, tmp_path, capsys):
    copy = tmp_path / "copy.mcap"
    shutil.copy(log, copy)
    assert main(["report", str(copy)]) == 0
    page = (tmp_path / "copy.html").read_text()
    assert "Copper loss, J" in page, "the plant in the log knows its winding"
    assert "copy.html" in capsys.readouterr().out


def test_all_that_read_a_damaged_log_say_the_same_of_it_and_end_alike(cut, log, capsys):
    verbs = (("info", "--check"), ("replay",), ("report",), ("plot",))
    sentences = set()
    for words in verbs:
        assert main([*words, str(cut)]) == 1, words
        said = capsys.readouterr().out
        sentences.add(next(s for s in said.splitlines() if NOT_WHOLE in s).partition(NOT_WHOLE)[2])
    assert len(sentences) == 1
    for words in verbs:
        assert main([*words, str(log)]) == 0, words
        assert NOT_WHOLE not in capsys.readouterr().out


@pytest.mark.parametrize("verb", ["report", "plot"])
def test_no_page_is_written_over_a_log(verb, log, tmp_path, capsys):
    disguised = tmp_path / "log.html"
    shutil.copy(log, disguised)
    assert main([verb, str(log), "--html", str(disguised)]) == 2
    assert disguised.read_bytes() == log.read_bytes()
    assert main([verb, str(log), "--html", str(log)]) == 2
    assert "no log is overwritten" in capsys.readouterr().err


def test_one_name_is_no_page_of_two_logs(log, tmp_path, capsys):
    page = tmp_path / "page.html"
    assert main(["report", str(log), str(log), "--html", str(page)]) == 2
    assert "beside 2 logs" in capsys.readouterr().err and not page.exists()


def test_a_page_that_cannot_be_written_is_said_so(log, not_a_log, capsys):
    assert main(["report", str(log), "--html", str(not_a_log / "page.html")]) == 2
    assert "in which nothing can be written" in capsys.readouterr().err


def test_plot_draws_the_signals_that_fit(log, tmp_path, capsys):
    page = tmp_path / "page.html"
    assert (
        main(
            [
                "plot",
                str(log),
                "*_pressure_pa",
                "motor_current_a",
                "--from",
                "2",
                "--to",
                "8",
                "--html",
                str(page),
            ]
        )
        == 0
    )
    text = page.read_text()
    assert text.count('"type":"scatter"') == 4, "measured, target, estimate; current"
    assert "2.000 s to 8.000 s" in text and "kPa gauge" in text


def test_plot_without_names_draws_the_most_telling_ones(log, tmp_path):
    page = tmp_path / "page.html"
    assert main(["plot", str(log), "--html", str(page)]) == 0
    text = page.read_text()
    assert all(
        words in text
        for words in ("motor travel", "muscle force", "muscle pressure", "motor current")
    )


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["no_such_*"], "found no signal 'no_such_*', expected one of muscle_pressure_pa"),
        (["--from", "100"], "found no two samples between 100 s and the end"),
        (["--from", "5", "--to", "4"], "found no two samples between 5 s and 4 s"),
        (["--html", "picture.png"], "expected .html"),
    ],
)
def test_plot_refuses_what_it_cannot_draw_in_one_sentence(arguments, words, log, capsys):
    assert main(["plot", str(log), *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1
