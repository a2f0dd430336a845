"""Leave one out: every hidden effect, its family left out of the catalogue, and what is said
instead.
"""

import json
from pathlib import Path

from epa_rt.benchmark.confusion import NOTHING, draw, said_family
from epa_rt.benchmark.figures import SURE, block_said, named
from epa_rt.benchmark.kept import take, telling
from epa_rt.benchmark.score import diagnose_all
from epa_rt.benchmark.seal import NOT_HIDDEN, can_hide, opened


def matrix(cases: Path, sealed: Path, diagnoser: str, jobs: int) -> str:
    """Diagnoses the cases (resumable), draws ``matrix.html`` beside them, and returns a table and a
    closing line.

    ``jobs``: cases at once. Raises SealError where the truth does not fit the logs,
    FileNotFoundError where a case has no answer.
    """
    answers, hides = cases / "answers", can_hide()
    take(answers, cases, diagnoser)
    diagnose_all(
        sorted(path.parent for path in cases.glob("case_*/case.json")),
        answers,
        telling(sealed, cases) if hides else [],
        diagnoser,
        jobs,
    )
    table: dict[str, dict[str, int]] = {}
    lines, refused, wrong = (
        ["| Hidden, left out | Times its limit | Said instead | Block |", "|---|---|---|---|"],
        0,
        0,
    )
    truths = opened(sealed, cases)["cases"]
    for truth in truths:
        said = json.loads((answers / f"{truth['case']}.json").read_text(encoding="utf-8"))
        effect, instead = truth["effects"][0], said_family(said)
        if instead == NOTHING["not_in_catalogue"] and block_said(said) not in effect["blocks"]:
            instead = f"{instead}, but another block"
        row = table.setdefault(effect["name"], {})
        row[instead] = row.get(instead, 0) + 1
        refused += instead == NOTHING["not_in_catalogue"]
        wrong += any(n.get("confidence", 1.0) >= SURE for n in named(said))
        lines.append(
            f"| {effect['name']} ({', '.join(effect['families']) or 'never had'}) |"
            f" {effect['multiple']:.1f} | {instead} | {block_said(said) or '-'} |"
        )
    draw(
        table,
        cases / "matrix.html",
        "Each effect hidden and left out of the catalogue: what is said instead",
        lambda row, cell: cell == NOTHING["not_in_catalogue"],
    )
    if not hides:
        lines.append(NOT_HIDDEN)
    return "\n".join(
        [
            *lines,
            (
                f"{refused} of {len(truths)} said to be not in the catalogue, in the right block;"
                f" {wrong} given a wrong name with confidence"
            ),
        ]
    )
