"""docs/after-a-trip.md says what to do about every cause of a trip, and docs/queue.md shows the
queue that is there.
"""

import re
import textwrap
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def first_cells(text: str) -> list[str]:
    return re.findall(r"^\| ([^|\n]+?) \|", text, re.M)


def test_every_cause_of_a_trip_is_said_once():
    causes = (DOCS / "states.md").read_text(encoding="utf-8").split("## Causes of a trip")[1]
    causes = first_cells(causes.split("\n## ")[0])[1:]
    page = first_cells((DOCS / "after-a-trip.md").read_text(encoding="utf-8"))
    said = [cause for cell in page if cell != "Cause" for cause in cell.split(", ")]
    assert len(causes) > 20 and sorted(said) == sorted(causes)


def test_the_example_of_a_queue_is_the_rehearsal():
    page = (DOCS / "queue.md").read_text(encoding="utf-8")
    example = textwrap.dedent(page.split("`config/queues/rehearsal.yaml`:\n\n")[1].split("\n\n")[0])
    file = DOCS.parent / "config" / "queues" / "rehearsal.yaml"
    lines = file.read_text(encoding="utf-8").splitlines()
    assert example.splitlines() == [line for line in lines if not line.startswith("#")]
