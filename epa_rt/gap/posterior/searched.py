"""From recordings to all models that are worth their fit; once more where the floors were wrong.

A floor that nothing but the residuals' own high frequencies tells takes part of a gap for noise
where that gap is rough: dry friction, which jumps at every reversal. The most probable set shows
how large the noise is, and weaker effects that it has hidden are looked for.
"""

from collections.abc import Callable, Sequence

import numpy as np

from epa_rt.gap.likelihood.floor import Floor
from epa_rt.gap.likelihood.floor import floors as floors_of
from epa_rt.gap.likelihood.start import RESCALE, Progress, Start, start_of
from epa_rt.gap.posterior.answer import table_for
from epa_rt.gap.posterior.evidence import Numbers
from epa_rt.gap.posterior.search import Table
from epa_rt.gap.posterior.unknown import posterior
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject

ROUNDS = 2  # searches with lower floors at most: each takes as long as the first

FloorsOf = Callable[..., dict[str, Floor]]


def searched(
    subject: Subject,
    recordings: Sequence[Recording],
    aside: Sequence[Recording],
    judge: Subject | None,
    numbers: Numbers,
    without: Sequence[str] = (),
    seed: int = 0,
    floors: FloorsOf = floors_of,
    progress: Progress = lambda stage, share: None,
    stop: Callable[[], bool] | None = None,
) -> tuple[Start, Table]:
    """What the search begins from, and all models that are worth their fit. Raises Stopped.

    ``aside``, ``judge``: as ``table_for`` takes them; ``floors``: as ``start_of``.
    """

    def of(level: FloorsOf, anew: int) -> tuple[Start, Table]:
        def part(stage: str, share: float) -> None:  # half of what is left to go
            progress(stage, 1.0 - 0.5**anew * (1.0 - 0.5 * share))

        start = start_of(subject, recordings, without, seed, level, part, stop)
        return start, table_for(
            start, aside, judge, numbers, lambda stage, share: part(stage, 0.2 + 0.8 * share)
        )

    start, table = of(floors, 0)
    for anew in range(1, ROUNDS + 1):
        best = posterior(table, numbers).models[0][0]
        if not best.effects or not _by_roughness(start):
            break
        lower = _lower(start, floors(subject, recordings, best.values, seed=seed))
        if lower is None:
            break
        start, table = of(lambda *_, at=lower, **__: at, anew)
    return start, table


def _by_roughness(start: Start) -> set[str]:
    """Links whose floor is known from their residuals' high frequencies alone."""
    return {link for link, one in start.problem.floors.items() if one.source == "sensors"}


def _lower(start: Start, anew: dict[str, Floor]) -> dict[str, Floor] | None:
    """The floors with those that have fallen; None where that is worth no other fit."""
    before = start.problem.floors
    fallen = {
        link: anew[link]
        for link in _by_roughness(start)
        if link in anew and 2.0 * np.log(before[link].rms / anew[link].rms) > RESCALE
    }
    return {**before, **fallen} if fallen else None
