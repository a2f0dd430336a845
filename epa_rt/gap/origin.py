"""Where a gap comes from that no effect explains: every place of the rig is given an error of its own that no law makes, and explains what it can.

A wrong length moves forces and pressures, a wrong reading of the force its own link and whatever is fed with it: an error's own pattern over all links, with the
nominal parameters free, tells places apart that one link's excess cannot. What each explains is judged on trials that its fit has not seen, so that a place with many
shapes is not the better for them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from epa_rt.gap.diagnosis import Origin, Place
from epa_rt.gap.point import linearised
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import refit
from epa_rt.gap.role import gains, z_of_sum
from epa_rt.gap.subject import Values

ROUNDS = 2     # of a refit: errors move residuals in proportion, nominal parameters nearly so
GAIN = 100.0   # chi-square that a place must explain
SHARE = 0.25   # of the excess, and of what nominal parameters are strained by, that it must explain
SURE = 4.0     # deviations from which a link is off
NEAR = 0.5     # of what the first one explains, without which no place comes near
APART = 2.0    # deviations over the blocks by which other blocks' places must be behind


def origins(problem: Problem, values: Values) -> tuple[Origin, ...]:
    """All places, the one that explains most first; none where the subject knows of no places. ``values``: the nominal parameters' refitted ones."""
    doubted = getattr(problem.subject, "doubted", None)
    if doubted is None:
        return ()
    asked = problem.rescaled(dict.fromkeys(problem.links, 1.0)).asking(doubted(problem.prepared))
    point = linearised(asked, (), dict(values))
    fits = asked.each(lambda effect: refit(asked, point, effect.name, dict.fromkeys(effect.knobs, 0.0), ROUNDS), list(asked.effects.values()))
    excess = sum(max(float(r @ r) - len(r), 0.0) for r in point.residual.values()) + float(point.normal.prior @ point.normal.z**2)

    made = sorted(((gains(asked, point, fit), fit) for fit in fits), key=lambda pair: -float(pair[0].sum()))
    return tuple(Origin(fit.effect, asked.effects[fit.effect].block, asked.effects[fit.effect].says, float(np.sum(gain)), float(np.sum(gain)) / max(excess, 1.0), z_of_sum(made[0][0] - gain))
                 for gain, fit in made)


def likely(found: Sequence[Origin]) -> tuple[Origin, ...]:
    """The places that a gap comes from, as far as its links can be told from others'; none where no place explains it."""
    if not found or found[0].gain < GAIN or found[0].explained_share < SHARE:
        return ()
    return tuple(one for one in found if one.behind < APART and one.gain > NEAR * found[0].gain)


def origin_first(places: Sequence[Place], found: Sequence[Origin]) -> tuple[Place, ...]:
    """``places`` with those of the block first that the gap comes from; the order stays where nothing explains the gap.

    Where places of several blocks explain it alike, the one of them that shows most is first. A block none of whose links is off shows in the most significant one.
    """
    blocks = {one.block for one in likely(found)}
    if not blocks or not places:
        return tuple(places)
    block = next((place.block for place in places if place.block in blocks), found[0].block) if len(blocks) > 1 else found[0].block
    own = [place for place in places if place.block == block and place.significance > SURE]
    if not own and places[0].block != block:
        return (replace(places[0], block=block), *places)
    return (*own, *(place for place in places if place not in own))
