"""What there is left to explain at all: the generic model's answer by link, held against what it
makes of mere noise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from epa_rt.gap.likelihood.generic import GenericFit
from epa_rt.gap.likelihood.point import Point
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.remainder import generic_of

TWIN_SEED = 7001  # a twin that made no floor


@dataclass(frozen=True)
class Left:
    """By link: the generic fit, whose ``after`` is never better than what it reaches on noise
    alone.
    """

    links: Mapping[str, GenericFit]

    def misfit(self, link: str) -> float:
        """s^2 of a link: chi-square per sample that nothing explains, at least 1."""
        return self.links[link].misfit


def left_at(problem: Problem, point: Point, on_noise: Mapping[str, float]) -> Left:
    """The generic model fitted to every link's residual at a point. ``on_noise``: as ``on_noise``
    has it.
    """
    made = problem.each(
        lambda link: generic_of(
            problem.subject,
            problem.prepared,
            point.values,
            problem.floors,
            link,
            designs=problem.designs,
        ),
        problem.links,
    )
    return Left(
        {
            link: replace(fit, after=min(fit.after / on_noise[link], fit.before))
            for link, fit in zip(problem.links, made, strict=True)
        }
    )


def on_noise(problem: Problem, point: Point, seed: int = 0) -> dict[str, float]:
    """Share of chi-square that the generic model leaves of a twin without a gap, by link: below 1
    where the noise itself has a shape. 1 where the rig has no model of the whole.
    """
    subject = problem.subject
    twins = problem.each(
        lambda r: subject.free_run(r, point.values, TWIN_SEED + seed), problem.recordings
    )
    if any(twin is None for twin in twins):
        return dict.fromkeys(problem.links, 1.0)
    prepared = dict(
        zip((r.name for r in problem.recordings), problem.each(subject.prepare, twins), strict=True)
    )
    made = problem.each(
        lambda link: generic_of(subject, prepared, point.values, problem.floors, link),
        problem.links,
    )
    return {
        link: min(fit.after / fit.before, 1.0) if fit.before > 0.0 and fit.samples else 1.0
        for link, fit in zip(problem.links, made, strict=True)
    }
