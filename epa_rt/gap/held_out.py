"""Logs that no fit has seen have the last word: the refitted plant, or the named effects, must
serve them too.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from epa_rt.gap.diagnosis import Number, Shrinkage
from epa_rt.gap.shrink import ALL, OVERALL, label
from epa_rt.gap.subject import Link
from epa_rt.gap.wording import NONE_EXPLAINS, went_to
from epa_rt.gap.yardstick import Left

# times the floor: 60 rigs without a gap, or that these logs could not excite, reached 1.3, with
# experiments of little motion 1.7
CARRIES = 2.0

# share closed of a channel on held-out logs from which named effects have explained it: what is
# left is less than half of what was there
CLOSES = 0.8


def not_carried_over(
    rows: Sequence[Shrinkage], fitted: Mapping[str, float] = MappingProxyType({})
) -> Shrinkage | None:
    """The channel, block by block, that the refitted plant misses most on held-out logs; None where
    it misses none by much.

    ``fitted``: as ``times_floor`` has it; noise that no floor knows is in the logs that it was
    fitted to as well.
    """

    def times(row: Shrinkage) -> float:
        return row.before / row.floor / max(fitted.get(row.channel, 1.0), 1.0)

    worst = max(_block_by_block(rows), key=times, default=None)
    return worst if worst is not None and times(worst) > CARRIES else None


def times_floor(links: Sequence[Link], left: Left) -> dict[str, float]:
    """Channel, as the rows name it, to what the refitted nominal parameters leave of it in the
    fitted logs, in multiples of the floor.
    """
    return {
        label(links, link): float(np.sqrt(left.links[link.name].before))
        for link in links
        if link.name in left.links
    }


def not_closed(rows: Sequence[Shrinkage]) -> Shrinkage | None:
    """The channel, block by block, in which held-out logs keep most although effects are named;
    None where these close CLOSES of it or leave little.
    """
    kept = [
        row
        for row in _block_by_block(rows)
        if row.after > CARRIES * row.floor
        and (row.closed_share is None or row.closed_share < CLOSES)
    ]
    return max(kept, key=lambda row: row.after / row.floor, default=None)


def _block_by_block(rows: Sequence[Shrinkage]) -> list[Shrinkage]:
    return [
        row
        for row in rows
        if row.mode == "teacher_forced"
        and row.baseline == "refitted"
        and row.log == ALL
        and row.channel != OVERALL
    ]


def said_of_held_out(row: Shrinkage, went: Sequence[Number] = ()) -> str:
    """The sentences on what ``not_carried_over`` found; ``before`` and ``floor`` in the channel's
    unit. ``went``: the nominal parameters that were refitted furthest from the plant file.
    """
    values = " and ".join(went_to(one) for one in went)
    return (
        "With the nominal parameters refitted, what is left in the fitted logs is little from one"
        " sample to the next, or nothing that was measured foresees it; but on the logs set aside"
        f" {row.channel} is {row.before / row.floor:.1f} x its noise floor: what the refitted"
        f" values hide does not carry over, and {NONE_EXPLAINS}."
        + (f" Furthest from the plant file went {values}." if values else "")
    )


def said_of_not_closed(row: Shrinkage) -> str:
    """The sentence on what ``not_closed`` found; ``before``, ``after`` and ``floor`` in the
    channel's unit.
    """
    before, after = row.before / row.floor, row.after / row.floor
    if after > before:
        return (
            f"On the logs set aside it makes {row.channel} worse, {after:.1f} x its noise floor"
            f" where it was {before:.1f} x: something else is missing."
        )
    return (
        f"On the logs set aside {row.channel} keeps {after:.1f} x its noise floor of {before:.1f}"
        " x: something else is missing there."
    )


def said_of_unforeseen(channel: str, times: float) -> str:
    """The sentence on a channel that is so many ``times`` its floor and that no measured state
    foresees.
    """
    return (
        f"{channel} is {times:.1f} x its noise floor with the nominal parameters refitted, and"
        " nothing that was measured foresees it: a disturbance from outside, a law that hangs on"
        f" what was not measured, or noise that the floor does not know; {NONE_EXPLAINS}."
    )
