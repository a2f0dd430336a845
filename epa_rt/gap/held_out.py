"""Logs that no fit has seen have the last word: where nothing is named, the refitted plant must serve them too."""

from collections.abc import Sequence

from epa_rt.gap.diagnosis import Shrinkage
from epa_rt.gap.shrink import ALL, OVERALL

CARRIES = 2.0   # times the floor: 60 rigs without a gap, or that these logs could not excite, reached 1.3, with experiments of little motion 1.7


def not_carried_over(rows: Sequence[Shrinkage]) -> Shrinkage | None:
    """The channel, block by block, that the refitted plant misses most on held-out logs; None where it misses none by much."""
    own = [row for row in rows if row.mode == "teacher_forced" and row.baseline == "refitted" and row.log == ALL and row.channel != OVERALL]
    worst = max(own, key=lambda row: row.before / row.floor, default=None)
    return worst if worst is not None and worst.before > CARRIES * worst.floor else None


def said_of_held_out(row: Shrinkage) -> str:
    return f"With the nominal parameters refitted no block of the fitted logs has a gap that could be foreseen, but on the logs set aside {row.channel} is {row.before / row.floor:.1f} x " \
           "its noise floor: what these values hide does not carry over, and no effect of the catalogue explains it."
