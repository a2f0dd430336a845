"""The command line's manners: help that fits the screen, and a guess for what was misspelt."""

import argparse
import itertools
import re
import sys
import textwrap
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

from epa_rt.cli.outputs import JsonOption, json_spelt_out
from epa_rt.cli.screen_text import filled
from epa_rt.config.near_names import nearest

_CHOICE = re.compile(r"argument ([^:]*): invalid choice: '([^']*)' \(choose from (.*)\)")
_UNKNOWN = "unrecognized arguments: "
_MISSING = "the following arguments are required: "
_ALONE = re.compile(r"argument (-[^:]*): expected .* arguments?")
_NO_NUMBER = re.compile(r"argument ([^:]*): invalid (\w+) value: (.*)")
_WITH_COMMENT = re.compile(r"\s{2,}(?:#\s*)?")
_PROGRAM = re.compile(r"\s+(?:epa|source|eval) ")


class EpaParser(argparse.ArgumentParser):
    """Without any argument it gives its help where a verb or task is to follow; a mistake ends with
    one sentence and exit code 2.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        options["formatter_class"] = NarrowHelp
        super().__init__(*args, **options)
        self.set_defaults(program=self.prog)  # who speaks: the verb, or its task

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """As argparse, but what a verb does not know is its own mistake and not that of epa."""
        given = sys.argv[1:] if args is None else list(args)
        if not given and self._choices():
            self.print_help()
            self.exit(0)
        if any(isinstance(action, JsonOption) for action in self._actions):
            given = json_spelt_out(given)
        found, rest = super().parse_known_args(given, namespace)
        if rest and ("--json=-", rest[0]) in itertools.pairwise(given):
            self.error(
                f"found '{rest[0]}' behind --json, expected a name that ends in .json there, or"
                " --json as the last word"
            )
        if rest:
            self.error(_UNKNOWN + " ".join(rest))
        return found, rest

    def error(self, message: str) -> NoReturn:
        """One sentence, with the name that was probably meant."""
        sentence = f"{self.prog}: {self._sentence(message)} ({self.prog} --help)"
        self.exit(2, f"{filled(sentence, sys.stderr)}\n")

    def _sentence(self, message: str) -> str:
        if message.startswith(_UNKNOWN):
            return self._unknown(message.removeprefix(_UNKNOWN))
        if message.startswith(_MISSING):
            return self._missing(message.removeprefix(_MISSING))
        if alone := _ALONE.fullmatch(message):
            found = "nothing" if "one argument" in message else "too little"
            return f"{alone[1]}: found {found} behind it, expected {self._takes(alone[1])}"
        if no_number := _NO_NUMBER.fullmatch(message):
            whole = "a whole number" if no_number[2] == "int" else "a number"
            return f"{no_number[1]}: found {no_number[3]}, expected {whole}"
        wrong = _CHOICE.fullmatch(message)
        if wrong is None:
            return message.removeprefix("argument ")
        where, found, choices = wrong.groups()
        known = [choice.strip("' ") for choice in choices.split(",")]
        meant = nearest(found, known)
        guess = f"; did you mean {meant}?" if meant else f": {', '.join(known)}"
        return f"found '{found}' as {where}, expected a known one{guess}"

    def _unknown(self, text: str) -> str:
        first = text.split()[0].split("=")[0] if text.split() else text
        if not first.startswith("-"):
            return f"found '{text}' too much, expected no more arguments"
        meant = nearest(first, self._option_string_actions)
        guess = f"; did you mean {meant}?" if meant else ""
        return f"found the option '{first}', expected one that it knows{guess}"

    def _missing(self, names: str) -> str:
        """``names``: as argparse lists what was left out."""
        missing = names.split(", ")
        expected = [
            f"{name.split('/')[0]} {self._takes(name)}" if name.startswith("-") else self._is(name)
            for name in missing
        ]
        return f"found no {' and no '.join(missing)}, expected {' and '.join(expected)}"

    def _is(self, name: str) -> str:
        """What stands in a place of the command line, by its help."""
        words = [a.help for a in self._actions if name in (a.metavar, a.dest) and a.help]
        return words[0] % {"default": ""} if words else name

    def _takes(self, name: str) -> str:
        """What stands behind an option, as its help writes it."""
        action = self._option_string_actions[name.split("/")[0]]
        shown = action.metavar or action.dest.upper()
        return shown if isinstance(shown, str) else " ".join(shown)

    def _choices(self) -> list[str]:
        """Verbs or tasks that may follow."""
        groups = [a for a in self._actions if isinstance(a, argparse._SubParsersAction)]
        return [name for group in groups for name in group.choices]


class NarrowHelp(argparse.HelpFormatter):
    """Paragraphs are filled; of an example the comment comes first, then the command, broken where
    the screen ends so that it can still be pasted.
    """

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        blocks = [b.splitlines() for b in re.split(r"\n\s*\n", text.strip("\n"))]
        return "\n\n".join("\n".join(_block(lines, width)) for lines in blocks) + "\n"


def summary(doc: str) -> str:
    """The first paragraph of a module's description, for a list of verbs."""
    return " ".join(doc.strip().split("\n\n")[0].split()).replace("%", "%%")


def examples(text: str) -> list[str]:
    """The commands of a help text, one line each."""
    lines = [line for b in re.split(r"\n\s*\n", text) for line in b.splitlines()]
    return [command for command, _ in _examples(lines)]


def _block(lines: list[str], width: int) -> Iterator[str]:
    """A paragraph as lines of at most ``width``: plain ones are filled, indented ones stay."""
    plain = list(_until(lines, lambda line: line.startswith("  ")))
    if plain:
        yield from textwrap.wrap(" ".join(plain), width, break_on_hyphens=False)
    rest = lines[len(plain) :]
    if any(_PROGRAM.match(line) for line in rest):
        for command, comment in _examples(rest):
            if comment:
                yield from textwrap.wrap(
                    comment, width, initial_indent="  # ", subsequent_indent="  # "
                )
            yield from _broken(command, width)
        return
    for line in rest:
        lead = line[: len(line) - len(line.lstrip())]
        yield from textwrap.wrap(
            line.strip(),
            width,
            initial_indent=lead,
            subsequent_indent=f"{lead}    ",
            break_on_hyphens=False,
        )


def _until(lines: list[str], ends: Any) -> Iterator[str]:
    for line in lines:
        if ends(line):
            return
        yield line


def _examples(lines: list[str]) -> Iterator[tuple[str, str]]:
    """(command, comment) of indented lines; a deeper line goes on with what stands before it."""
    command, comment = "", ""
    for line in lines:
        if _PROGRAM.match(line) and not command.endswith("\\"):
            if command:
                yield command, comment
            command, comment = _split(line.strip())
        elif command.endswith("\\"):
            more, comment = _split(line.strip())
            command = f"{command[:-1].rstrip()} {more}"
        elif command and line.startswith("      "):
            comment = f"{comment} {line.strip()}".strip()
    if command:
        yield command, comment


def _split(line: str) -> tuple[str, str]:
    parts = _WITH_COMMENT.split(line, maxsplit=1)
    return parts[0], parts[1] if len(parts) > 1 else ""


def _broken(command: str, width: int) -> list[str]:
    """A command over several lines that a shell takes as one."""
    parts = [""]
    for word in re.split(r"\s+(?=-)", command):  # an option stays beside its value
        if parts[-1] and len(parts[-1]) + len(word) + 3 > width:
            parts.append("")
        lead = " " if parts[-1].strip() else "  " if len(parts) == 1 else "      "
        parts[-1] += lead + word
    return [f"{part} \\" for part in parts[:-1]] + parts[-1:]
