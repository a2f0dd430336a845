"""Which place comes first where several links are off at once and no effect says why.

A link is fed with what others measured. If a link and those that take its output as input are off together, what they share
is that output's measurement (or the block that makes it), not the block where it happens to show most.
"""

from collections.abc import Sequence

from epa_rt.gap.diagnosis import Place

# Block to those that are fed with its output, and the part of the largest significance from which it comes first; less is a trace of
# something else. A load's link takes no part in its muscle's, and shows a pull far more sharply than a force cell does.
FEEDS = {"gas": {"muscle": 0.05, "load": 0.05}, "muscle": {"drive": 0.05, "load": 0.01}}
SURE = 10.0      # deviations from which a link is off at all


def source_first(places: Sequence[Place]) -> tuple[Place, ...]:
    """Places, most significant first, with the block that feeds the first one ahead of it where that is off as well."""
    found = list(places)
    while found:
        feeding = next((i for i, place in enumerate(found) if i and found[0].block in FEEDS.get(place.block, {})
                        and place.significance > max(SURE, FEEDS[place.block][found[0].block] * found[0].significance)), None)
        if feeding is None:
            break
        found.insert(0, found.pop(feeding))
    return tuple(found)
