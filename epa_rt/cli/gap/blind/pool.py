"""Figures of several sets of cases as one: a set of 120 has 14 to 48 cases to a figure, too few to
hold it against a bar of 99 %.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from epa_rt.benchmark.counted import Figure, pooled
from epa_rt.benchmark.shown import table
from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.blind.scored import read_scored


def pool(paths: Sequence[Path]) -> str:
    """The table of all counts in what score wrote for each set. Raises VerbError."""
    if len(set(path.resolve() for path in paths)) < len(paths):
        raise VerbError(f"found {', '.join(map(str, paths))}, expected every set once")
    sets, seen = [], {}
    for path in paths:
        found, figures = read_scored(path, "figures", _figures)
        if found is not None and found in seen:
            raise VerbError(
                f"{path}: found the same set as in {seen[found]}, expected every set once"
            )
        seen[found] = path
        sets.append(figures)
    return table(pooled(sets))


def _figures(found: dict[str, Any]) -> list[Figure]:
    return [Figure(**one) for one in found["figures"]]
