"""Where a gap comes from that no effect explains: every place of the rig is given an error of its
own that no law makes, and explains what it can.

A wrong length moves forces and pressures, a wrong reading of the force its own link and whatever is
fed with it: an error's own pattern over all links, with the nominal parameters free, tells places
apart that one link's excess cannot. What each explains is judged on trials that its fit has not
seen, so that a place with many shapes is not the better for them.
"""

from collections.abc import Sequence
from dataclasses import replace

from epa_rt.gap.diagnosis import Origin, Place, likely
from epa_rt.gap.likelihood.point import linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import refit
from epa_rt.gap.likelihood.role import gains, z_of_sum
from epa_rt.gap.subject import Values

ROUNDS = 4  # of a refit: errors move residuals in proportion, nominal parameters nearly so
SURE = 4.0  # deviations from which a link is off


def origins(problem: Problem, values: Values) -> tuple[Origin, ...]:
    """All places, the one that explains most first; none where the subject knows of no places.
    ``values``: the nominal parameters' refitted ones.
    """
    doubted = problem.subject.doubted(problem.prepared)
    if doubted is None:
        return ()
    asked = problem.rescaled(dict.fromkeys(problem.links, 1.0)).asking(doubted)
    point = linearised(asked, (), dict(values))
    fits = asked.each(
        lambda effect: refit(
            asked, point, effect.name, dict.fromkeys(effect.knobs, 0.0), ROUNDS, in_proportion=True
        ),
        list(asked.effects.values()),
    )
    excess = sum(max(float(r @ r) - len(r), 0.0) for r in point.residual.values()) + float(
        point.normal.prior @ point.normal.z**2
    )
    made = sorted(
        ((gains(asked, point, fit), asked.effects[fit.effect]) for fit in fits),
        key=lambda pair: -float(pair[0].sum()),
    )
    return tuple(
        Origin(
            place.name,
            place.block,
            place.says,
            total := float(gain.sum()),
            total / max(excess, 1.0),
            z_of_sum(made[0][0] - gain),
        )
        for gain, place in made
    )


def origin_first(places: Sequence[Place], found: Sequence[Origin]) -> tuple[Place, ...]:
    """``places`` with those of the block first that the gap comes from; the order stays where
    nothing explains the gap.

    Where places of several blocks explain it alike, the one of them that shows most is first. A
    block none of whose links is off shows in the most significant one.
    """
    blocks = {one.block for one in likely(found)}
    if not blocks or not places:
        return tuple(places)
    block = (
        next((place.block for place in places if place.block in blocks), found[0].block)
        if len(blocks) > 1
        else found[0].block
    )
    own = [place for place in places if place.block == block and place.significance > SURE]
    if not own and places[0].block != block:
        return (replace(places[0], block=block), *places)
    return (*own, *(place for place in places if place not in own))
