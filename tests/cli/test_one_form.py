"""The verbs agree: one spelling for one thing, and a mistake is told by who met it."""

import argparse

import pytest

from epa_rt.cli.main import main, parser
from tests.cli.test_manners import ended, parsers

# an option, and what must stand beside it
TOGETHER = {
    "-o": "--out",
    "--backend": "--take-over",
    "--lock-step": "--interface",
    "--note": "--operator",
}
MOVES_THE_RIG = ("run", "home", "jog", "calibrate", "tune")
ON_A_RUN = ("--rig", "--plant", "--backend", "--out", "--seed", "--speed", "--operator", "--quiet")


def options(one: argparse.ArgumentParser) -> set[str]:
    return {word for action in one._actions for word in action.option_strings}


@pytest.mark.parametrize("one", parsers(parser()), ids=lambda one: one.prog)
def test_options_of_one_meaning_have_one_name(one):
    if one.prog in ("epa bus run", "epa bus serve"):  # the other end of the wire
        return
    has = options(one)
    for option, beside in TOGETHER.items():
        assert option not in has or beside in has, (option, beside)
    assert "--output" not in has
    for action in one._actions:
        if {"--quiet", "--dry"} & set(action.option_strings):
            assert action.nargs == 0
        is_group = isinstance(action, argparse._SubParsersAction)
        assert action.help or is_group, action.dest


def test_what_moves_the_rig_takes_the_same():
    verbs = {one.prog.removeprefix("epa "): options(one) for one in parsers(parser())}
    for verb in MOVES_THE_RIG:
        assert set(ON_A_RUN) <= verbs[verb], verb


@pytest.mark.parametrize(
    "words",
    [
        ("gap", "catalogue", "--kind", "none"),
        ("gap", "patch", "missing.json", "--rig", "missing.yaml", "-o", "out.yaml"),
        ("study", "knee", "missing.yaml"),
        ("compare", "missing.mcap", "missing.mcap"),
        ("export", "missing.mcap", "-o", "x.csv"),
        ("tune", "joint", "missing.mcap", "--quiet"),
    ],
)
def test_a_mistake_is_told_by_the_verb_and_its_task(words, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    code, out, err = ended(capsys, *words)
    said = " ".join(("epa", *words[: 2 if words[0] in ("gap", "study") else 1]))
    assert code == 2 and out == "" and err.startswith(f"{said}: ") and err.count("\n") == 1, err


def test_nothing_is_left_of_a_refusal(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["export", "missing.mcap", "-o", "x.csv"]) == 2
    assert not list(tmp_path.iterdir())
