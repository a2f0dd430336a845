"""A name as an answer gives it: its numbers with their intervals, how sure it is, and what came
near.
"""

import numpy as np

from epa_rt.gap.attribution import Attribution
from epa_rt.gap.diagnosis import Named, Near, Number
from epa_rt.gap.law_ends import stands_at_end
from epa_rt.gap.point import Normal, Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.profile import profiled
from epa_rt.gap.role import z_of_sum
from epa_rt.gap.separate import intervals, shares
from epa_rt.gap.subject import OF_RUN
from epa_rt.gap.whose import who_has

MOVED = 3.0  # spreads beyond which a nominal parameter is reported
NEAR = 0.5  # of what the named one explains, from which another family's law came near


def named(found: Attribution, k: int, trusted: float) -> Named:
    """The ``k``-th name. ``trusted``: what its share of the resamples counts. With the intervals of
    the blocks' scatter alone. What is named itself is no rival of another name.
    """
    problem, final, role = found.problem, found.selection.final, found.selection.roles[k]
    effect = problem.effects[role.best.effect]
    own = numbers(problem, final, effect.name, None)
    stays = shares(problem, role, found.become[k])
    same = {
        effect.name,
        *(
            fit.effect
            for fit in found.sets[k]
            if problem.effects[fit.effect].family == effect.family
        ),
    }
    return Named(
        effect.name,
        effect.family,
        effect.block,
        own,
        trusted * sum(stays.get(name, 0.0) for name in same),
        float(role.gains[0].sum()),
        tuple(fit.effect for fit in found.sets[k] if fit.effect not in final.effects),
        who_has(problem, effect.name, own),
        _came_near(found, k),
        tuple(sorted(found.become[k])),
    )


def _came_near(found: Attribution, k: int) -> tuple[Near, ...]:
    """The best law of each other family that explains half as much at least, three at most."""
    problem, role = found.problem, found.selection.roles[k]
    tried = found.heard.beside.get(role.best.effect, {}) if found.heard else {}
    best, near = role.gains[0], {}
    for fit, gain in zip(role.fits[1:], role.gains[1:], strict=True):
        family, share = (
            problem.effects[fit.effect].family,
            (float(gain.sum() / best.sum()) if best.sum() > 0.0 else 0.0),
        )
        if (
            family != problem.effects[role.best.effect].family
            and family not in near
            and share > NEAR
        ):
            near[family] = Near(
                fit.effect,
                family,
                share,
                z_of_sum(best - gain),
                tried[fit.effect].behind if fit.effect in tried else None,
            )
    return tuple(sorted(near.values(), key=lambda one: -one.explains_share)[:3])


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


def furthest(problem: Problem, normal: Normal, most: int = 2) -> tuple[Number, ...]:
    """The nominal parameter that went furthest from the plant file, in spreads, and others that
    went by more than a plant file's own error, ``most`` in all.
    """
    width = intervals(normal, problem.nominal, None)
    far = sorted(
        (
            (abs(z), key, z)
            for key, z, prior in zip(normal.keys, normal.z, normal.prior, strict=True)
            if prior and problem.knobs[key].effect is None
        ),
        reverse=True,
    )
    return tuple(
        _number(problem, key, problem.knobs[key].value + z * problem.spread(key), width[key])
        for k, (by, key, z) in enumerate(far[:most])
        if not k or by > 1.0
    )


def moved(problem: Problem, normal: Normal, off: np.ndarray | None) -> tuple[Number, ...]:
    """Nominal parameters that went further from the plant file than anybody believed they could."""
    width = intervals(normal, problem.nominal, off)
    return tuple(
        _number(problem, key, problem.knobs[key].value + z * problem.spread(key), width[key])
        for key, z in zip(normal.keys, normal.z, strict=True)
        if problem.knobs[key].effect is None and abs(z) > MOVED and not key.startswith(OF_RUN)
    )
