"""The same cases by what libraries offer: each rival scored as the diagnosis is, side by side with
it.
"""

import json
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from epa_rt.cli.exits import FAILED, VerbError

RIVALS = {
    "cma_es": "cma",
    "least_squares": None,
    "sparse": "pysindy",
    "rmse": None,
}  # to the library that the package does not bring
SHOWN = ("first", "pair", "none", "withheld", "wrong_sure", "block", "seconds")


def check_libraries(names: Sequence[str]) -> None:
    """Raises VerbError where a library is missing: a rival that cannot run is no rival that is
    wrong everywhere.
    """
    missing = sorted(
        {
            library
            for name in names
            if (library := RIVALS[name]) is not None and find_spec(library) is None
        }
    )
    if missing:
        raise VerbError(
            f"found no {' and no '.join(missing)}, expected the libraries of the rivals (README:"
            " pip install ... -e '.[rivals]'), or --only with rivals that need none"
            f" ({', '.join(name for name, library in RIVALS.items() if library is None)})"
        )


def beside_libraries(
    cases: Path,
    sealed: Path,
    out: Path,
    names: Sequence[str],
    jobs: int,
    first: int | None,
    beside: Path | None,
) -> str:
    """The table of all rivals. ``beside``: what score wrote for the same cases, a row of its own.
    Writes each rival's figures beside ``out``, and the rows there.

    Raises VerbError where a rival ended in an error everywhere.
    """
    from epa_rt.benchmark.figures import figures
    from epa_rt.benchmark.score import score
    from epa_rt.benchmark.seal import NOT_HIDDEN

    scored, rows, asked, hides = (
        _scored(beside, cases) if beside is not None else [],
        [],
        set(),
        True,
    )
    for name in names:
        own = out.with_name(f"{out.stem}_{name}.json")
        score(
            cases,
            sealed,
            own,
            own.with_suffix(".html"),
            f"epa_rt.benchmark.rivals:{name}",
            jobs,
            first=first,
            beside=beside,
        )
        kept = json.loads(own.read_text(encoding="utf-8"))
        _check_ran(name, own, kept["cases"])
        hides = hides and kept["hidden_from_the_diagnosis"]
        asked = {case["truth"]["case"] for case in kept["cases"]}
        rows.append({"rival": name, **{f["key"]: f["value"] for f in kept["figures"]}})
    best = max((row["first"] for row in rows if row["first"] is not None), default=None)
    if beside is not None:
        ours = [(c["truth"], c["said"]) for c in scored if c["truth"]["case"] in asked]
        rows.insert(0, {"rival": "epa gap diagnose", **{f.key: f.value for f in figures(ours)}})
    out.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    lines = [
        "| Rival | " + " | ".join(SHOWN) + " |",
        "|---" * (len(SHOWN) + 1) + "|",
        *map(_line, rows),
    ]
    if beside is not None and best is not None and rows[0]["first"] is not None:
        lines.append(
            f"ahead of the best rival in naming the effect by {100 * (rows[0]['first'] - best):.0f}"
            " points"
        )
    if not hides:
        lines.append(NOT_HIDDEN)
    return "\n".join(lines)


def _scored(path: Path, cases: Path) -> list[dict]:
    """Cases of the JSON that score wrote for this very set. Raises VerbError."""
    from epa_rt.benchmark.kept import hash_of

    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        of, scored = found.get("truth_sha256"), found["cases"]
    except OSError as error:
        raise VerbError(
            f"{path}: cannot be read ({error.strerror}), expected the JSON of epa gap blind score"
            " (--beside)"
        ) from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise VerbError(
            f"{path}: found no cases in it, expected the JSON of epa gap blind score (--beside)"
        ) from None
    if of != hash_of(cases):
        raise VerbError(
            f"{path}: found {f'the set {of[:16]}' if of else 'no truth_sha256'}, expected what"
            f" score wrote for {cases}, {hash_of(cases)[:16]} (--beside)"
        )
    return scored


def _check_ran(name: str, own: Path, cases: Sequence[dict]) -> None:
    errors = [case["said"]["error"] for case in cases if "error" in case["said"]]
    if cases and len(errors) == len(cases):
        raise VerbError(
            f"{own}: {name} ended in an error in all {len(cases)} cases ({errors[0]}), expected"
            " answers",
            FAILED,
        )


def _line(row: dict) -> str:
    said = (
        (
            "-"
            if row.get(k) is None
            else f"{row[k]:.1f} s"
            if k == "seconds"
            else f"{100 * row[k]:.0f} %"
        )
        for k in SHOWN
    )
    return "| " + " | ".join([row["rival"], *said]) + " |"
