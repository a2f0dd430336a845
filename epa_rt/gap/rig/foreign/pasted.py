"""Trials that were pasted into one file: at the joint between two the part is somewhere else at
once, faster than it moves in any of them. They are as many runs, and are judged as such.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.rig.foreign.subject import ForeignSubject

FEWEST_ROWS = 32  # of a run: a filter and its ends need them


def as_runs(recordings: Sequence[Recording], subject: ForeignSubject) -> tuple[Recording, ...]:
    """Each recording whose trials were pasted as one for each trial; the others as they are."""
    measured = [
        subject.rig.channels[role]
        for _, role in subject.rig.component.links
        if role in subject.rig.channels
    ]
    return tuple(run for one in recordings for run in _runs(one, measured))


def _runs(recording: Recording, measured: Sequence[str]) -> list[Recording]:
    trials = [span for span in recording.spans if span.trial]
    pasted = any(
        _jumps(recording.columns[name], trials) for name in measured if name in recording.columns
    )
    if not pasted or any(span.stop - span.start < FEWEST_ROWS for span in trials):
        return [recording]
    return [_part(recording, span) for span in trials]


def _jumps(values: np.ndarray, trials: Sequence[Span]) -> bool:
    """Whether a channel changes from one trial's last row to the next one's first by more than from
    any row to the next inside of a trial. Trials that rows lie between are no neighbours.
    """
    inside = max(
        (float(np.nanmax(np.abs(np.diff(values[one.start : one.stop])), initial=0.0)))
        for one in trials
    )
    joints = [
        abs(float(values[later.start] - values[earlier.stop - 1]))
        for earlier, later in zip(trials, trials[1:], strict=False)
        if later.start == earlier.stop
    ]
    return any(step > inside for step in joints)


def _part(recording: Recording, span: Span) -> Recording:
    rows = slice(span.start, span.stop)
    return replace(
        recording,
        name=f"{recording.name} {span.name}",
        cycle=recording.cycle[rows],
        columns={name: values[rows] for name, values in recording.columns.items()},
        spans=(Span(span.name, 0, span.stop - span.start, True),),
        t_ns=None if recording.t_ns is None else recording.t_ns[rows],
    )
