"""What every search begins from: floors, nominal parameters refitted, the rig as one block."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from epa_rt.gap.likelihood.floor import floors as floors_of
from epa_rt.gap.likelihood.ground import Ground, ground_of
from epa_rt.gap.likelihood.point import Point
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.likelihood.yardstick import Left, left_at, on_noise
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject

Progress = Callable[[str, float], None]
RESCALE = 0.2  # change of log s^2 that is worth settling again


class Start(NamedTuple):
    """What every search begins from: the problem in the scale of what is left without effects, the
    nominal parameters refitted, what is left at any point, and the rig as one block.
    """

    problem: Problem
    base: Point
    left: "LeftOf"
    ground: Ground | None


LeftOf = Callable[[Point], Left]


def at_base(
    subject: Subject,
    recordings: Sequence[Recording],
    without: Sequence[str] = (),
    seed: int = 0,
    floors=floors_of,
    progress: Progress = lambda stage, share: None,
    stop: Callable[[], bool] | None = None,
) -> tuple[Problem, Point, LeftOf]:
    """The problem with its floors, the point at which the nominal parameters are refitted and no
    effect is on, and what is left at any point.

    A first, rough refit takes the floors of the first log alone: what it finds only says at which
    values the floors of all logs are made. Links that even a data-driven model leaves much of count
    for less, or the nominal parameters would go astray for one link's gap and make others.
    """
    progress("floors", 0.0)
    first = Problem(
        subject,
        recordings,
        floors(subject, recordings[:1], {}, seed=seed),
        without=without,
        stop=stop,
    )
    rough = settled(first, rounds=2)
    level = floors(subject, recordings, rough.values, seed=seed)
    problem = Problem(
        subject, recordings, level, without=without, prepared=first.prepared, stop=stop
    )
    progress("nominal parameters", 0.1)
    base = settled(problem, values=rough.values)
    noise = on_noise(problem, base, seed)
    lefts: dict[int, Left] = {}
    kept: list[Point] = []  # so that an id stays a point's own

    def left(point: Point) -> Left:
        if id(point) not in lefts:
            kept.append(point)
            lefts[id(point)] = left_at(problem, point, noise)
        return lefts[id(point)]

    return *rescaled(problem, base, left(base)), left


def start_of(
    subject: Subject,
    recordings: Sequence[Recording],
    without: Sequence[str] = (),
    seed: int = 0,
    floors=floors_of,
    progress: Progress = lambda stage, share: None,
    stop: Callable[[], bool] | None = None,
) -> Start:
    """What every search begins from. Raises Stopped."""
    problem, base, left = at_base(subject, recordings, without, seed, floors, progress, stop)
    progress("free run", 0.12)
    return Start(problem, base, left, ground_of(problem, base.values))


def rescaled(problem: Problem, point: Point, left: Left) -> tuple[Problem, Point]:
    """Links whose s^2 has fallen count for more; the point is settled again where that changed
    anything.
    """
    before = {link: scale**2 for link, scale in problem.scale.items()}
    after = {
        link: min(before[link], left.misfit(link)) if point.effects else left.misfit(link)
        for link in problem.links
    }
    if all(abs(np.log(after[link] / before[link])) < RESCALE for link in problem.links):
        return problem, point
    problem = problem.rescaled(after)
    return problem, settled(problem, point.effects, point.values, rounds=2)
