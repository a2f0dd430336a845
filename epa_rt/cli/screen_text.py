"""Long sentences on a terminal: broken between words where its screen ends, whole in a file."""

import shutil
import sys
import textwrap
from typing import TextIO

from epa_rt.logs.plain_text import plain

NARROWEST = 40  # columns; below, lines are left to the terminal


def filled(text: str, stream: TextIO | None = None) -> str:
    """The text with each line broken between words for the terminal that ``stream`` (default:
    stdout) is; as it is where that is none. Paths and numbers stay whole. Nothing of it steers the
    terminal (plain_text.py).
    """
    text = plain(text)
    out = sys.stdout if stream is None else stream
    width = shutil.get_terminal_size().columns
    if not out.isatty() or width < NARROWEST:
        return text
    return "\n".join(broken(line, width) for line in text.split("\n"))


def broken(line: str, width: int) -> str:
    """One line as several of at most ``width``, the later ones indented by two more."""
    if len(line) <= width:
        return line
    lead = line[: len(line) - len(line.lstrip())]
    return textwrap.fill(
        line.strip(),
        width,
        initial_indent=lead,
        subsequent_indent=f"{lead}  ",
        break_long_words=False,
        break_on_hyphens=False,
    )
