"""Who has a named effect: the rig alone, the plant file alone, or both at other strengths."""

from collections.abc import Mapping, Sequence

import numpy as np

from epa_rt.gap.diagnosis import Number, Who
from epa_rt.gap.likelihood.problem import Problem


def who_has(problem: Problem, effect: str, numbers: Sequence[Number]) -> Who:
    """``numbers``: the effect's fitted values. The rig does not have it where no link would see a
    difference without those that may be gone.
    """
    knobs = [problem.knobs[key] for key in problem.effects[effect].knobs]
    absent = {knob.key: knob.value if knob.absent is None else knob.absent for knob in knobs}
    if effect not in problem.in_plant or not _seen(problem, {}, absent):
        return "rig"
    fitted = {
        one.name: absent[one.name] if _gone(one, absent[one.name]) else one.value for one in numbers
    }
    return "both" if _seen(problem, fitted, absent) else "plant_file"


def _gone(one: Number, absent: float) -> bool:
    """Whether a fit has gone back to where the effect is not, within its interval (a value on a
    bound has the whole range).
    """
    return one.low <= absent <= one.high and abs(one.value - absent) < 0.5 * abs(
        one.neutral - absent
    )


def _seen(problem: Problem, values: Mapping[str, float], absent: Mapping[str, float]) -> bool:
    return any(
        not np.array_equal(problem.residual(values, link), problem.residual(absent, link))
        for link in problem.touched(absent)
    )
