"""The pages to look things up are what the script writes from the code."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NAMES = ("verbs.md", "files.md", "states.md")


def test_pages_are_what_the_code_says_and_read_well():
    """In a process of its own: the pages do not depend on what tests have set."""
    for command in (["reference_pages.py"], ["prose.py", *(f"docs/{name}" for name in NAMES)]):
        script, *rest = command
        done = subprocess.run(
            [sys.executable, ROOT / "scripts" / script, *rest],
            cwd=ROOT,
            capture_output=True,
            text=True,
            timeout=600,
        )
        assert done.returncode == 0, (done.stdout, done.stderr)
        # a sentence or cell that is too long stands on an indented line
        assert not [line for line in done.stdout.splitlines() if line.startswith("  ")]


def test_the_operators_page_has_the_same_causes_of_a_trip():
    looked_up, told = (
        [
            cause
            for row in re.findall(r"^\| ([^|]+) \|", section, flags=re.M)
            if row not in ("Cause", "---")
            for cause in row.split(", ")
        ]
        for section in (
            section_of("states.md", "## Causes of a trip"),
            section_of("operator.md", "## What trips"),
        )
    )
    assert sorted(told) == sorted(looked_up)


def section_of(page: str, title: str) -> str:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return text.split(f"{title}\n", 1)[1].split("\n## ", 1)[0]


def test_every_page_is_linked_where_one_looks():
    index = (ROOT / "docs/README.md").read_text(encoding="utf-8")
    assert all(f"]({name})" in index for name in NAMES)
