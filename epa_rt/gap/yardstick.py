"""What there is left to explain at all: the generic model's answer by link, at a set of values."""

from collections.abc import Mapping
from dataclasses import dataclass

from epa_rt.gap.generic import GenericFit
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.remainder import generic_of


@dataclass(frozen=True)
class Left:
    """By link: the generic fit. ``amount``: chi-square that could be explained, over all links. ``misfit``: s^2 where that lies."""

    links: Mapping[str, GenericFit]

    @property
    def amount(self) -> float:
        return sum(_explainable(fit) for fit in self.links.values())

    @property
    def misfit(self) -> float:
        total = self.amount
        if total <= 0.0:
            return max((fit.misfit for fit in self.links.values()), default=1.0)
        return sum(_explainable(fit) * fit.misfit for fit in self.links.values()) / total


def _explainable(fit: GenericFit) -> float:
    return fit.samples * max(fit.before - max(fit.after, 1.0), 0.0)


def left_at(problem: Problem, point: Point) -> Left:
    """The generic model fitted to every link's residual at a point."""
    made = problem.each(lambda link: generic_of(problem.subject, problem.prepared, point.values, problem.floors, link), problem.links)
    return Left(dict(zip(problem.links, made, strict=True)))
