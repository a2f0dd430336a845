"""The numbers of a name as an answer gives them, with their intervals."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from epa_rt.gap.diagnosis import Number
from epa_rt.gap.likelihood.intervals import TWO_SIDED_95, intervals
from epa_rt.gap.likelihood.point import Normal, Point
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.profile import profiled
from epa_rt.gap.subject import OF_RUN

MOVED = 3.0  # spreads beyond which a nominal parameter is reported
WHISKER = 1e-6  # of a spread: so near counts as on a bound


def numbers(
    problem: Problem, point: Point, effect: str, off: np.ndarray | None, searched: bool = False
) -> tuple[Number, ...]:
    """An effect's numbers. ``off``: how far fits of twins go astray (astray.py). ``searched``: with
    the ends that are searched for where straight ones lie far apart.
    """
    width = intervals(point.normal, problem.effects[effect].knobs, off)
    ends = profiled(problem, point, effect, width, off) if searched else {}
    return tuple(
        _number(problem, key, point.values.get(key, problem.knobs[key].value), by, ends.get(key))
        for key, by in width.items()
    )


def _number(
    problem: Problem, key: str, value: float, width: float, ends: tuple[float, float] | None = None
) -> Number:
    """``width``: half of the interval, in spreads, where no ``ends`` of it are known."""
    knob, by = problem.knobs[key], width * problem.spread(key)
    value = min(max(value, knob.low), knob.high)  # spreads and back leave a whisker beside a bound
    low, high = ends or (max(value - by, knob.low), min(value + by, knob.high))
    return Number(key, value, knob.unit, low, high, knob.value, stands_at_end(problem, key, value))


def by_log(problem: Problem, point: Point, effect: str) -> tuple[Number, ...]:
    """An effect's strength in each of several logs, straight from ``point`` and with all else as it
    is there; intervals by the scatter of the log's blocks, or its noise where that is more. None
    where fewer than two logs show it.
    """
    number, normal = problem.strength(effect)[0], point.normal
    if number not in normal.keys or len(problem.recordings) < 2:
        return ()
    at = normal.keys.index(number)
    told = normal.matrix[:, :, at, at].sum(axis=0)
    toward = normal.vector[:, :, at].sum(axis=0)
    value, spread, found = point.values[number], problem.spread(number), []
    for log, blocks in problem.blocks_of.items():
        m, v = told[list(blocks)], toward[list(blocks)]
        if m.sum() > 0.0:
            by = -float(v.sum() / m.sum())
            width = max(np.sqrt(m.sum()), float(np.sqrt(((v + m * by) ** 2).sum()))) / m.sum()
            one = _number(problem, number, value + by * spread, TWO_SIDED_95 * float(width))
            found.append(replace(one, name=log))
    return tuple(found) if len(found) > 1 else ()


def nominal(problem: Problem, normal: Normal, off: np.ndarray | None) -> tuple[Number, ...]:
    """Nominal parameters as fitted, but for what is a number of one run alone."""
    width = intervals(normal, problem.nominal, off)
    return tuple(
        _number(problem, key, problem.knobs[key].value + z * problem.spread(key), width[key])
        for key, z in zip(normal.keys, normal.z, strict=True)
        if problem.knobs[key].effect is None and not key.startswith(OF_RUN)
    )


def moved(problem: Problem, normal: Normal, fitted: Sequence[Number]) -> tuple[Number, ...]:
    """Of nominal parameters as ``fitted`` those that went further from the plant file than anybody
    believed they could, in differences or in ratios: a half is as far off as twice as much. One
    whose interval holds what the plant file says went there for want of a reason to stay.
    """
    z_of = dict(zip(normal.keys, normal.z, strict=True))
    return tuple(
        one
        for one in fitted
        if max(abs(z_of[one.name]), _in_ratio(problem, one.name, z_of[one.name])) > MOVED
        and not one.low <= one.neutral <= one.high
    )


def _in_ratio(problem: Problem, key: str, z: float) -> float:
    """By how many of its spreads, as parts of its value, the log of a positive number has moved; 0
    of one that may have another sign.
    """
    knob, spread = problem.knobs[key], problem.spread(key)
    value = knob.value + z * spread
    if knob.low < 0.0 or not min(knob.value, value) > 0.0:
        return 0.0
    return abs(float(np.log(value / knob.value))) * knob.value / spread


def stands_at_end(problem: Problem, key: str, value: float) -> bool:
    """Whether a number stands where its law ends, and not because the effect or that part of it is
    absent there.
    """
    knob = problem.knobs[key]
    return value not in (knob.value, knob.absent) and min(
        abs(value - knob.low), abs(value - knob.high)
    ) < WHISKER * problem.spread(key)
