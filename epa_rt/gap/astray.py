"""How far the method itself goes astray: twins of the fitted rig, whose values are known, fitted as the recordings were."""

from dataclasses import replace

import numpy as np

from epa_rt.gap.point import Normal, Point, linearised, solve
from epa_rt.gap.problem import Problem

TWINS = 5
TWIN_SEED = 9001   # twins that made neither a floor nor the yardstick


def astray(problem: Problem, point: Point, seed: int = 0) -> np.ndarray | None:
    """How far a fit of each twin moves every key from the values that made the twin, (TWINS, k) in spreads.

    One Gauss-Newton step from those values, with the twin's own derivatives: its noise, steps and delays go into them as the recording's
    do, and what the filters and held samples make of it hits all blocks alike. Priors sit at the twin's values. None where the rig has no
    model of the whole, or where a link cannot be judged on its free run.
    """
    found = []
    for i in range(TWINS):
        runs = [problem.subject.free_run(r, point.values, TWIN_SEED + TWINS * seed + i) for r in problem.recordings]
        if any(run is None for run in runs):
            return None
        twins = [replace(run, name=r.name) for run, r in zip(runs, problem.recordings, strict=True)]   # floors know biases by name
        there = problem.on(twins)
        if there.links != problem.links:   # a twin whose free run is no number is judged nowhere, and nothing would seem to go astray
            return None
        found.append(_step(point.normal, linearised(there, point.effects, point.values).normal))
    steps = np.array(found)
    return steps if np.isfinite(steps).all() else None


def _step(own: Normal, twin: Normal) -> np.ndarray:
    """(k,) step to the twin's optimum; what could not move in the recordings' fit cannot move here."""
    free = ~(own.frozen | twin.frozen)
    return solve(twin.matrix.sum(axis=(0, 1)), twin.vector.sum(axis=(0, 1)), twin.prior, np.zeros(len(twin.z)), free)
