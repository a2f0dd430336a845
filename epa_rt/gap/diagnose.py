"""The diagnosis from recordings to answer: floors, nominal refit, selection of effects, what cannot be told apart, verdict."""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from epa_rt.gap.aside import split
from epa_rt.gap.astray import astray
from epa_rt.gap.diagnosis import Diagnosis, FreeRun, Named, Number, Shrinkage
from epa_rt.gap.fed import alone, source_first
from epa_rt.gap.floor import floors as floors_of
from epa_rt.gap.held_out import not_carried_over, said_of_held_out
from epa_rt.gap.in_free_run import Heard
from epa_rt.gap.in_free_run import heard as heard_in_free_run
from epa_rt.gap.lengths import length_first
from epa_rt.gap.localise import localise
from epa_rt.gap.plausible import absorbed, beyond_belief, strained
from epa_rt.gap.point import Normal, Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.recording import Recording
from epa_rt.gap.refit import Fit, settled
from epa_rt.gap.remainder import remainders
from epa_rt.gap.select import Selection, rescaled, select
from epa_rt.gap.separate import alike, become_best, intervals, shares
from epa_rt.gap.shrink import shrinkage
from epa_rt.gap.subject import Subject
from epa_rt.gap.verdict import BARS, above_noise, coverage, decided, gaps, informed, said, trust, untested
from epa_rt.gap.whose import spoken, who_has
from epa_rt.gap.yardstick import Left, left_at, on_noise

MOVED = 3.0   # spreads beyond which a nominal parameter is reported
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Attribution:
    """What ``attributed`` found, for those who go on with it. ``sets``: by role the fits that cannot be told apart, best first.
    ``become``: by role what has become its best fit in more numbers. ``heard``: what free run says, None where the rig has no model of the whole."""

    problem: Problem
    selection: Selection
    before: Left
    after: Left
    sets: tuple[tuple[Fit, ...], ...]
    become: tuple[frozenset[str], ...]
    heard: Heard | None


def diagnose(subject: Subject, recordings: Sequence[Recording], holdout: Sequence[Recording] = (), without: Iterable[str] = (),
             repeats=None, seed: int = 0, floors=floors_of, how_far: bool = True, progress: Progress = lambda stage, share: None,
             stop: Callable[[], bool] | None = None) -> Diagnosis:
    """Where the gap lies, which effect makes it, how far it shrinks.

    ``holdout``: recordings for the shrinkage; without any, the last trial of every log is set aside. ``without``: effects
    left out of the catalogue. ``repeats``: as ``floor.floors`` takes them. ``progress(stage, share)`` is called from this
    thread. Raises Stopped when ``stop()`` says so.
    """
    begun = time.monotonic()
    halves = None if holdout else split(subject, recordings)
    fitted, judged = halves or (subject, subject)
    found = attributed(fitted, recordings, tuple(without), repeats, seed, floors, progress, stop)
    progress("how far", 0.8)
    rows: tuple[Shrinkage, ...] = ()
    if how_far:
        logs = holdout or (judged.only(recordings) if halves else recordings)
        rows = _how_far(judged, logs, found, floors, seed, lambda stage, share: progress(stage, 0.8 + 0.15 * share))
    progress("what is left", 0.95)
    answer = composed(fitted, recordings, found, rows, seed)
    progress("done", 1.0)
    inputs = {"subject": subject.name, "logs": [r.name for r in recordings], "holdout": [r.name for r in holdout], "without": list(without)}
    return replace(answer, seconds=time.monotonic() - begun, inputs=inputs)


def attributed(subject: Subject, recordings: Sequence[Recording], without: Sequence[str] = (), repeats=None, seed: int = 0, floors=floors_of,
               progress: Progress = lambda stage, share: None, stop: Callable[[], bool] | None = None) -> Attribution:
    """Floors at the refitted nominal parameters, selection, and what cannot be told apart.

    A first, rough refit of the nominal parameters takes the floors of the first log alone: what it finds only says at
    which values the floors of all logs are made.
    """
    progress("floors", 0.0)
    first = Problem(subject, recordings, floors(subject, recordings[:1], {}, seed=seed), without=without, stop=stop)
    rough = settled(first, rounds=2)
    level = floors(subject, recordings, rough.values, repeats=repeats, seed=seed)
    problem = Problem(subject, recordings, level, without=without, prepared=first.prepared, stop=stop)
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

    scaled, base = rescaled(problem, base, left(base))
    selection = select(scaled, base, left, progress=lambda stage, share: progress(stage, 0.15 + 0.5 * share))
    selection, said_there = heard_in_free_run(selection.problem, selection, progress=lambda stage, share: progress(stage, 0.65 + 0.15 * share))
    after = left(selection.final)
    become = tuple(become_best(selection.problem, role) for role in selection.roles)
    stays = above_noise(after, selection.problem.scale)
    apart = said_there.apart if said_there else frozenset()
    sets = tuple((*(fit for fit in alike(role, stays, same) if fit.effect not in apart), *(said_there.as_well.get(role.best.effect, ()) if said_there else ()))
                 for role, same in zip(selection.roles, become, strict=True))
    return Attribution(selection.problem, selection, left(selection.base), after, sets, become, said_there)


