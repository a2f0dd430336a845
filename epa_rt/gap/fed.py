"""Which place comes first where several links are off at once and no effect says why.

A link is fed with what others measured. If a link and those that take its output as input are off together, what they share
is that output's measurement (or the block that makes it), not the block where it happens to show most. What is fed can bend what feeds it, though: nominal parameters that both share give way to a
joint's error, and the muscle's link is off as well. So a feeding link must be off by itself, with nominal parameters that need not serve
those it feeds.
"""

from collections.abc import Callable, Sequence

from epa_rt.gap.diagnosis import Place
from epa_rt.gap.lengths import beyond_the_joint
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled
from epa_rt.gap.significance import significance

# Block to those that are fed with its output, and the part of the largest significance from which it comes first; less is a trace of
# something else. A load's link takes no part in its muscle's, and shows a pull far more sharply than a force cell does.
FEEDS = {"gas": {"muscle": 0.05, "load": 0.05}, "muscle": {"drive": 0.05, "load": 0.014}}
SURE = 20.0      # deviations from which a link is off by itself: quiet knees reach 15 where steps are not dithered


def source_first(places: Sequence[Place], by_itself: Callable[[Place], float] = lambda place: place.significance) -> tuple[Place, ...]:
    """Places, most significant first, with the block that feeds the first one ahead of it where that is off as well.

    ``by_itself``: a place's significance where nominal parameters need not serve what it feeds.
    """
    found = list(places)
    while found:
        feeding = next((i for i, place in enumerate(found) if i and found[0].block in FEEDS.get(place.block, {})
                        and place.significance > (least := max(SURE, FEEDS[place.block][found[0].block] * found[0].significance))
                        and by_itself(place) > least), None)
        if feeding is None:
            break
        found.insert(0, found.pop(feeding))
    return tuple(found)


def alone(problem: Problem, place: Place) -> float:
    """Significance of a place with the nominal parameters refitted to all links but those that its block feeds.

    Where a joint's angle makes lengths, what an error of that angle or its lever explains does not count.
    """
    others = problem.only(link for link in problem.links if problem.block_of_link[link] not in FEEDS.get(place.block, {}))
    point = settled(others)
    if getattr(problem.subject, "joint", None):
        return beyond_the_joint(problem.subject, problem.prepared, point.values, problem.floors[place.link], place.link)
    return significance(point.residual[place.link] * problem.scale[place.link]) / problem.floors[place.link].scatter
