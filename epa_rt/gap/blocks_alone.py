"""What counts against names on a rig without a model of the whole: no free run can, so its blocks,
logs that no fit has seen, and its numbers' bounds must.
"""

from dataclasses import replace

from epa_rt.gap.attribution import Attribution
from epa_rt.gap.diagnosis import Named, Shrinkage
from epa_rt.gap.doubts import UNSUPPORTED
from epa_rt.gap.law_ends import stands_at_end
from epa_rt.gap.problem import Problem
from epa_rt.gap.yardstick import Left

HALF = (
    0.5  # share closed of what a name leaves most of on logs set aside, below which it is doubted
)
# chi-square per sample: seven carriages and shafts without a gap left 0.42 to 0.47, a drive late by
# four rows 0.74, a gear that winds up 0.62
FAR_BELOW = 0.5


def nothing_shows(before: Left) -> bool:
    """Whether no link stands above what rigs without a gap leave beside a floor of the sensors
    alone: what a name takes off there is noise of the rig's own (an encoder's, that its controller
    feeds back, looks like a delay).
    """
    return all(fit.before < FAR_BELOW for fit in before.links.values())


def without_names(found: Attribution) -> Attribution:
    """The same with no effect named."""
    selection = replace(
        found.selection, roles=(), final=found.selection.base, refused=found.selection.roles[0]
    )
    return replace(found, selection=selection, after=found.before, sets=(), become=(), off=None)


def at_bounds(problem: Problem, one: Named) -> tuple[str, ...]:
    """Numbers of a name that stand where its law ends, and not because the effect or that part of
    it is absent there: it wanted to go on, as a wrong law does.
    """
    return tuple(
        number.name
        for number in one.parameters
        if stands_at_end(problem, number.name, number.value)
    )


def doubted_by(
    problem: Problem, one: Named, kept: Shrinkage | None
) -> tuple[float, tuple[str, ...]]:
    """What a name's confidence counts, and why. ``kept``: what logs set aside keep most of
    (``held_out.not_closed``).
    """
    words, counts = [], 1.0
    if kept is not None and (kept.closed_share is None or kept.closed_share < HALF):
        what = "makes worse" if kept.after > kept.before else "closes less than half of"
        words.append(
            f"on logs that no fit has seen it {what} {kept.channel} ({kept.before / kept.floor:.1f}"
            f" x its noise floor without it, {kept.after / kept.floor:.1f} x with it)"
        )
        counts *= UNSUPPORTED
    if ends := at_bounds(problem, one):
        words.append(
            f"{', '.join(ends)} stands at the end of what its law is asked for, as of a wrong law"
            " that stands in for another"
        )
        counts *= UNSUPPORTED
    return counts, tuple(
        f"{one.name}: its confidence counts {UNSUPPORTED:g} of itself: {why}." for why in words
    )
