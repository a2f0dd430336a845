"""What is written is asked for by one name in every verb; old names are taken with a sentence."""

import argparse
import json

import pytest

from epa_rt.cli.main import main, parser
from epa_rt.cli.outputs import SCREEN, OldSpelling, json_spelt_out
from tests.cli.shell import RIGS
from tests.cli.test_manners import ended, parsers

BENCH = str(RIGS / "bench.yaml")
BENCHMARK = "epa gap blind"  # keeps answers beside its JSON, so it needs a file (decision 0019)


def actions() -> list[tuple[str, argparse.Action]]:
    return [(one.prog, action) for one in parsers(parser()) for action in one._actions]


@pytest.mark.parametrize("option", ["--json", "--html", "--picture", "--pictures"])
def test_an_option_takes_the_same_in_every_verb(option):
    found = {
        (type(action), action.nargs, action.metavar)
        for prog, action in actions()
        if option in action.option_strings and not prog.startswith(BENCHMARK)
    }
    assert len(found) == 1, found


def test_nothing_that_is_shown_has_an_old_name():
    old = [(prog, a) for prog, a in actions() if isinstance(a, OldSpelling)]
    assert {a.option_strings[0] for _, a in old} == {"-o", "--patch", "--rule", "--file"}
    for prog, action in old:
        shown = [a for p, a in actions() if p == prog and a.help != argparse.SUPPRESS]
        assert any(a.dest == action.dest and action.now in a.option_strings for a in shown), prog


@pytest.mark.parametrize(
    ("words", "dest", "now"),
    [
        (("report", "a.mcap", "-o", "x.html"), "html", "--html"),
        (("plot", "a.mcap", "--out", "x.html"), "html", "--html"),
        (("gap", "diagnose", "--rig", BENCH, "a.mcap", "--patch", "x.yaml"), "patch", "-o"),
        (("study", "serial", "s.yaml", "--rule", "x.yaml"), "rule", "-o"),
        (("calibrate", "force", "--rig", BENCH, "--file", "x.yaml"), "file", "--write"),
    ],
)
def test_an_old_name_is_taken_and_told(words, dest, now, capsys):
    found = parser().parse_args(words)
    assert vars(found)[dest].stem == "x"
    said = capsys.readouterr()
    assert said.out == "" and f"{words[-2]} is called {now} now" in said.err


@pytest.mark.parametrize(
    ("words", "json"),
    [
        (["check", "--json", BENCH], SCREEN),
        (["info", "--json", "a.mcap"], SCREEN),
        (["info", "a.mcap", "--json"], SCREEN),
        (["info", "a.mcap", "--json", "-"], SCREEN),
        (["ls", "--json", "out"], SCREEN),
        (["ls", "--json", "--long"], SCREEN),
        (["identify", "--json", "a.json", "a.mcap"], "a.json"),
        (["identify", "a.mcap", "--json=a.json"], "a.json"),
        (["identify", "a.mcap", "--json", "a.txt"], "a.txt"),  # then refused for its ending
        (["identify", "a.mcap"], None),
    ],
)
def test_json_takes_a_name_or_goes_to_the_screen(words, json):
    found = parser().parse_args(words).json
    assert found is None if json is None else str(found) == str(json)


def test_words_without_json_stay():
    assert json_spelt_out(["a", "--html", "b.html"]) == ["a", "--html", "b.html"]
    assert json_spelt_out(["--json", "--json", "x.json"]) == ["--json=-", "--json", "x.json"]


def test_a_program_behind_two_dashes_keeps_its_own_json():
    found = parser().parse_args(["bus", "run", "--rig", BENCH, "--", "other", "--json"])
    assert "--json" in found.command


@pytest.mark.parametrize("words", [("check", BENCH), ("gap", "catalogue")])
def test_the_screen_and_the_file_get_the_same(words, tmp_path, capsys):
    file = tmp_path / "answer.json"
    code, alone, _ = ended(capsys, *words, "--json")
    assert code == 0
    code, shown, _ = ended(capsys, *words, "--json", str(file))
    assert code == 0 and json.loads(file.read_text()) == json.loads(alone)
    assert shown and not shown.startswith(("[", "{"))


def test_a_wrong_ending_is_refused_before_any_work(capsys):
    for words in (("check", BENCH), ("ls", "config"), ("info", "missing.mcap")):
        code, out, err = ended(capsys, *words, "--json", "a.txt")
        assert code == 2 and out == "" and "found the ending '.txt', expected .json" in err


def test_what_a_computation_says_goes_aside(tmp_path, capsys):
    log = tmp_path / "a.mcap"
    run = ["run", str(RIGS.parent / "experiments/step.yaml"), "--rig", BENCH, "-o", str(log)]
    assert main([*run, "--quiet", "--json"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["outcome"] == "completed" and "completed" in said.err
    assert main(["compare", str(log), str(log), "--json"]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["different"] is False and said.err
