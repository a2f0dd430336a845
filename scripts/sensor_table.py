"""Prints the table of sensors that lie: fault, rig, moment, found after, by which check, the true
maxima as shares of the limits, the sentence.

python scripts/sensor_table.py               as markdown
python scripts/sensor_table.py --write       into docs/sensors.md, between its marks
python scripts/sensor_table.py --json PATH   and as JSON; --rig NAME and --fault TEXT choose
"""

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from scripts.short_cells import advices, short

PAGE = ROOT / "docs/sensors.md"
BEGIN = "<!-- by scripts/sensor_table.py --write -->"
END = "<!-- end of scripts/sensor_table.py -->"
LATE = 1.1  # times a limit
HEAD = """| Fault | Rig | Moment | Found after | Check | Largest true share | Sentence |
|---|---|---|---|---|---|---|"""


def row_of(facts: dict) -> str:
    """One row of the markdown table."""
    after = facts["found_after_s"]
    return (
        f"| {facts['fault']} | {facts['rig']} | {facts['moment']} |"
        f" {'not found' if after is None else f'{after:.3f} s'} | {facts['check'] or '–'} |"
        f" {facts['worst']} {facts['largest_share']:.2f} |"
        f" {said(facts)} |"
    )


def said(facts: dict) -> str:
    """The trip's sentence without its check, which has a column, and without its advice."""
    return short(facts["sentence"] or facts["outcome"], (f"{facts['check']}: ",))


def of_rig(rig: str, fault: str) -> list[dict]:
    """All faults of one rig."""
    from tests.loop.sensor_scenarios import LIES, facts_of, inputs_of, moment_cycles

    cycles = moment_cycles(inputs_of(rig))
    return [
        facts_of(rig, lie, moment, cycles[moment])
        for lie in LIES
        if rig in lie.rigs and fault in lie.name
        for moment in lie.moments
    ]


def main() -> int:
    from tests.loop.sensor_scenarios import EXPERIMENT

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", type=Path, help="also written there")
    parser.add_argument("--write", action="store_true", help="into docs/sensors.md")
    parser.add_argument("--rig", choices=tuple(EXPERIMENT), help="only this one")
    parser.add_argument("--fault", default="", help="only faults whose name holds this")
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    rigs = (arguments.rig,) if arguments.rig else tuple(EXPERIMENT)
    with ProcessPoolExecutor(arguments.jobs) as pool:
        found = [
            facts
            for rows in pool.map(of_rig, rigs, [arguments.fault] * len(rigs))
            for facts in rows
        ]
    text = table_of(found)
    print(text)
    if arguments.json:
        arguments.json.write_text(json.dumps(found, indent=1), encoding="utf-8")
    if arguments.write:
        write_into_page(text)
    return bool(late(found))


def late(found: list[dict]) -> list[dict]:
    """What went beyond ``LATE`` times a limit, found or not."""
    return [facts for facts in found if facts["largest_share"] > LATE]


def table_of(found: list[dict]) -> str:
    """The markdown table, its sum, and what is not found."""
    missed = [facts for facts in found if facts["outcome"] != "tripped"]
    lines = [HEAD, *(row_of(facts) for facts in found), ""]
    beyond = f"{len(late(found))} beyond {LATE} times a limit"
    lines.append(f"{len(found)} runs, {len(missed)} not found, {beyond}.")
    if missed:
        lines += ["", "Not found, with the largest true share of a limit:", ""]
    lines += [
        f"- {facts['fault']}, {facts['rig']}, {facts['moment']}: {facts['worst']}"
        f" {facts['largest_share']:.2f}"
        for facts in missed
    ]
    lines += ["", "A sentence ends with what to check, which the table leaves out:", ""]
    lines += advices(facts["sentence"] or "" for facts in found)
    return "\n".join(lines)


def write_into_page(text: str) -> None:
    """Puts the table between the page's marks. Raises ValueError where they are missing."""
    page = PAGE.read_text(encoding="utf-8")
    if BEGIN not in page or END not in page:
        raise ValueError(f"found {PAGE} without its marks, expected {BEGIN} and {END}")
    before, after = page.split(BEGIN)[0], page.split(END)[1]
    PAGE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
