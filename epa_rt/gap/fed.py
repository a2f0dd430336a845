"""Which place comes first where several links are off at once and no effect says why.

A link is fed with what others measured. If a link and those that take its output as input are off together, what they share
is that output's measurement (or the block that makes it), not the block where it happens to show most.
"""

from collections.abc import Sequence

from epa_rt.gap.diagnosis import Place

FEEDS = {"gas": ("muscle",), "muscle": ("drive", "load")}   # block to those that are fed with its measured output
WEIGHTY = 0.05   # of the largest significance: less is a trace of something else
SURE = 10.0      # deviations from which a link is off at all


def source_first(places: Sequence[Place]) -> tuple[Place, ...]:
    """Places, most significant first, with the block that feeds the first one ahead of it where that is off as well."""
    found = list(places)
    while found:
        feeding = next((i for i, place in enumerate(found) if i and found[0].block in FEEDS.get(place.block, ())
                        and place.significance > max(SURE, WEIGHTY * found[0].significance)), None)
        if feeding is None:
            break
        found.insert(0, found.pop(feeding))
    return tuple(found)
