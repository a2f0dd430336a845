"""What makes the gap: floors, nominal refit, selection of effects, free run's say, what cannot be
told apart.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from epa_rt.gap.astray import astray
from epa_rt.gap.coverage import above_noise
from epa_rt.gap.floor import floors as floors_of
from epa_rt.gap.ground import Ground, ground_of
from epa_rt.gap.heard import Heard
from epa_rt.gap.in_free_run import heard as heard_in_free_run
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.recording import Recording
from epa_rt.gap.refit import Fit, settled
from epa_rt.gap.role import Role
from epa_rt.gap.select import Selection, rescaled, select
from epa_rt.gap.separate import alike, become_best
from epa_rt.gap.subject import Subject
from epa_rt.gap.there import maybe_none
from epa_rt.gap.there import without as without_effects
from epa_rt.gap.yardstick import Left, left_at, on_noise

Progress = Callable[[str, float], None]


class Start(NamedTuple):
    """What every search begins from: the problem in the scale of what is left without effects, the
    nominal parameters refitted, what is left at any point, and the rig as one block.
    """

    problem: Problem
    base: Point
    left: "LeftOf"
    ground: Ground | None


@dataclass(frozen=True)
class Attribution:
    """What ``attributed`` found, for those who go on with it. ``sets``: by role the fits that
    cannot be told apart, best first. ``become``: by role what has become its best fit in more
    numbers. ``heard``: what free run says, None where the rig has no model of the whole. ``off``:
    how far fits of twins go astray with the named effects (astray.py), None where none is named or
    nothing can be said.
    """

    problem: Problem
    selection: Selection
    before: Left
    after: Left
    sets: tuple[tuple[Fit, ...], ...]
    become: tuple[frozenset[str], ...]
    heard: Heard | None
    off: np.ndarray | None

    @property
    def refitted(self) -> dict[str, float]:
        """Nominal parameters without effects, fitted to whatever those with the named ones are
        fitted to.
        """
        together = self.heard and self.heard.refitted
        return dict(together or self.selection.base.values)


LeftOf = Callable[[Point], Left]


def at_base(
    subject: Subject,
    recordings: Sequence[Recording],
    without: Sequence[str] = (),
    repeats=None,
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
    level = floors(subject, recordings, rough.values, repeats=repeats, seed=seed)
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
    repeats=None,
    seed: int = 0,
    floors=floors_of,
    progress: Progress = lambda stage, share: None,
    stop: Callable[[], bool] | None = None,
) -> Start:
    """What every search begins from. Raises Stopped."""
    problem, base, left = at_base(
        subject, recordings, without, repeats, seed, floors, progress, stop
    )
    progress("free run", 0.12)
    return Start(problem, base, left, ground_of(problem, base.values))


def attributed(
    subject: Subject,
    recordings: Sequence[Recording],
    without: Sequence[str] = (),
    repeats=None,
    seed: int = 0,
    floors=floors_of,
    progress: Progress = lambda stage, share: None,
    stop: Callable[[], bool] | None = None,
) -> Attribution:
    """Floors at the refitted nominal parameters, selection, and what cannot be told apart."""
    scaled, base, left = at_base(
        subject, recordings, without, repeats, seed, floors, progress, stop
    )
    selection = select(
        scaled, base, left, progress=lambda stage, share: progress(stage, 0.15 + 0.5 * share)
    )

    progress("free run", 0.65)
    ground = ground_of(selection.problem, selection.base.values)

    def hear(chosen: Selection) -> tuple[Selection, Heard | None, np.ndarray | None]:
        chosen, said = heard_in_free_run(
            chosen.problem,
            chosen,
            ground,
            progress=lambda stage, share: progress(stage, 0.65 + 0.15 * share),
        )
        return chosen, said, astray(chosen.problem, chosen.final, seed) if chosen.roles else None

    selection, said_there, off = hear(selection)
    if nothing := maybe_none(
        selection.problem, selection, off, _found_there(selection, said_there)
    ):
        selection, said_there, off = hear(without_effects(selection.problem, selection, nothing))
    after = left(selection.final)
    become = tuple(become_best(selection.problem, role) for role in selection.roles)
    stays = above_noise(after, selection.problem.scale)
    tied = said_there.tied if said_there else ()

    def set_of(role: Role, same: frozenset[str]) -> tuple[Fit, ...]:
        found = alike(role, stays, same, tied)
        apart = said_there.apart_from(role.best.effect) if said_there else ()
        return (
            *(fit for fit in found if fit.effect not in apart),
            *(said_there.as_well.get(role.best.effect, ()) if said_there else ()),
        )

    sets = tuple(set_of(role, same) for role, same in zip(selection.roles, become, strict=True))
    return Attribution(
        selection.problem, selection, left(selection.base), after, sets, become, said_there, off
    )


def _found_there(selection: Selection, said: Heard | None) -> frozenset[str]:
    """Named effects that free run vouches for, however wide the blocks' intervals: those that it
    found, and one that explains a large gap by itself.
    """
    if said is None:
        return frozenset()
    return frozenset(
        selection.final.effects
        if said.proves and len(selection.final.effects) == 1
        else said.as_well
    )
