"""Long texts of generated tables: a short cell, and what it leaves out below the table."""

import re
import sys
import textwrap
from collections.abc import Iterable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from scripts.prose import MOST_CELL, MOST_WORDS, words

ADVICE = "; check "  # what follows it in a trip's sentence says where to look


def short(sentence: str, without: Iterable[str] = ()) -> str:
    """A sentence for a cell: no prefix that another column says, no advice, at most MOST_CELL
    characters; one that is cut ends in an ellipsis.
    """
    text = sentence.split(ADVICE)[0]
    for prefix in without:
        text = text.removeprefix(prefix)
    if len(text) <= MOST_CELL:
        return text
    return text[: MOST_CELL - 2].rsplit(" ", 1)[0].rstrip(",;:") + " …"


def left_out(sentences: Iterable[str], without: Iterable[str] = ()) -> list[str]:
    """List items, one for each different sentence of which the cell shows a part only."""
    prefixes = tuple(without)
    return [
        f"- `{one}`"
        for one in dict.fromkeys(sentences)
        if ADVICE in one or short(one, prefixes).endswith(" …")
    ]


def advices(sentences: Iterable[str]) -> list[str]:
    """List items, one for each different advice at the end of sentences; figures left open."""
    found = (one.split(ADVICE, 1)[1] for one in sentences if ADVICE in one)
    return [f"- {text}" for text in dict.fromkeys(re.sub(r"\b\d+ kPa", "… kPa", x) for x in found)]


class Notes:
    """Texts too long for a cell, numbered; equal texts share a number."""

    def __init__(self) -> None:
        self._texts: list[str] = []

    def cell(self, text: str) -> str:
        """The text itself where it fits, else where to find it."""
        if len(text) <= MOST_CELL:
            return text
        if text not in self._texts:
            self._texts.append(text)
        return f"note {self._texts.index(text) + 1}"

    def lines(self) -> list[str]:
        """A numbered list; an enumeration longer than a sentence may be becomes a list in it."""
        lines = []
        for number, text in enumerate(self._texts, 1):
            parts = text.split("; ")
            if len(parts) > 1 and words(text) > MOST_WORDS and ". " not in text:
                lines += [f"{number}. Each:", *(f"   - {part}" for part in parts)]
            else:
                lines += textwrap.wrap(f"{number}. {text}", 100, subsequent_indent="   ")
        return lines
