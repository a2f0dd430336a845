"""Answers that the same logs cannot tell apart, refitted so that each one's own plant can be run on
a new experiment.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from epa_rt.gap.diagnosis import Diagnosis
from epa_rt.gap.likelihood.floor import Floor
from epa_rt.gap.likelihood.floor import floors as floors_of
from epa_rt.gap.likelihood.point import z_of
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import refit, settled
from epa_rt.gap.likelihood.screen import starts
from epa_rt.gap.likelihood.waves import look
from epa_rt.gap.next.plan import Distance, Rival
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject

MOST_RIVALS = 3
PROPOSED = "the proposed experiment"
REFIT_ROUNDS = 2
Floors = Callable[[Subject, Sequence[Recording], Mapping[str, float]], Mapping[str, Floor]]


class Answers(NamedTuple):
    """``rivals`` as the plan takes them; ``values``: knob values of each by its names. ``problem``:
    the logs that they were fitted to, None without rivals; ``chi``: chi-square that each leaves of
    them.
    """

    rivals: tuple[Rival, ...]
    values: Mapping[tuple[str, ...], Mapping[str, float]]
    problem: Problem | None = None
    chi: Mapping[tuple[str, ...], float] = {}


def sets_apart(
    diagnosis: Diagnosis, subject: Subject, within_family: bool = False
) -> tuple[tuple[str, ...], ...]:
    """Sets of effects that explain the same, the diagnosis' own first; those named without rivals
    stand in all.

    One rival of each family, since laws of one family are one answer; ``within_family``: the laws
    of the first family where no other family competes. Of a posterior's answer: its sets.
    """
    could = diagnosis.posterior
    if could is not None and could.instead:
        return (tuple(could.names), *could.instead)[:MOST_RIVALS]
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


def answers(
    subject: Subject,
    recordings: Sequence[Recording],
    diagnosis: Diagnosis,
    within_family: bool = False,
    floors: Floors = floors_of,
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> Answers:
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
    return Answers(
        tuple(rivals),
        values,
        problem,
        {names: _chi(problem, found) for names, found in values.items()},
    )


def distance_between(subject: Subject, found: Answers) -> Distance:
    """Chi-square by which the second rival falls further behind the first by data that the first
    one's plant made, both refitted to these and the logs.

    Both at once, because what the logs say of the nominal parameters holds: alone, a single
    experiment lets them hide nearly everything. With the floors of the logs, since the new data
    come from the same sensors.
    """
    logs = found.problem
    kept: list[tuple[Recording, Problem, float]] = []

    def beside(recording: Recording, truth: Rival) -> tuple[Problem, float]:
        """The logs and the new data, and what the first rival leaves of both: fitted to them like
        any other. Data that its own plant made show what the method leaves of them, which any fit
        takes: held to its numbers the truth was worse off than all others, and every experiment at
        a distance of 0.
        """
        if not kept or kept[0][0] is not recording:
            new = replace(recording, name=PROPOSED)
            problem = Problem(
                subject,
                [*logs.recordings, new],
                logs.floors,
                prepared={**logs.prepared, PROPOSED: subject.prepare(new)},
            )
            kept[:] = [
                (
                    recording,
                    problem,
                    settled(
                        problem, truth.names, found.values[truth.names], rounds=REFIT_ROUNDS
                    ).normal.chi,
                )
            ]
        return kept[0][1:]

    def distance(recording: Recording, truth: Rival, other: Rival) -> float:
        problem, least = beside(recording, truth)
        end = settled(
            problem, other.names, found.values[other.names], rounds=REFIT_ROUNDS
        ).normal.chi
        return max(end - least - (found.chi[other.names] - found.chi[truth.names]), 0.0)

    return distance


def _chi(problem: Problem, values: Mapping[str, float]) -> float:
    """Chi-square at these values, with what the nominal parameters pay; as a Point has it."""
    residuals = problem.each(lambda link: problem.residual(values, link), problem.links)
    return sum(float(r @ r) for r in residuals) + float(
        np.sum(z_of(problem, problem.nominal, values) ** 2)
    )


def _fitted(
    problem: Problem, names: tuple[str, ...], start: Mapping[str, float]
) -> dict[str, float]:
    """Effects added one after the other, each from its best start, then all together."""
    point = settled(problem, (), start, rounds=1)
    for i, name in enumerate(names):
        look(problem, point, (name,))
        fits = [refit(problem, point, name, start) for start in starts(problem, name)]
        point = settled(
            problem, names[: i + 1], min(fits, key=lambda fit: fit.chi).values, rounds=2
        )
    return dict(point.values)