def composed(subject: Subject, recordings: Sequence[Recording], found: Attribution, rows: Sequence[Shrinkage] = (), seed: int = 0) -> Diagnosis:
    """The answer in the words of ``diagnosis.py``."""
    problem, selection = found.problem, found.selection
    covered = coverage(found.before, found.after)
    whole, counted = (found.heard.part, found.heard.counted) if found.heard else (None, None)
    trusted = trust(found.before, found.after, whole)
    named = tuple(_named(found, k, trusted) for k in range(len(selection.roles)))
    screening = selection.roles[0].screening if selection.roles else selection.refused.screening if selection.refused else None
    silent = untested(screening.typical() if screening else {}, tuple(problem.effects))
    judged = informed({link: [e.name for e in problem.effects.values() if link in problem.touched(e.knobs)] for link in problem.links}, silent)
    where = tuple(link for link in gaps(found.before, found.after) if link in judged)
    odd = _odd(found)
    rivals = [[n for n in one.not_separable_from if problem.effects[n].family != one.family] for one in named]
    verdict = decided(bool(where), [one.name for one in named], covered, any(rivals), len(silent) / max(len(problem.effects), 1), bool(odd), counted)
    says = said(verdict, [spoken(one) for one in named], rivals, where, covered.part, len(silent), len(problem.effects), odd, counted)
    nearest = tuple(one.name for one in named)
    if verdict in ("not_in_catalogue", "no_gap"):
        named = ()
    apart = not_carried_over(rows) if verdict == "no_gap" else None
    if apart is not None:
        verdict, says = "not_in_catalogue", said_of_held_out(apart)
    seen_at = {key: value for key, value in selection.base.values.items() if where or key not in odd}
    values = selection.final.values if named else selection.base.values
    normal = (selection.final if named else selection.base).normal
    off = astray(problem, selection.final, seed) if named else None
    named = tuple(replace(one, parameters=_numbers(problem, selection.final, one.name, off)) for one in named)
    places = localise(subject, problem.prepared, seen_at, problem.floors)
    if not named:
        places = source_first(places, lambda place: alone(problem, place))
        places = length_first(subject, problem.prepared, seen_at, problem.floors, places) if where else places
    return Diagnosis(
        verdict=verdict, says=says, found_first=tuple(f"{r.name}: {what}" for r in recordings for what in r.found),
        location=places, effects=named,
        free_run=found.heard and FreeRun(found.heard.gap, found.heard.left, whole, nearest, tuple(sorted(found.heard.apart))),
        nominal_moved=_moved(problem, normal, off), not_tested=silent, shrinkage=tuple(rows), refitted=dict(selection.base.values), fitted=dict(values),
        remainder=remainders(subject, problem.prepared, selection.base.values, values, problem.floors, problem.designs))


def _odd(found: Attribution) -> tuple[str, ...]:
    """Nominal parameters beyond belief: where effects are named those that hide more than the effects explain, or that are further off together
    than plant files are.

    A wrong law drives them there to make up for what it lacks; with the right one they come back.
    """
    roles = found.selection.roles
    if not roles:
        return beyond_belief(found.selection.base.normal)
    normal = found.selection.final.normal
    odd = beyond_belief(normal, BARS.belief_named)
    if absorbed(normal, odd) > sum(float(role.gains[0].sum()) for role in roles):
        return odd
    return strained(found.selection.base.normal, normal)


def _named(found: Attribution, k: int, trusted: float) -> Named:
    """With the intervals of the blocks' scatter alone."""
    problem, final, role = found.problem, found.selection.final, found.selection.roles[k]
    effect = problem.effects[role.best.effect]
    numbers = _numbers(problem, final, effect.name, None)
    return Named(effect.name, effect.family, effect.block, numbers, trusted * shares(problem, role, found.become[k])[effect.name], float(role.gains[0].sum()),
                 tuple(fit.effect for fit in found.sets[k] if fit.effect != effect.name), who_has(problem, effect.name, numbers))


def _numbers(problem: Problem, point: Point, effect: str, off: np.ndarray | None) -> tuple[Number, ...]:
    knobs = problem.effects[effect].knobs
    width = intervals(point.normal, knobs, off)
    return tuple(_number(problem, key, point.values.get(key, problem.knobs[key].value), width[key]) for key in knobs)


def _number(problem: Problem, key: str, value: float, width: float) -> Number:
    """``width``: half of the interval, in spreads."""
    knob, by = problem.knobs[key], width * problem.spread(key)
    return Number(key, value, knob.unit, max(value - by, knob.low), min(value + by, knob.high), knob.value)


def _moved(problem: Problem, normal: Normal, off: np.ndarray | None) -> tuple[Number, ...]:
    """Nominal parameters that went further from the plant file than anybody believed they could."""
    width = intervals(normal, problem.nominal, off)
    return tuple(_number(problem, key, problem.knobs[key].value + z * problem.spread(key), width[key])
                 for key, z in zip(normal.keys, normal.z, strict=True) if problem.knobs[key].effect is None and abs(z) > MOVED)


def _how_far(subject: Subject, recordings: Sequence[Recording], found: Attribution, floors, seed: int, progress: Progress) -> tuple[Shrinkage, ...]:
    before, after = found.selection.base.values, found.selection.final.values
    names = {r.name for r in found.problem.recordings}
    level = found.problem.floors
    if not all(r.name in names for r in recordings):
        level = floors(subject, recordings, before, repeats=None, seed=seed)
    return shrinkage(subject, recordings, before, after, level, progress=progress)
