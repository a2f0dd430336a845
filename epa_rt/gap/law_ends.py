"""Numbers of a law that stand where it ends: what wants to go on from there is mostly another
thing.

A law's bounds are what is known of its kind in nature. A wrong law in another one's place leaves
them where it can: a gas that cools in half a minute for one that leaks.
"""

from collections.abc import Mapping

import numpy as np

from epa_rt.gap.as_one import fitted
from epa_rt.gap.point import Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.rules import Rules

WHISKER = 1e-6  # of a spread: so near counts as on a bound
# times from a bound a number is held to see what that costs, half of the way to the other one where
# the range is shorter, a quarter of it where it ends at zero
INWARD = 4.0


def stands_at_end(problem: Problem, key: str, value: float) -> bool:
    """Whether a number stands where its law ends, and not because the effect or that part of it is
    absent there.
    """
    knob = problem.knobs[key]
    return value not in (knob.value, knob.absent) and min(
        abs(value - knob.low), abs(value - knob.high)
    ) < WHISKER * problem.spread(key)


def pressed(
    problem: Problem, whole: Problem, none: Point, best: Point, rules: Rules = Rules()
) -> dict[str, float]:
    """Times, speeds, lengths and the like by which named laws are shaped, and the ends they stand
    at, where the whole plant is plainly further off with them further in. ``none``: without
    effects.

    A right law that shows faintly may stand there as well, and does not mind (a gas' cooling rate
    at 100 /s: held at 25 it costs 1 of 56); a wrong one does (held at four times its end 33 of 234
    for a gas that cools slowly in a leak's place, 47 and more of 150 for a low-speed friction at 5
    cm/s in a damping's). A part of a whole, such as how much of a gear's friction slides, ends
    where nature does.
    """
    shapes = [
        key
        for name in best.effects
        for key in problem.effects[name].knobs
        if key not in problem.strength(name)
        and problem.knobs[key].unit != "1"
        and not key.endswith("_phase_rad")
    ]
    worth = max(rules.helps, rules.part * (none.normal.chi - best.normal.chi))
    return {
        key: best.values[key]
        for key in shapes
        if stands_at_end(problem, key, best.values[key]) and _costs(whole, best, key) > worth
    }


def _costs(whole: Problem, best: Point, key: str) -> float:
    """Chi-square in free run by which the plant is further off with a number held inside of its
    range, everything else refitted.
    """
    at = _inside(whole, best.values, key)
    return (
        fitted(whole.bounded({key: (at, at)}), best.effects, {**best.values, key: at}).normal.chi
        - best.normal.chi
    )


def _inside(whole: Problem, values: Mapping[str, float], key: str) -> float:
    knob = whole.knobs[key]
    here, there = (
        (knob.low, knob.high)
        if abs(values[key] - knob.low) < abs(values[key] - knob.high)
        else (knob.high, knob.low)
    )
    if knob.low <= 0.0:
        return here + (there - here) / INWARD
    return float(
        here * np.exp(np.clip(0.5 * np.log(there / here), -np.log(INWARD), np.log(INWARD)))
    )
