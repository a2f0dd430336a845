"""How the documents read: words in a sentence, characters in a cell of a table, lines of a page.

    python scripts/prose.py                  every page, as a table
    python scripts/prose.py docs/plant.md    its longest sentences and cells

A sentence is what stands in a paragraph or in an item of a list, up to a full stop, a question or
an exclamation mark. Code blocks and headings are left out.
"""

import argparse
import json
import re
import statistics
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
MOST_WORDS, MEDIAN_WORDS, MOST_CELL = 40, 18, 100
# the record of the diagnosis, which nobody reads to use it
WITH_THE_DIAGNOSIS = (
    "0012-places.md",
    "0013-rougher-runs-for-derivatives.md",
    "0014-rigs-of-others.md",
    "0015-side-by-side.md",
)
_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")
_END = re.compile(r"(?<=[.!?])[)\"'*`]*\s+(?=[A-Z\"'(*`\[0-9])|;\s+(?=\|)")
_ITEM = re.compile(r"^\s*(?:[-*+]|\d+\.)\s+")


class Page(NamedTuple):
    """What is measured of a page: sentences and cells as they stand, and its lines."""

    name: str
    sentences: list[str]
    cells: list[str]
    lines: int

    @property
    def median(self) -> float:
        """Words of the middle sentence; 0 of a page without any."""
        return statistics.median(map(words, self.sentences)) if self.sentences else 0.0

    @property
    def too_long(self) -> list[str]:
        """Sentences and cells beyond what a reader is asked to bear."""
        return [s for s in self.sentences if words(s) > MOST_WORDS] + [
            c for c in self.cells if len(c) > MOST_CELL
        ]


def words(sentence: str) -> int:
    """Words of a sentence; a piece of code counts as one."""
    return len(re.sub(r"`[^`]*`", "code", sentence).split())


def page(path: Path) -> Page:
    """A page read and cut into sentences and cells."""
    text = path.read_text(encoding="utf-8")
    paragraphs, cells, block, in_code = [], [], [], False

    def close() -> None:
        if block:
            paragraphs.append(" ".join(block))
            block.clear()

    for line in text.splitlines():
        if line.lstrip().startswith("```"):
            in_code = not in_code
            close()
        elif in_code or (line.startswith("    ") and not block):
            continue
        elif line.lstrip().startswith("|"):
            close()
            cells += [shown(cell) for cell in line.strip().strip("|").split("|")]
        elif not line.strip() or line.startswith("#") or line.startswith("!["):
            close()
        elif _ITEM.match(line):
            close()
            block.append(_ITEM.sub("", line).strip())
        else:
            block.append(line.strip())
    close()
    sentences = [s for one in paragraphs for s in _END.split(shown(one)) if words(s) > 1]
    return Page(path.name, sentences, [c for c in cells if c], len(text.splitlines()))


def shown(text: str) -> str:
    """Text as a reader sees it: links by their words."""
    return _LINK.sub(r"\1", text).strip()


def pages() -> list[Path]:
    """README and all pages under docs/, decisions included."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("page", nargs="*", type=Path)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    found = [page(path) for path in (asked.page or pages())]
    if asked.json:
        rows = [
            {"page": p.name, "median": p.median, "too_long": len(p.too_long), "lines": p.lines}
            for p in found
        ]
        print(json.dumps(rows, indent=1))
    elif asked.page:
        for one in found:
            print(f"{one.name}: {one.lines} lines, median {one.median:g} words")
            for text in one.too_long:
                print(f"  {words(text)} words, {len(text)} characters: {text}")
    else:
        for one in found:
            print(f"{one.median:5.1f} {len(one.too_long):4d} {one.lines:5d}  {one.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
