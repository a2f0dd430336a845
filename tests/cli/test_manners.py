"""What the command line does for who mistypes, asks for help, or stands on a narrow screen."""

import argparse
import io
import os
import signal
import subprocess
import sys

import pytest

from epa_rt.cli.main import VERBS, main, parser
from epa_rt.cli.parser import examples
from epa_rt.cli.screen_text import broken, filled
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT

BENCH, STEP = str(RIGS / "bench.yaml"), str(EXPERIMENTS / "step.yaml")


def ended(capsys, *words: str) -> tuple[int, str, str]:
    """Exit code and both outputs of a command line."""
    try:
        code = main(list(words))
    except SystemExit as ending:
        code = ending.code
    said = capsys.readouterr()
    return code, said.out, said.err


def parsers(top: argparse.ArgumentParser) -> list[argparse.ArgumentParser]:
    """A parser and all below it."""
    found = [top]
    for action in top._actions:
        if isinstance(action, argparse._SubParsersAction):
            for one in dict.fromkeys(action.choices.values()):
                found += parsers(one)
    return found


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (("rnu", STEP), "did you mean run?"),
        (("gap", "digagnose"), "did you mean diagnose?"),
        (("run", STEP, "--rig", BENCH, "--sped", "1", "--x"), "did you mean --speed?"),
        (("run", STEP, "--rig", BENCH.replace("bench", "bnech")), "did you mean"),
        (("run", STEP, "--rig", BENCH, "--backend", "sin"), "did you mean sim?"),
        (("info", "docs/oprator.md"), "did you mean docs/operator.md?"),
        (("run", STEP), "found no --rig, expected --rig RIG"),
        (("run", "--rig", BENCH), "found no EXPERIMENT, expected "),
        (("run", STEP, "--rig"), "--rig: found nothing behind it, expected RIG"),
        (("run", STEP, "--rig", BENCH, "--speed", "x"), "--speed: found 'x', expected a number"),
        (("export", "a", "--trial", "x"), "--trial: found 'x', expected a whole number"),
        (("jog", "--rig", BENCH, "--move", "5"), "--move 5: found '5' without a unit"),
        (("gap", "diagnose", "--rig", BENCH, "a.mcap", "--json", "b.mcap"), "behind --json"),
        (("run", BENCH, "--rig", BENCH), "found a rig file, expected an experiment file"),
        (("run", STEP, "--rig", STEP), "found an experiment file, expected a rig file"),
    ],
)
def test_a_mistake_is_one_sentence_with_what_was_meant(words, meant, capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    code, out, err = ended(capsys, *words)
    assert code == 2 and out == ""
    assert err.count("\n") == 1 and meant in err, err


@pytest.mark.parametrize("verb", [("identify",), ("tune", "motor"), ("info",), ("report",)])
def test_links_in_a_circle_are_one_sentence(verb, tmp_path, capsys):
    log = tmp_path / "log.mcap"
    log.symlink_to("log.mcap")
    more = ("--experiment", f"{ROOT}/{STEP}") if verb[0] == "tune" else ()
    code, _, err = ended(capsys, *verb, str(log), *more)
    assert code == 2 and "found too many levels of symbolic links, expected a log" in err


def test_no_word_of_help_is_wider_than_the_screen(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    every = parsers(parser())
    assert len(every) > len(VERBS)
    for one in every:
        wide = [line for line in one.format_help().splitlines() if len(line) > 80]
        assert not wide, (one.prog, wide)


def test_ctrl_c_while_the_verbs_are_loaded_is_one_sentence(capsys, monkeypatch):
    def interrupted(_name):
        raise KeyboardInterrupt

    monkeypatch.setattr("epa_rt.cli.main.importlib.import_module", interrupted)
    assert main(["check", "x"]) == 130
    assert capsys.readouterr().err == "epa: interrupted\n"


@pytest.mark.parametrize("meets", ["argparse", "yaml", "difflib"])
def test_ctrl_c_while_the_program_is_loaded_is_one_line(meets):
    """At the import of a module, in a process of its own; an ignored one stays ignored."""
    early = (
        "import builtins, os, signal, sys; plain = builtins.__import__\n"
        "def importing(name, *rest):\n"
        f"    if name == {meets!r}: os.kill(os.getpid(), signal.SIGINT)\n"
        "    return plain(name, *rest)\n"
        "builtins.__import__ = importing; sys.argv = ['epa', 'check', '--version']\n"
        "import epa_rt.__main__ as start; sys.exit(start.main())"
    )
    ignored = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
    for before, code, said in (("", 130, "epa check: interrupted\n"), (ignored, 2, None)):
        command = [sys.executable, "-c", before + early]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        assert done.returncode == code, done.stderr
        assert said in (None, done.stderr)


def test_ctrl_c_while_the_program_ends_says_nothing_more():
    late = (
        "import os, signal, sys; sys.argv = ['epa', 'check', 'nowhere.yaml']\n"
        "import epa_rt.__main__ as start; start.main(); os.kill(os.getpid(), signal.SIGINT)"
    )
    done = subprocess.run([sys.executable, "-c", late], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == -signal.SIGINT
    assert "nowhere.yaml" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize("words", [(), ("gap",), ("study",), ("bus",)])
def test_without_arguments_there_is_help(words, capsys):
    code, out, err = ended(capsys, *words)
    assert code == 0 and out.startswith("usage: epa") and err == ""


def test_the_version_says_the_state_of_the_code(capsys):
    code, out, _ = ended(capsys, "--version")
    assert code == 0 and out.startswith("epa ") and "Python" in out
    if (ROOT / ".git").exists():
        assert "git " in out


def test_the_shell_completes_verbs_and_options():
    """Asked as bash asks it, through the console script's own main."""
    line = "epa run --spe"
    environment = os.environ | {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_STDOUT_FILENAME": "/dev/stdout",
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
    }
    command = [sys.executable, "-c", "from epa_rt.cli.main import main; main()"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.stdout.split() == ["--speed"], done.stderr


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_its_script(shell, capsys):
    code, out, _ = ended(capsys, "completion", shell)
    assert code == 0 and "epa" in out and "_ARGCOMPLETE" in out


@pytest.mark.parametrize("value", ["0", "-1", "nan", "fast"])
@pytest.mark.parametrize("verb", ["home", "jog"])
def test_a_pace_is_above_zero(verb, value, capsys):
    code, _, err = ended(capsys, verb, "--rig", BENCH, f"--speed={value}")
    assert code == 2 and "--speed" in err


@pytest.mark.parametrize("option", ["--unreferenced", "--start-travel=1 mm"])
def test_a_real_rig_cannot_be_told_where_it_stands(option, capsys):
    code, _, err = ended(capsys, "home", "--rig", BENCH, "--backend", "ethercat", "--yes", option)
    assert code == 2 and "the simulated rig only" in err


def test_under_an_emulated_bus_interface_and_pace_are_known(capsys, monkeypatch):
    monkeypatch.setenv("EPA_BUS_INTERFACE", "ecat_master")
    monkeypatch.setenv("EPA_BUS_LOCK_STEP", "1")
    given = parser().parse_args(["run", STEP, "--rig", BENCH])
    assert (given.interface, given.lock_step) == ("ecat_master", True)
    assert parser().parse_args(["scan"]).interface == "ecat_master"
    monkeypatch.setenv("EPA_BUS_LOCK_STEP", "0")
    assert parser().parse_args(["run", STEP, "--rig", BENCH]).lock_step is False
    code, _, err = ended(capsys, "run", STEP, "--rig", BENCH, "--lock-step")
    assert code == 2 and err.count("\n") == 1 and "goes by the clock" in err


def test_examples_come_out_of_a_help_text_whole():
    text = "Words.\n\n  epa a b \\\n      --c d     why\n  epa e\n           because\nx:\n  epa f\n"
    assert examples(text) == ["epa a b --c d", "epa e", "epa f"]


def test_a_long_sentence_breaks_between_words_and_paths_stay_whole():
    path = "/a/very/" + "long/" * 20 + "path.mcap"
    text = f"log: {path} is there, and what follows is so long that no narrow screen takes it"
    lines = broken(f"  {text}", 60).split("\n")
    assert path in "".join(lines) and any(path in line for line in lines)
    assert all(len(line) <= 60 for line in lines if path not in line)
    assert " ".join(" ".join(lines).split()) == text
    assert filled(text, io.StringIO()) == text
