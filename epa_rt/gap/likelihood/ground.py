"""What free run is heard on: the rig as one block, its noise, and what the plant file makes of the
logs. Made once, however often names are tried on it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from epa_rt.gap.likelihood.alongside import trials
from epa_rt.gap.likelihood.as_one import AsOne, fitted, floor, meters_of, quiet, twins_of
from epa_rt.gap.likelihood.point import Point, linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.promising import SHAPES, most_promising
from epa_rt.gap.likelihood.refit import Fit, refit
from epa_rt.gap.likelihood.role import starts
from epa_rt.gap.likelihood.screen import screen
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Subject

FAMILIES = 3  # that are tried one by one
LIGHTLY, ROUNDS = 10, 3  # families fitted with kept derivatives to choose these, and how often
QUIET = 25.0  # chi-square above noise and steps that rigs without a gap leave at most
OF_BEST = 0.05  # of the gap, by which one that is not told from the best one may be behind
# times what rigs without a gap leave, and part of the gap, above which no law is gone on with
# after these rounds
HOPEFUL, OF_GAP = 10.0, 0.2
# times what rigs without a gap leave, to which one law alone must take the whole plant: a fit that
# cannot come so near is not gone on with
ANYWHERE_NEAR = 4.0


@dataclass(frozen=True)
class Ground:
    """``whole``: commands to readings as one link. ``none``: nominal parameters fitted there, no
    effect on. ``noise``: chi-square that noise and steps alone leave.
    """

    whole: Problem
    none: Point
    noise: float

    @cached_property
    def one_by_one(self) -> list[Point]:
        """Each of the most promising effects fitted alone, one of a family, from the plant file's
        nominal parameters: where a fit without it has gone far to hide it, neither its signature
        nor the way back is to be had from there. Signatures at the plant file's point say little
        where nominal errors are many times the effect; a few rounds with its derivatives say more.
        """
        at = linearised(self.whole, (), {})
        screening = screen(self.whole, at, shapes=SHAPES)
        gap = max(self.none.normal.chi - self.noise, 0.0)
        worth = self.noise + max(
            ANYWHERE_NEAR * QUIET, QUIET + OF_BEST * gap
        )  # so far from the best one it may still be one that is not told from it

        def lightly(name: str) -> Fit:
            return refit(self.whole, at, name, starts(self.whole, screening, name)[0], ROUNDS)

        def alone(fit: Fit) -> Point:
            return fitted(
                self.whole, (fit.effect,), starts(self.whole, screening, fit.effect)[0], worth
            )

        hopeful = self.noise + max(HOPEFUL * QUIET, OF_GAP * gap)
        tried = sorted(
            self.whole.each(lightly, most_promising(self.whole, screening)[:LIGHTLY]),
            key=lambda fit: fit.chi,
        )
        return self.whole.each(alone, [fit for fit in tried[:FAMILIES] if fit.chi < hopeful])


def ground_of(problem: Problem, values: Mapping[str, float]) -> Ground | None:
    """``values``: the nominal parameters' refitted ones. None where the rig has no model of the
    whole that is more than one link, or no log says all that it was told.
    """
    recordings = judged(problem.subject, problem.recordings)
    twins = (
        twins_of(problem.subject, recordings, values)
        if len(problem.links) > 1 and recordings
        else None
    )
    if twins is None:
        return None
    meters = meters_of(recordings, twins)
    whole = problem.on(recordings, AsOne(problem.subject, meters), floor())
    none = fitted(whole, (), values)
    return Ground(whole, none, quiet(none, meters, twins))


def judged(subject: Subject, recordings: Sequence[Recording]) -> Sequence[Recording]:
    """Recordings with those trials alone that the subject fits; where nothing stops the motion all
    but the trials set aside, since valves act before trials. None of which nobody knows what the
    rig was told.
    """
    kept = [one for one in subject.only(recordings) if subject.told(one)]
    if not subject.without_stop:
        return kept
    whole = {r.name: r for r in recordings}
    return [replace(r, spans=_around_those_aside(whole[r.name], r)) for r in kept]


def _around_those_aside(whole: Recording, judged: Recording) -> tuple[Span, ...]:
    """All of a recording but the trials that are not judged."""
    aside = [
        span for span in trials(whole) if not any(span.start == one.start for one in trials(judged))
    ]
    starts, stops = (
        [0, *(span.stop for span in aside)],
        [*(span.start for span in aside), whole.samples],
    )
    return tuple(
        Span(f"part {i}", a, b, True)
        for i, (a, b) in enumerate(zip(starts, stops, strict=True))
        if b > a
    )
