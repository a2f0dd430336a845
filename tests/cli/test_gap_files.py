"""What epa gap writes and shows on its way: whole files or none, progress in a file and on a
terminal.
"""

import errno
import io
import os
import sys
from pathlib import Path

import pytest

from epa_rt.cli.exits import VerbError
from epa_rt.cli.export import _write
from epa_rt.cli.log_name import take_log_path
from epa_rt.cli.main import main
from epa_rt.cli.progress import progress_shown
from epa_rt.cli.write import MAGIC, check_writable, write_whole
from tests.cli.shell import RIGS, ROOT


def test_a_file_is_replaced_in_one_step_and_nothing_else_is_left(tmp_path):
    path = tmp_path / "deep/er/gap.json"
    write_whole(path, "one")
    write_whole(path, "two")
    assert path.read_text() == "two" and [file.name for file in path.parent.iterdir()] == [
        "gap.json"
    ]
    assert path.stat().st_mode & 0o777 == 0o644


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(VerbError, match="found .*/file, in which nothing can be written"):
        write_whole(tmp_path / "file/gap.json", "x")


@pytest.mark.parametrize(
    ("number", "code"), [(errno.EACCES, 2), (errno.EROFS, 2), (errno.ENOSPC, 4)]
)
def test_a_folder_that_takes_no_files_is_bad_input(tmp_path, monkeypatch, number, code):
    """Of pages and answers as of logs and tables; a full disk is a failure."""

    def refused(*_, **__):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("os.replace", refused)
    monkeypatch.setattr("pathlib.Path.touch", refused)
    for write in (
        lambda: write_whole(tmp_path / "gap.json", "one"),
        lambda: take_log_path(tmp_path / "log.mcap", None),
        lambda: _write(tmp_path / "a.csv", lambda file: None, True),
    ):
        with pytest.raises(VerbError) as error:
            write()
        assert error.value.code == code, error.value
        asked = f": found {tmp_path}, in which nothing can be written ("
        assert (asked in str(error.value)) == (code == 2), error.value


def test_a_disk_that_fills_leaves_the_old_file_and_no_scraps(tmp_path, monkeypatch):
    write_whole(tmp_path / "gap.json", "one")
    monkeypatch.setattr(
        "os.replace", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device"))
    )
    with pytest.raises(VerbError, match="No space left"):
        write_whole(tmp_path / "gap.json", "two")
    assert [file.name for file in tmp_path.iterdir()] == ["gap.json"] and (
        tmp_path / "gap.json"
    ).read_text() == "one"


@pytest.mark.parametrize(
    "name, words", [("gap.txt", "expected .json"), ("gap", "found the ending ''")]
)
def test_endings_are_checked_before_any_work(name, words, tmp_path):
    with pytest.raises(VerbError, match=words):
        check_writable(tmp_path / name, (".json",))
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(VerbError, match="found a folder"):
        check_writable(tmp_path / "folder.json", (".json",))
    check_writable(None, (".json",))


def test_a_pipe_and_a_file_that_is_kept_are_not_written_over(tmp_path, monkeypatch):
    os.mkfifo(tmp_path / "pipe.json")
    with pytest.raises(VerbError, match="found no plain file"):
        check_writable(tmp_path / "pipe.json", (".json",))
    (tmp_path / "kept.json").write_text("keep")
    monkeypatch.setattr(
        os, "access", lambda path, mode: mode != os.W_OK
    )  # root may write to what is read-only
    with pytest.raises(VerbError, match="not to be written over"):
        check_writable(tmp_path / "kept.json", (".json",))


@pytest.mark.parametrize(
    "arguments",
    [
        ("gap", "patch", "gap.json", "--rig", RIGS / "bench.yaml", "-o", f"{300 * 'a'}.yaml"),
        ("gap", "blind", "make", "--seed", "1", "--cases", "1", "-o", 300 * "a"),
        ("gap", "blind", "score", 300 * "a", "--json", "a.json"),
        ("import", ROOT / "config/imports/emps.yaml", __file__, "-o", f"{300 * 'a'}.mcap"),
    ],
)
def test_a_name_that_no_file_can_have_is_one_sentence(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([*map(str, arguments)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and not list(tmp_path.iterdir()), said


def test_a_log_and_what_cannot_be_read_are_found_before_any_work(tmp_path, monkeypatch):
    there = tmp_path / "there.json"
    there.write_bytes(MAGIC + b"the rest of a log")
    for write in (lambda: check_writable(there, (".json",)), lambda: write_whole(there, "x")):
        with pytest.raises(VerbError, match="found a log, expected another name"):
            write()
    assert there.read_bytes() == MAGIC + b"the rest of a log"
    there.write_text("an answer of before")
    check_writable(there, (".json",))
    monkeypatch.setattr(
        Path, "open", lambda *_: (_ for _ in ()).throw(PermissionError(13, "Permission denied"))
    )
    with pytest.raises(VerbError, match="cannot be read .Permission denied."):
        check_writable(there, (".json",))


def test_progress_in_a_file_is_a_line_per_stage(capsys):
    with progress_shown(quiet=False) as progress:
        for stage, share in (
            ("floors", 0.0),
            ("floors", 0.1),
            ("effect 1", 0.15),
            ("effect 1", 0.2),
        ):
            progress(stage, share)
    assert capsys.readouterr().err.splitlines() == ["  0 % floors", " 15 % effect 1"]


def test_quiet_says_nothing(capsys):
    with progress_shown(quiet=True) as progress:
        progress("floors", 0.5)
    assert capsys.readouterr() == ("", "")


def test_on_a_terminal_one_bar_goes_and_is_taken_away(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    with progress_shown(quiet=False) as progress:
        progress("floors", 0.25)
        progress("done", 2.0)
    assert "done" in screen.getvalue() and "100 %" in screen.getvalue()


def test_a_name_that_is_no_utf8_is_spelt_out_and_leaves_no_file_behind(tmp_path):
    write_whole(tmp_path / "where.html", "log \udcff.mcap")
    assert (tmp_path / "where.html").read_text(encoding="utf-8") == "log \\udcff.mcap"
    assert [path.name for path in tmp_path.iterdir()] == ["where.html"]
