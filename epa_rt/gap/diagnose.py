"""The diagnosis from recordings to answer: what makes the gap, how far it shrinks, and what is said
of it.
"""

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from epa_rt.gap.answer import composed
from epa_rt.gap.aside import unseen
from epa_rt.gap.attribution import Attribution, Progress, attributed
from epa_rt.gap.by_posterior import by_posterior
from epa_rt.gap.diagnosis import Diagnosis, Shrinkage
from epa_rt.gap.floor import floors as floors_of
from epa_rt.gap.own_loop import WITHOUT_LINK, apart, joined
from epa_rt.gap.recording import Recording
from epa_rt.gap.shrink import how_far_of
from epa_rt.gap.subject import Subject


def diagnose(
    subject: Subject,
    recordings: Sequence[Recording],
    holdout: Sequence[Recording] = (),
    without: Iterable[str] = (),
    repeats=None,
    seed: int = 0,
    floors=floors_of,
    how_far: bool = True,
    posterior: bool = False,
    progress: Progress = lambda stage, share: None,
    stop: Callable[[], bool] | None = None,
) -> Diagnosis:
    """Where the gap lies, which effect makes it, how far it shrinks.

    ``holdout``: recordings for the shrinkage; without any, the last trial of every log is set
    aside. ``without``: effects left out of the catalogue. ``repeats``: as ``floor.floors`` takes
    them. ``posterior``: whether the posterior decides, and not the rules. ``progress(stage,
    share)`` is called from this thread. Raises Stopped when ``stop()`` says so, KeyError where a
    recording lacks a column or ``repeats`` name one that is not there.
    """
    begun = time.monotonic()
    given = (recordings, holdout, tuple(without), repeats, seed, floors, how_far)
    inputs = {
        "subject": subject.name,
        "logs": [r.name for r in recordings],
        "holdout": [r.name for r in holdout],
        "without": list(without),
    }
    if posterior:
        answer = by_posterior(subject, *given, progress, stop)
        progress("done", 1.0)
        return replace(answer, seconds=time.monotonic() - begun, inputs=inputs)
    found, answer = _diagnosed(subject, *given, progress, stop)
    rest = apart(subject, found, answer)
    if rest is not None:
        progress("the rest, without the drive's own loop", 0.0)
        unasked = tuple(effect.name for effect in subject.catalogue if effect not in rest.catalogue)
        both = joined(
            answer, _diagnosed(rest, *given, progress, stop)[1], subject.own_loop[0], unasked
        )
        if both is not answer:
            answer, inputs = both, {WITHOUT_LINK: subject.own_loop[0], **inputs}
    progress("done", 1.0)
    return replace(answer, seconds=time.monotonic() - begun, inputs=inputs)


def _diagnosed(
    subject: Subject,
    recordings: Sequence[Recording],
    holdout: Sequence[Recording],
    without: tuple[str, ...],
    repeats,
    seed: int,
    floors,
    how_far: bool,
    progress: Progress,
    stop: Callable[[], bool] | None,
) -> tuple[Attribution, Diagnosis]:
    fitted, _, aside, apart_logs = unseen(subject, recordings, holdout)
    judged = aside or subject
    found = attributed(fitted, recordings, without, repeats, seed, floors, progress, stop)
    progress("how far", 0.8)
    rows: tuple[Shrinkage, ...] = ()
    logs = apart_logs or recordings
    if how_far:
        rows = how_far_of(
            judged,
            logs,
            found.problem,
            found.refitted,
            found.selection.final.values,
            floors,
            seed,
            lambda stage, share: progress(stage, 0.8 + 0.15 * share),
        )
    progress("what is left", 0.95)
    answer = composed(fitted, recordings, found, rows, bool(apart_logs), progress)
    if (
        how_far and found.selection.roles and not answer.effects
    ):  # what was found and not named closes nothing
        base = found.selection.base.values
        answer = replace(
            answer,
            shrinkage=how_far_of(
                judged, logs, found.problem, base, base, floors, seed, lambda stage, share: None
            ),
        )
    return found, answer
