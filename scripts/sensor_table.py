"""Prints the table of sensors that lie: fault, rig, moment, found after, by which check, the true
maxima as shares of the limits, the sentence.

python scripts/sensor_table.py               as markdown
python scripts/sensor_table.py --json PATH   and as JSON; --rig NAME and --fault TEXT choose
"""

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

HEAD = """| Fault | Rig | Moment | Found after | Check | Largest true share | Sentence |
|---|---|---|---|---|---|---|"""


def row_of(facts: dict) -> str:
    """One row of the markdown table."""
    after = facts["found_after_s"]
    return (
        f"| {facts['fault']} | {facts['rig']} | {facts['moment']} |"
        f" {'not found' if after is None else f'{after:.3f} s'} | {facts['check'] or '–'} |"
        f" {facts['worst']} {facts['largest_share']:.2f} |"
        f" {facts['sentence'] or facts['outcome']} |"
    )


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
    print(HEAD)
    print("\n".join(row_of(facts) for facts in found))
    late = [facts for facts in found if facts["largest_share"] > 1.1]
    missed = [facts for facts in found if facts["outcome"] != "tripped"]
    print(f"\n{len(found)} runs, {len(missed)} not found, {len(late)} beyond 1.1 times a limit")
    if arguments.json:
        arguments.json.write_text(json.dumps(found, indent=1), encoding="utf-8")
    return bool(missed or late)


if __name__ == "__main__":
    sys.exit(main())
