"""A list of runs: what each log says of itself, damaged ones among them, and who is asked for."""

from __future__ import annotations

import json
import os
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from epa_rt.cli.main import main
from epa_rt.logs.plain_text import plain
from epa_rt.logs.reader import LogReader
from epa_rt.logs.run_record import parse_time
from epa_rt.runs.glance import Glance, glance
from epa_rt.runs.listing import Filter, as_text, listed, moment
from tests.logs.log_samples import record

NOW = datetime(2026, 11, 27, 12, 0, tzinfo=UTC)


@pytest.fixture(scope="module")
def small(tmp_path_factory) -> Path:
    """A log of another rig that says neither operator nor start."""
    path = tmp_path_factory.mktemp("small") / "small.mcap"
    record(path, 4500)
    return path


@pytest.fixture
def archive(logs, small, tmp_path):
    """A folder with good logs, a cut one, one whose summary is damaged, and files that are none."""
    (tmp_path / "deep/er").mkdir(parents=True)
    data = logs["first"].read_bytes()
    (tmp_path / "good.mcap").write_bytes(data)
    (tmp_path / "deep/er/other.mcap").write_bytes(logs["other"].read_bytes())
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    broken = bytearray(data)
    broken[-200] ^= 1
    (tmp_path / "summary.mcap").write_bytes(broken)
    (tmp_path / "empty.mcap").write_bytes(b"")
    (tmp_path / "text.mcap").write_text("no log")
    (tmp_path / "folder.mcap").mkdir()
    (tmp_path / "old.mcap").write_bytes(small.read_bytes())
    os.utime(tmp_path / "old.mcap", (1.6e9, 1.6e9))
    os.mkfifo(tmp_path / "pipe.mcap")
    return tmp_path


def test_a_glance_says_what_reading_the_log_says(logs):
    found = glance(logs["first"])
    with LogReader(logs["first"]) as log:
        cycles, run = log.counts()["/cycle"], log.metadata["run"]
        assert (found.outcome, found.cause) == (log.ending.outcome, log.ending.cause)
    assert (found.rig, found.experiment, found.backend) == ("bench", "short", "sim")
    assert found.duration_s == pytest.approx(cycles * float(run["period_s"]))
    assert found.record.operator == "Ada" and not found.when_is_of_file
    assert abs(found.when - datetime.now(UTC)) < timedelta(hours=2)


def test_a_glance_reads_no_samples(logs, tmp_path):
    """The chunks may hold anything: a list takes as long for long runs as for short ones."""
    path = tmp_path / "log.mcap"
    data = bytearray(logs["first"].read_bytes())
    begin = data.index(b"zstd")  # the first chunk's data follows
    data[begin + 12 : -20_000] = bytes(len(data) - 20_000 - begin - 12)
    path.write_bytes(data)
    found = glance(path)
    assert (found.outcome, found.record.operator) == ("completed", "Ada")


def test_damaged_ones_and_such_that_are_none_are_listed_as_that(archive, capsys):
    assert main(["ls", str(archive), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["schema"] == "epa_rt.ls/1"
    found = {Path(one["log"]).name: one for one in answer["logs"]}
    outcomes = {name: one["outcome"] for name, one in found.items()}
    assert outcomes == {
        "good.mcap": "completed",
        "other.mcap": "completed",
        "cut.mcap": "damaged",
        "summary.mcap": "damaged",
        "empty.mcap": "no log",
        "text.mcap": "no log",
        "pipe.mcap": "no log",
        "old.mcap": "finished",
    }
    assert "the file was cut at byte" in found["cut.mcap"]["cause"]
    assert "checksum" in found["summary.mcap"]["cause"]
    assert found["cut.mcap"]["operator"] == "Ada" and found["cut.mcap"]["rig"] == "bench"
    assert found["old.mcap"]["when"].startswith("2020-09-13")
    assert found["old.mcap"]["when_is_of_file"] and found["old.mcap"]["operator"] is None


def test_filters_take_what_is_asked_for(archive):
    def names(**asked):
        return {one.path.name for one in listed([archive], Filter(**asked))}

    assert names(outcome="completed") == {"good.mcap", "other.mcap"}
    assert names(operator="ad?") == {"good.mcap", "cut.mcap", "summary.mcap"}
    assert names(rig="BENCH", outcome="completed", operator="ada") == {"good.mcap"}
    assert names(experiment="sh*", outcome="dam*") == {"cut.mcap", "summary.mcap"}
    assert names(until=moment("2021-01-01", NOW)) == {"old.mcap"}
    assert "old.mcap" not in names(since=moment("1 d", datetime.now(UTC)))
    assert listed([archive], Filter(outcome="[!n]*"))[0].path.name == "old.mcap"  # the oldest first


@pytest.mark.parametrize("year", ["0001-01-01T00:00:00+14:00", "9999-12-31T23:59:59-12:00"])
def test_a_start_that_no_calendar_has_is_none(year):
    assert parse_time(year) is None and parse_time("2026-01-31T12:00:00Z") is not None


@given(st.text())
def test_plain_text_steers_no_terminal(text):
    assert all(c.isprintable() or c == "\n" for c in plain(text))
    assert plain(f"a é\n{text}").startswith("a é\n")


def test_a_list_fits_eighty_columns_and_steers_no_terminal(archive):
    found = listed([archive], Filter())
    found.append(Glance(Path("a" * 200 + "\x1b[2J.mcap"), "tripped", "why\x1b[31m " * 20))
    for long in (False, True):
        text = as_text(found, archive, 80, long)
        assert max(map(len, text.splitlines())) <= 80
        assert "\x1b" not in text
    assert "new hose" in text and "deep/er/other" in text and "~" in text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("3 d", NOW - timedelta(days=3)),
        ("12h", NOW - timedelta(hours=12)),
        ("2026-11-26T10:00:00Z", NOW - timedelta(hours=26)),
        ("2026-11-26", datetime(2026, 11, 26).astimezone()),
    ],
)
def test_moments_as_people_write_them(text, expected):
    assert moment(text, NOW) == expected


def test_a_day_includes_its_evening():
    assert moment("2026-11-26", NOW, end_of_day=True) == datetime(2026, 11, 27).astimezone()


@pytest.mark.parametrize("text", ["yesterday", "3", "2026-13-01", "9" * 400 + " d", ""])
def test_no_moment_is_refused_with_a_sentence(text, tmp_path, capsys):
    assert main(["ls", str(tmp_path), "--since", text]) == 2
    assert "--since: found" in capsys.readouterr().err


def test_a_folder_that_is_not_there_and_one_without_logs(tmp_path, capsys):
    assert main(["ls", str(tmp_path / "none")]) == 2
    assert "found nothing there" in capsys.readouterr().err
    assert main(["ls", str(tmp_path)]) == 0
    assert capsys.readouterr().err == "no log\n"
    assert main(["ls", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["logs"] == []


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_a_damaged_file_never_ends_a_list(small, tmp_path, data):
    content = bytearray(small.read_bytes())
    tail = len(content) - 4000
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, 4000) | st.integers(tail, len(content) - 1))
        content[place] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(content)) | st.just(len(content)))
    path = tmp_path / "damaged.mcap"
    path.write_bytes(content[:cut])
    assert as_text([glance(path)], tmp_path, 80, True)
