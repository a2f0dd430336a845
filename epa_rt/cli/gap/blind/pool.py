"""Figures of several sets of cases as one: a set of 120 has 14 to 48 cases to a figure, too few to
hold it against a bar of 99 %.
"""

import json
from collections.abc import Sequence
from pathlib import Path

from epa_rt.benchmark.counted import Figure, pooled
from epa_rt.benchmark.shown import table
from epa_rt.cli.exits import VerbError


def pool(paths: Sequence[Path]) -> str:
    """The table of all counts in what score wrote for each set. Raises VerbError."""
    if len(set(path.resolve() for path in paths)) < len(paths):
        raise VerbError(f"found {', '.join(map(str, paths))}, expected every set once")
    sets, seen = [], {}
    for path in paths:
        found, figures = _scored(path)
        if found is not None and found in seen:
            raise VerbError(
                f"{path}: found the same set as in {seen[found]}, expected every set once"
            )
        seen[found] = path
        sets.append(figures)
    return table(pooled(sets))


def _scored(path: Path) -> tuple[str | None, list[Figure]]:
    """Hash of a set's truth (None where the file does not say it, as before sets were told apart),
    and its figures.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        return found.get("truth_sha256"), [Figure(**one) for one in found["figures"]]
    except OSError as error:
        raise VerbError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise VerbError(
            f"{path}: found no figures in it, expected what epa gap blind score --json wrote"
        ) from None
