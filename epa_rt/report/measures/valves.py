"""Counting the switchings of valves."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from epa_rt.config.rig import Muscle
from epa_rt.report.run import Run


@dataclass(frozen=True)
class ValveCount:
    """One valve: openings and closings, by phase (its name in the file; '' outside of phases), and
    during trials.
    """

    muscle: str
    valve: str
    total: int
    by_phase: dict[str, int]
    in_trials: int


def switchings(run: Run, row: str) -> np.ndarray:
    """Samples in which a valve's command differs from the one before."""
    return np.flatnonzero(np.diff(run.signals[row])) + 1


def last_switching(run: Run, muscle: Muscle, end: int) -> int:
    """Sample of the last switching of a muscle's valves before ``end``; 0 where there was none."""
    at = [switchings(run, row) for row in (muscle.inlet, muscle.exhaust)]
    return max((int(found[found < end][-1]) for found in at if (found < end).any()), default=0)


def valve_counts(run: Run) -> list[ValveCount]:
    """Both valves of each muscle."""
    return [
        _count(run, muscle, valve, row)
        for muscle in run.rig.muscles
        for valve, row in (("inlet", muscle.inlet), ("exhaust", muscle.exhaust))
    ]


def _count(run: Run, muscle: Muscle, valve: str, row: str) -> ValveCount:
    at, trials = switchings(run, row), 0
    by_phase: Counter[str] = Counter()
    for span in run.phases:
        inside = int(np.count_nonzero((at >= span.begin) & (at < span.end)))
        by_phase[span.phase.key if span.phase else span.name] += inside
        trials += inside if span.is_trial else 0
    by_phase[""] = len(at) - sum(by_phase.values())
    return ValveCount(
        muscle.name, valve, len(at), {key: n for key, n in by_phase.items() if n}, trials
    )
