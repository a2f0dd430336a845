"""A figure, and how a share and a median of cases become one."""

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

Case = tuple[dict[str, Any], dict[str, Any]]  # the truth as it was sealed, and what was said


class Figure(NamedTuple):
    """``value`` with its count of ``right`` out of ``of`` and Wilson's 95 % interval; None where no
    case is of this kind.
    """

    key: str
    says: str
    bar: str
    value: float | None
    right: int | None
    of: int
    low: float | None = None
    high: float | None = None


def wilson(right: int, of: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson's interval of a share. Source: Wilson 1927."""
    p, centre = right / of, right / of + z * z / (2 * of)
    half = z * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    return max((centre - half) / (1 + z * z / of), 0.0), min(
        (centre + half) / (1 + z * z / of), 1.0
    )


def share(
    key: str, says: str, bar: str, cases: Iterable[Case], count: Callable[[dict, dict], bool]
) -> Figure:
    """The share of cases that ``count`` holds of."""
    outcomes = [count(truth, said) for truth, said in cases]
    if not outcomes:
        return Figure(key, says, bar, None, None, 0)
    hits = sum(outcomes)
    return Figure(
        key, says, bar, hits / len(outcomes), hits, len(outcomes), *wilson(hits, len(outcomes))
    )


def middle(key: str, says: str, bar: str, values: Sequence[float]) -> Figure:
    """The median of values, in their own unit (s, or a share)."""
    return Figure(key, says, bar, statistics.median(values) if values else None, None, len(values))


def pooled(sets: Sequence[Sequence[Figure]]) -> list[Figure]:
    """Every share of the first set over the cases of all of them; medians, and what one of them
    does not count, have none.
    """
    found = []
    for figure in sets[0]:
        same = [
            other
            for figures in sets
            for other in figures
            if other.key == figure.key and (other.right is not None or other.of == 0)
        ]
        right, of = sum(one.right or 0 for one in same), sum(one.of for one in same)
        if len(same) == len(sets) and of:
            found.append(
                figure._replace(
                    value=right / of,
                    right=right,
                    of=of,
                    low=wilson(right, of)[0],
                    high=wilson(right, of)[1],
                )
            )
    return found
