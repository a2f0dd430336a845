"""Answers that the same logs cannot tell apart, refitted so that each one's own plant can be run on a new experiment."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from epa_rt.gap.diagnosis import Diagnosis
from epa_rt.gap.floor import Floor
from epa_rt.gap.floor import floors as floors_of
from epa_rt.gap.plan import Distance, Rival
from epa_rt.gap.problem import Problem
from epa_rt.gap.recording import Recording
from epa_rt.gap.refit import refit, settled
from epa_rt.gap.subject import Subject

MOST_RIVALS = 3
Floors = Callable[[Subject, Sequence[Recording], Mapping[str, float]], Mapping[str, Floor]]


class Answers(NamedTuple):
    """``rivals`` as the plan takes them; ``values``: knob values of each by its names."""

    rivals: tuple[Rival, ...]
    values: Mapping[tuple[str, ...], Mapping[str, float]]


def sets_apart(diagnosis: Diagnosis, subject: Subject, within_family: bool = False) -> tuple[tuple[str, ...], ...]:
    """Sets of effects that explain the same, the diagnosis' own first; those named without rivals stand in all.

    One rival of each family, since laws of one family are one answer; ``within_family``: the laws of the first family
    where no other family competes.
    """
    family = {effect.name: effect.family for effect in subject.catalogue}
    for role, effect in enumerate(diagnosis.effects):
        others = tuple(one.name for i, one in enumerate(diagnosis.effects) if i != role)
        apart = {effect.family: effect.name}
        for name in effect.not_separable_from:
            apart.setdefault(family.get(name, name), name)
        chosen = tuple(apart.values())
        if len(chosen) < 2 and within_family:
            chosen = (effect.name, *effect.not_separable_from)
        if len(chosen) > 1:
            return tuple((*others, name) for name in chosen)[:MOST_RIVALS]
    return ()


def answers(subject: Subject, recordings: Sequence[Recording], diagnosis: Diagnosis, within_family: bool = False,
            floors: Floors = floors_of, progress: Callable[[str, float], None] = lambda stage, share: None) -> Answers:
    """Each set of ``sets_apart`` refitted to the logs."""
    sets = sets_apart(diagnosis, subject, within_family)
    if len(sets) < 2:
        return Answers((), {})
    start = dict(diagnosis.refitted)
    problem = Problem(subject, recordings, floors(subject, recordings, start))
    rivals, values = [], {}
    for k, names in enumerate(sets):
        progress(f"rival {names[-1]}", k / len(sets))
        found = _fitted(problem, names, start)
        rivals.append(Rival(names, subject.patched(found, names)))
        values[names] = found
    return Answers(tuple(rivals), values)


def distance_between(subject: Subject, found: Answers, floors: Floors = floors_of) -> Distance:
    """Chi-square of the second rival over the first on data that the first one's plant made, both refitted to them."""
    def distance(recording: Recording, truth: Rival, other: Rival) -> float:
        problem = Problem(subject, [recording], floors(subject, [recording], found.values[truth.names]))
        best = settled(problem, truth.names, found.values[truth.names], rounds=1).normal.chi
        return max(settled(problem, other.names, found.values[other.names]).normal.chi - best, 0.0)

    return distance


def _fitted(problem: Problem, names: tuple[str, ...], start: Mapping[str, float]) -> dict[str, float]:
    """Effects added one after the other, each from its best start, then all together."""
    point = settled(problem, (), start, rounds=1)
    for i, name in enumerate(names):
        effect = problem.effects[name]
        fits = [refit(problem, point, name, dict(zip(effect.knobs, values, strict=True))) for values in effect.starts]
        point = settled(problem, names[:i + 1], min(fits, key=lambda fit: fit.chi).values, rounds=2)
    return dict(point.values)
