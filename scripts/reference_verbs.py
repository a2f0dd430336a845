"""docs/verbs.md from the real parser: what each verb does, takes and ends with."""

import argparse
import ast
import re
from collections.abc import Iterator
from pathlib import Path

from reference_table import MOST_CELL, WRITTEN, cut, index, table

from epa_rt.cli import exits
from epa_rt.cli.main import parser
from epa_rt.cli.parser import NarrowHelp, examples

ROOT = Path(__file__).resolve().parents[1]
WIDTH = 80
_DEFAULT = re.compile(r"\s*\(default(?:, [^:)]*)?: ((?:[^()]|\([^()]*\))*)\)")
_OF_A_RUN = ("exit_code", "code_of_run")  # what ends a run, by its outcome and the rig's state
HEAD = """# Verbs

Every verb of `epa` with its options. {written}
Which to use when: [first hour](tutorials/first-hour.md), [command line](command-line.md).

{index}
## Exit codes

{codes}
Any verb may end with 0, 2, 4 (what it says cannot be written) or 130. Others stand with the verb.
"""
CODES = (
    (exits.COMPLETED, "completed"),
    (exits.DIFFERENT, "a comparison differs, a check found something, or a damaged log is usable"),
    (exits.BAD_INPUT, "bad input; one sentence says what"),
    (exits.TRIPPED, "tripped"),
    (exits.FAILED, "bus lost, or no whole log"),
    (exits.STOPPED, "stopped by the operator, or because the machine was late (overruns)"),
    (exits.NOT_OFF, "added after a run: the drive was not measured to be off"),
    (exits.NOT_VENTED, "added after a run: the muscles were not measured to be vented"),
    (exits.NOT_AT_REST, "added after a run: the rig was not measured to be at rest"),
)


def page() -> str:
    """docs/verbs.md as text."""
    every = [one for one in _parsers(parser()) if one.prog != "epa"]
    codes = table(("Code", "Meaning"), [(str(code), words) for code, words in CODES])
    groups: dict[str, list[str]] = {}
    for one in every:
        words = one.prog.split()
        groups.setdefault(" ".join(words[: 3 if "blind" in words else 2]), []).append(one.prog)
    head = HEAD.format(written=WRITTEN, index=index(groups.values()), codes=codes)
    return head + "".join(_section(one) for one in every)


def _parsers(top: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield top
    for action in top._actions:
        if isinstance(action, argparse._SubParsersAction):
            for one in dict.fromkeys(action.choices.values()):
                yield from _parsers(one)


def _section(one: argparse.ArgumentParser) -> str:
    described = one.description or ""
    said = " ".join(described.strip().split("\n\n")[0].split())
    parts = [f"\n## {one.prog}\n\n{said}\n", f"\n```\n{_usage(one)}\n```\n"]
    actions = [
        action
        for action in one._actions
        if not isinstance(action, (argparse._HelpAction, argparse._SubParsersAction))
        and action.help != argparse.SUPPRESS
    ]
    rows, notes = [], []
    for action in actions:
        cells, note = _row(action)
        rows.append(cells)
        notes += [note] if note else []
    if rows:
        parts.append("\n" + table(("Argument", "Value", "Default", "Meaning"), rows))
    if notes:
        parts.append("\n" + "\n".join(notes) + "\n")
    if codes := _codes(one.prog):
        parts.append(f"\nExit codes beside the common ones: {codes}.\n")
    if found := examples(described):
        parts.append(f"\n```\n{_example(found[0])}\n```\n")
    return "".join(parts)


def _usage(one: argparse.ArgumentParser) -> str:
    formatter = NarrowHelp(one.prog, width=WIDTH)
    formatter.add_usage(one.usage, one._actions, one._mutually_exclusive_groups)
    return formatter.format_help().strip().removeprefix("usage: ")


def _example(command: str) -> str:
    """The command over lines that a shell takes as one."""
    text = NarrowHelp("epa", width=WIDTH)._fill_text(f"  {command}", WIDTH, "")
    return "\n".join(line.removeprefix("  ") for line in text.strip("\n").splitlines())


def _row(action: argparse.Action) -> tuple[tuple[str, str, str, str], str]:
    """Argument, value, default, meaning; and a note where the meaning is too long for a cell."""
    name = ", ".join(f"`{option}`" for option in action.option_strings)
    if not name:
        name = f"`{action.metavar if isinstance(action.metavar, str) else action.dest}`"
    words = " ".join((action.help or "").split()).replace("%%", "%")
    told = _DEFAULT.search(words)
    default = told.group(1) if told else ""
    if not default or "%(default)s" in default:
        default = default.replace("%(default)s", _plain(action.default)) or _plain(action.default)
    meaning = _DEFAULT.sub("", words).strip()
    value = _value(action)
    note = ""
    if len(meaning) > MOST_CELL or len(default) > MOST_CELL or len(value) > MOST_CELL:
        full = f"{meaning}; default: {default}" if len(default) > MOST_CELL else meaning
        if len(value) > MOST_CELL:
            full, value = f"{full}; one of {value}", "one of a list"
        note = f"- {name}: {full}."
        default = default if len(default) <= MOST_CELL else "below"
    return (name, value, default, cut(meaning)), note


def _plain(default: object) -> str:
    if default is None or default is False or default in ("", [], (), argparse.SUPPRESS):
        return ""
    if isinstance(default, (list, tuple)):
        return ", ".join(map(str, default))
    return str(default)


def _value(action: argparse.Action) -> str:
    """What follows the option."""
    if action.nargs == 0:
        return ""
    if action.choices is not None:
        return ", ".join(str(choice) for choice in action.choices)
    if isinstance(action.metavar, tuple):
        return " ".join(action.metavar)
    word = action.metavar or (action.dest.upper() if action.option_strings else action.dest)
    more = {"+": f"{word} ...", "*": f"[{word} ...]", "?": f"[{word}]"}
    return more.get(str(action.nargs), word)


def _codes(prog: str) -> str:
    """What the verb's modules name of the exit codes, beside those of every verb."""
    names = set().union(*(_names(path) for path in _modules(prog.split()[1:])))
    found = [str(exits.DIFFERENT)] if "DIFFERENT" in names else []
    if names & set(_OF_A_RUN):
        found += [str(exits.TRIPPED), "those added after a run"]
    return ", ".join(found)


def _modules(words: list[str]) -> list[Path]:
    """The modules of a verb: that of its own words, and where it has no tasks those named
    after it.
    """
    folder = (ROOT / "epa_rt/cli").joinpath(*words[:-1])
    stem = words[-1]
    own = [folder / f"{name}.py" for name in (stem, f"{stem}_", f"{stem}_rig")]
    joined = ROOT / "epa_rt/cli" / f"{'_'.join(words)}.py"
    found = [path for path in (*own, joined) if path.exists()]
    return found or [
        path
        for path in (folder / stem / "__init__.py", ROOT / f"epa_rt/cli/{words[0]}.py")
        if path.exists()
    ]


def _names(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
