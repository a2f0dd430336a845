"""What two diagnosers said of the same sealed cases, side by side."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from epa_rt.benchmark.compare import Scored, compared, reliability, scored
from epa_rt.benchmark.counted import Case
from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.blind.scored import read_scored


def compare(paths: Sequence[Path]) -> str:
    """Tables of scores, of who is ahead, and of how far probabilities hold. Raises VerbError."""
    sets = [read_scored(path, "cases", _cases) for path in paths]
    first, second = (scored(cases) for _, cases in sets)
    if sets[0][0] != sets[1][0] or len(sets[0][1]) != len(sets[1][1]):
        raise VerbError(
            f"{paths[1]}: found another set of cases than in {paths[0]}, expected the same one"
        )
    found = compared(first, second)
    return "\n".join(
        [
            "| | first | second |",
            "|---|---|---|",
            *_rows(first, second),
            "",
            (
                f"More probability for the truth: first in {found.ahead} cases, second in"
                f" {found.behind}, alike in {found.alike}; chance of such a split"
                f" {found.chance:.3f} (sign test)."
            ),
            "",
            *_reliability(("first", first), ("second", second)),
        ]
    )


def _rows(first: Scored, second: Scored) -> list[str]:
    both = (first, second)
    rows = {
        "cases": [f"{len(one.of_truth)}" for one in both],
        "answered right": [f"{one.right}" for one in both],
        "log score": [f"{one.log_score:.3f}" for one in both],
        "Brier score": [f"{one.brier:.3f}" for one in both],
        "calibration error of names": [f"{one.calibration_error:.3f}" for one in both],
    }
    return [f"| {name} | {' | '.join(values)} |" for name, values in rows.items()]


def _reliability(*of: tuple[str, Scored]) -> list[str]:
    lines = [
        "| Diagnoser | Probability said | Names | Mean | Right | 95 % interval |",
        "|---|---|---|---|---|---|",
    ]
    for who, one in of:
        lines += [
            f"| {who} | {row['from']:.1f} to {row['to']:.1f} | {row['names']:.0f} |"
            f" {row['said']:.2f} | {row['right']:.2f} | {row['low']:.2f} to {row['high']:.2f} |"
            for row in reliability(one.names)
        ]
    return lines


def _cases(found: dict[str, Any]) -> list[Case]:
    return [(one["truth"], one["said"]) for one in found["cases"]]
