"""What is left, in words: which measured states it goes with, and how much a description by data alone explains."""

from epa_rt.gap.diagnosis import Remainder
from epa_rt.gap.report.words import percent


def goes_with(left: Remainder) -> list[tuple[str, float]]:
    """Features and their shares, ranked, of all that states explain where that is more than what lies above the floor.

    The JSON divides the fall of chi-square by its excess over 1, the floor's own. A floor may hold more noise than the logs have, and then states that
    explain everything bring chi-square below 1: shares of 139 %.
    """
    whole = max(1.0, left.explained_share, sum(part for _, part in left.depends_on))
    return [(name, part / whole) for name, part in left.depends_on]


def explained_words(left: Remainder) -> str:
    """Two sentences: how much of what is left states explain, and of what could be explained at first the named effects."""
    found = f"States explain {percent(min(left.explained_share, 1.0))} of what lies above the floor. "
    if left.coverage is None:
        return found
    part = "all" if left.coverage >= 1.0 else percent(left.coverage)
    return f"{found}The named effects explain {part} of what a description by data alone could have explained at first."
