"""How far the method itself goes astray: twins of the fitted rig, whose values are known, fitted as
the recordings were.
"""

from dataclasses import replace

import numpy as np

from epa_rt.gap.likelihood.point import Point, linearised, solve, z_of
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import moved

TWINS = 5
# with noise in the derivatives: of four fifths of a slope that is noise they go five sixths of the
# way
STEPS = 8
TWIN_SEED = 9001  # twins that made neither a floor nor the yardstick


def astray(problem: Problem, point: Point, seed: int = 0) -> np.ndarray | None:
    """How far a fit of each twin moves every key from the values that made the twin, (TWINS, k) in
    spreads.

    One Gauss-Newton step from those values, with the twin's own derivatives: its noise, steps and
    delays go into them as the recording's do, and what the filters and held samples make of it hits
    all blocks alike. Priors sit at the twin's values. Where the twin is the same motion read again,
    noise of the readings is in the derivatives, which makes a step too short: there are more of
    them. None where the rig has no model of the whole nor can read the same motion again, or where
    a link cannot be judged on its free run.
    """
    found = []
    for i in range(TWINS):
        number = TWIN_SEED + TWINS * seed + i
        runs = [problem.subject.free_run(r, point.values, number) for r in problem.recordings]
        rounds = 1
        if all(run is None for run in runs):
            again = problem.subject.read_again
            runs, rounds = [again(r, point.values, number) for r in problem.recordings], STEPS
        if any(run is None for run in runs):
            return None
        twins = [
            replace(run, name=r.name) for run, r in zip(runs, problem.recordings, strict=True)
        ]  # floors know biases by name
        there = problem.on(twins)
        if (
            there.links != problem.links
            # a twin whose free run is no number is judged nowhere, and nothing would seem to go
            # astray
        ):
            return None
        found.append(_way(there, point, rounds))
    steps = np.array(found)
    return steps if np.isfinite(steps).all() else None


def _way(there: Problem, point: Point, rounds: int) -> np.ndarray:
    """(k,) way to the twin's optimum, in ``rounds`` steps for as long as they help; what could not
    move in the recordings' fit cannot move here.
    """
    way, values, least, before = (
        np.zeros(len(point.normal.z)),
        dict(point.values),
        np.inf,
        np.zeros(len(point.normal.z)),
    )
    for _i in range(rounds):
        at = linearised(there, point.effects, values)
        twin, chi = (
            at.normal,
            sum(float(r @ r) for r in at.residual.values()) + float(at.normal.prior @ way**2),
        )
        if not chi < least:
            return before
        least, before = chi, way
        free = ~(point.normal.frozen | twin.frozen)
        way = way + solve(
            twin.matrix.sum(axis=(0, 1)), twin.vector.sum(axis=(0, 1)), twin.prior, way, free
        )
        if rounds > 1:
            values = moved(there, twin.keys, point.values, way)
            way = z_of(there, twin.keys, values) - z_of(
                there, twin.keys, point.values
            )  # no further than its bounds
    return way
