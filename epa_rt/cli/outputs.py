"""Options that name what a verb writes: page, answer for machines; and their old spellings
(docs/decisions/0019-names-of-outputs.md).
"""

import argparse
import contextlib
import sys
from collections.abc import Iterator, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import Any

SCREEN = Path("/dev/stdout")  # where --json without a name goes
_INPUTS = (".mcap", ".yaml", ".yml")  # a file behind --json that a verb reads
_answer: ContextVar[list[str] | None] = ContextVar("_answer", default=None)


class JsonOption(argparse.Action):
    """``--json [FILE.json]``: to a file, or on standard output where no name follows."""

    def __init__(self, option_strings: Sequence[str], dest: str, **options: Any):
        super().__init__(
            option_strings, dest, nargs="?", const=SCREEN, metavar="FILE.json", **options
        )

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        path = Path(values)
        setattr(namespace, self.dest, SCREEN if path == Path("-") else path)


class OldSpelling(argparse.Action):
    """An option under the name that it had: taken, with a sentence on stderr that names ``now``."""

    def __init__(self, option_strings: Sequence[str], dest: str, now: str, **options: Any):
        super().__init__(option_strings, dest, help=argparse.SUPPRESS, **options)
        self.now = now

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        print(
            f"{parser.prog}: {option_string} is called {self.now} now; taken as that",
            file=sys.stderr,
        )
        setattr(namespace, self.dest, values)


def add_html_argument(
    verb: argparse.ArgumentParser, what: str = "write the answer as a page"
) -> None:
    verb.add_argument("--html", type=Path, metavar="PAGE.html", help=what)


def add_json_argument(verb: argparse.ArgumentParser, what: str = "the answer for machines") -> None:
    verb.add_argument(
        "--json", action=JsonOption, help=f"{what}, into a file, or on the screen without a name"
    )


def add_old_spelling(verb: argparse.ArgumentParser, *names: str, now: str, dest: str) -> None:
    """``names`` go on to be taken for ``now``, whose value stands in ``dest``."""
    verb.add_argument(*names, action=OldSpelling, now=now, dest=dest, type=Path)


def json_spelt_out(words: Sequence[str]) -> list[str]:
    """The words with ``--json`` as ``--json=-`` where what follows is no name for an answer: an
    option, a log, a file that is read, a folder, a word without ending.
    """
    return [
        "--json=-" if word == "--json" and not _names_answer(words[i + 1 : i + 2]) else word
        for i, word in enumerate(words)
    ]


def _names_answer(following: Sequence[str]) -> bool:
    if not following or following[0].startswith("-"):
        return following == ["-"]
    path = Path(following[0])
    if path == SCREEN:
        return True
    return bool(path.suffix) and path.suffix.lower() not in _INPUTS and not path.is_dir()


def is_screen(path: Path | None) -> bool:
    return path == SCREEN


@contextlib.contextmanager
def answer_alone(path: Path | None) -> Iterator[None]:
    """Where the answer goes to the screen, whatever else a verb prints goes to stderr, and the last
    answer that it wrote stands alone on standard output at the end.
    """
    if not is_screen(path):
        yield
        return
    written: list[str] = []
    token = _answer.set(written)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    finally:
        _answer.reset(token)
        if written:
            print(written[-1], end="")


def keep_answer(text: str) -> bool:
    """Keeps an answer for the screen; False where none goes there."""
    written = _answer.get()
    if written is None:
        return False
    written.append(text)
    return True
