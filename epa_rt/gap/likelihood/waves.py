"""Periods over an angle that nobody knows beforehand: how many to a turn the blocks' residuals show
best.

Friction that swings over a gear's turn, cogging, ripple: a fit finds strength and phase of a wave
from anywhere, its number of periods only from close by. Two signatures a quarter of a period apart
span every phase, so that a number of periods costs two evaluations. All are held against the
recording in which the angle goes furthest, the best few against all. Numbers outside of a knob's
bounds are not tried.
"""

from collections.abc import Collection

import numpy as np

from epa_rt.gap.likelihood.point import Point, linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.screen import difference, projected
from epa_rt.models.effect import Effect

QUARTERS = (0.0, 0.5 * np.pi)
APART_RAD = 1.5  # of phase at the far end of the range by which neighbours in the grid differ
FINEST = 0.01  # periods to a turn between neighbours at least: a grid of a hundred
# periods to a turn up to which any number is tried, and up to which whole ones are: poles and slots
# come in whole numbers (14 poles and 12 slots cog 84 times, 20 and 18 180 times)
SLOW, FAST = 1.2, 200
BEST = 5  # numbers of periods that are held against all recordings


def look(problem: Problem, point: Point, effects: Collection[str] | None = None) -> None:
    """Renews the problem's starts of waves: of every such effect that is not on (or of these
    ``effects`` alone) the number of periods that would take most off the residual at ``point``.
    """
    names = [
        name
        for name, effect in problem.effects.items()
        if effect.swings_over and name not in point.effects and (effects is None or name in effects)
    ]
    for name, start in zip(
        names,
        problem.each(lambda name: _best(problem, point, problem.effects[name]), names),
        strict=True,
    ):
        problem.waves[name] = (start,) if start else ()


def grid(range_rad: float) -> np.ndarray:
    """(n,) periods to a turn worth trying where the angle covers a range: from half a period over
    all of it, as close together as it tells them apart.
    """
    if not range_rad > 0.0:
        return np.zeros(0)
    least = np.pi / range_rad
    slow, fast = (
        np.arange(least, SLOW, max(APART_RAD / range_rad, FINEST)),
        np.arange(np.ceil(SLOW), FAST + 1.0),
    )
    return np.concatenate([slow, fast[fast >= least]])


def _best(problem: Problem, point: Point, effect: Effect) -> dict[str, float] | None:
    """The start whose number of periods takes most off the residual, with the strength and phase
    that do; None where none does.
    """
    strength, periods, phase, *_ = effect.knobs
    typical = dict(zip(effect.knobs, effect.starts[0], strict=True))
    knob, bounds = problem.knobs[strength], problem.knobs[periods]
    at, range_rad = _furthest(problem, effect)
    tried = [float(n) for n in grid(range_rad) if bounds.low <= n <= bounds.high]

    def gained(held: Problem, here: Point, n: float) -> tuple[float, np.ndarray]:
        pair = [{**typical, periods: n, phase: by} for by in QUARTERS]
        return _gain(held, here, effect.name, pair)

    if len(problem.recordings) > 1 and len(tried) > BEST:
        one = problem.on([problem.recordings[at]])
        there = linearised(one, point.effects, point.values)
        tried = sorted(tried, key=lambda n: -gained(one, there, n)[0])[:BEST]
    found = [(*gained(problem, point, n), n) for n in tried]
    gain, (sine, cosine), most = max(found, key=lambda one: one[0], default=(0.0, (0.0, 0.0), 0.0))
    if gain <= 0.0:
        return None
    size = knob.value + float(np.hypot(sine, cosine)) * (typical[strength] - knob.value)
    return {
        **typical,
        periods: most,
        phase: float(np.arctan2(cosine, sine)),
        strength: float(np.clip(size, knob.low, knob.high)),
    }


def _gain(
    problem: Problem, point: Point, effect: str, pair: list[dict[str, float]]
) -> tuple[float, np.ndarray]:
    """Fall of chi-square with the best amplitudes of two signatures, and these; what is free at
    ``point`` may imitate both.
    """
    gram, right = projected(
        problem, point, [difference(problem, point, effect, start) for start in pair]
    )
    by = -np.linalg.lstsq(gram, right, rcond=1e-6)[0]
    return float(-right @ by), by


def _furthest(problem: Problem, effect: Effect) -> tuple[int, float]:
    """The recording in which the angle that the wave runs over goes furthest, and how far, rad; 0
    where no link that it touches sees it.
    """
    found = [_range(problem, recording.name, effect) for recording in problem.recordings]
    at = int(np.argmax(found))
    return at, found[at]


def _range(problem: Problem, recording: str, effect: Effect) -> float:
    """How far the angle goes in a recording where it is judged, rad; 0 where no link sees it."""
    ranges = [0.0]
    for link in problem.touched(effect.knobs):
        seen = problem.subject.features(problem.prepared[recording], link)
        angle = seen.get(effect.swings_over, np.zeros(0))
        known = np.isfinite(angle)
        if len(angle):
            known &= problem.judged(recording, link)
        if known.any():
            ranges.append(float(np.ptp(angle[known])))
    return max(ranges)
