"""Markdown of the reference pages: tables with short cells, an index, and notes for long words."""

import re
from collections.abc import Iterable, Sequence

MOST_CELL = 100  # characters of a cell, as scripts/prose.py asks
WRITTEN = (
    "Written by `python scripts/reference_pages.py --write`; a test holds the page to the code."
)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; empty where there are no rows. Raises ValueError for a cell too long to read."""
    lines = [_line(row) for row in rows]
    if not lines:
        return ""
    return "\n".join([_line(head), "|" + "---|" * len(head), *lines]) + "\n"


def _line(cells: Sequence[str]) -> str:
    shown = [cell.replace("|", "\\|") or "–" for cell in cells]
    for cell in shown:
        if len(cell) > MOST_CELL:
            raise ValueError(f"a cell of {len(cell)} characters, at most {MOST_CELL}: {cell}")
    return "| " + " | ".join(shown) + " |"


def index(groups: Iterable[Sequence[str]]) -> str:
    """A list of links to headings, one line for each group."""
    return "".join(
        f"- {', '.join(f'[{title}](#{anchor(title)})' for title in titles)}\n" for titles in groups
    )


def anchor(title: str) -> str:
    """What a heading is linked by."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def prose(text: str) -> str:
    """A docstring's first sentence as markdown: one line, single back-ticks."""
    first = re.split(r"(?<=[.:])\s", " ".join(text.split()), maxsplit=1)[0]
    return first.replace("``", "`").rstrip(".:") + "."


def cut(meaning: str) -> str:
    """A meaning for a cell: its first clause where a note below has to hold the rest."""
    if len(meaning) <= MOST_CELL:
        return meaning
    first = re.split(r"[;:(,]", meaning, maxsplit=1)[0].strip()
    return f"{first} (below)" if len(first) + 8 <= MOST_CELL else "below"
