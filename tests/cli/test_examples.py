"""Every example of every help can be pasted, and works a second time beside its own outputs."""

import glob
import shlex
import shutil
import sys

import pytest

from epa_rt.cli.main import main, parser
from epa_rt.cli.parser import examples
from tests.cli.test_manners import parsers

# what no test has: a card, a bus, a screen, a run that is on, a recording of others, a name
NOT_HERE = (
    "eth1",
    "ethercat",
    " LOG",
    "SOCKET",
    "DATA_EMPS",
    "HOST",
    "epa scan",
    "epa bus",
    "epa live",
    "--live",
    "| ",
)
# minutes each; other tests run them on data of their own
LONG = (
    "gap blind",
    "gap diagnose",
    "gap localise",
    "gap patch",
    "gap plan",
    "study ",
    "best.yaml",
    "next.yaml",
)
LONG_RUNS = ("identification.yaml", "knee_chirp.yaml", "rehearsal.yaml --restart")
SLOW = (
    "epa replay",
    "epa home",
    "epa queue",
    "epa run",
    "epa identify",
    "epa calibrate",
    "epa tune",
    "--fill",
    "--start-travel",
)
KEYS = (  # a hand holds it, or types
    "epa jog --rig config/rigs/bench.yaml --speed 1",
    "epa calibrate force --rig config/rigs/bench.yaml -o out --speed 1",
)
# what writes over nothing: the second time it says so
ONCE = ("epa export", "epa import", "--write")


FOR_PROGRAMS = ("--json", "epa completion", "epa schema")  # no line of it is for a reader


def as_on_a_terminal_of_80_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is printed from here on is laid out for a screen, without colours."""
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")
    for stream in (sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: True, raising=False)


def is_too_wide(line: str) -> bool:
    """Whether a line runs over; a path or another word without a blank cannot be broken."""
    line = line.rpartition("\r")[2].rstrip()
    return len(line) > 80 and max(map(len, line.split())) <= 78


def every_example() -> list[str]:
    found = [one for p in parsers(parser()) for one in examples(p.description or "")]
    return [one for one in dict.fromkeys(found) if one.startswith("epa ")]


def run_here(command: str) -> str | None:
    """The command as a test runs it; None where it is only parsed."""
    if any(words in command for words in (*NOT_HERE, *LONG)) or command in KEYS:
        return None
    if "epa identify" in command and "--no-physical" not in command:
        return None
    moves = command.startswith(("epa run ", "epa queue "))
    is_long = moves and any(words in command for words in LONG_RUNS)
    return f"{command} --dry" if is_long and "--dry" not in command else command


def words_of(command: str) -> list[str]:
    """Its words after epa, patterns filled in as a shell does."""
    words = []
    for word in shlex.split(command)[1:]:
        there = sorted(glob.glob(word)) if "*" in word and "_" not in word else []
        words += there or [word]
    return words


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    """What epa init writes, and logs of the names that the examples use."""
    folder = tmp_path_factory.mktemp("workspace")
    runs = (
        ("identification_short", "bench", "a"),
        ("knee_chirp_short", "knee", "knee_chirp-knee-001"),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(["init", "."]) == 0
        for seed, (experiment, rig, name) in enumerate(runs):
            words = ["run", f"config/experiments/{experiment}.yaml", "--seed", str(seed)]
            words += ["--rig", f"config/rigs/{rig}.yaml", "-o", f"out/{name}.mcap", "--quiet"]
            assert main(words) == 0
        for name in ("b", "identification_short-bench-001"):
            shutil.copy("out/a.mcap", f"out/{name}.mcap")
        assert main(["export", "out/a.mcap", "-o", "run.csv", "--trial", "1"]) == 0
    return folder


def test_there_are_examples_in_every_verb_and_all_are_understood(workspace, monkeypatch):
    monkeypatch.chdir(workspace)
    every = every_example()
    for verb in (p for p in parsers(parser()) if len(p.prog.split()) == 2):
        assert any(one.startswith(verb.prog) for one in every), verb.prog
    for command in every:
        if "LOG|" not in command:
            parser().parse_args(words_of(command.partition(" | ")[0]))


def _param(command: str) -> object:
    """Those that take over a second each of their two times are for -m slow."""
    is_slow = any(words in command for words in SLOW) and "--dry" not in command
    return pytest.param(command, marks=[pytest.mark.slow] if is_slow else [])


@pytest.mark.parametrize("command", [_param(c) for one in every_example() if (c := run_here(one))])
def test_an_example_works_twice(command, workspace, monkeypatch, capsys):
    monkeypatch.chdir(workspace)
    allowed = (0, 1) if command.startswith("epa doctor") else (0,)
    assert main(words_of(command)) in allowed, capsys.readouterr().err
    capsys.readouterr()
    as_on_a_terminal_of_80_columns(monkeypatch)
    second = main(words_of(command))
    shown, said = capsys.readouterr()
    if not any(words in command for words in FOR_PROGRAMS):
        wide = [line for line in (shown + said).splitlines() if is_too_wide(line)]
        assert wide == []
    if any(words in command for words in ONCE) and "--force" not in command:
        assert second == 2 and "found a file, expected" in said, said
    else:
        assert second in allowed, said
