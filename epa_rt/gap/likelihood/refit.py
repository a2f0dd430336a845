"""Refits: Levenberg-Marquardt over an effect's knobs with everything that was free before, within
bounds.

Derivatives of what was free before are kept from the point that the refit starts from; residuals
are made anew in the links that the new knobs touch, by a rougher model where the subject has one,
and linear in the others. A step that
overshoots is bent along the valley it runs in: what a load weighs is a product of mass and lever,
and a straight step along it leaves the valley at once.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from epa_rt.gap.likelihood.point import (
    Normal,
    Point,
    by_block,
    carried,
    frozen_at,
    linearised,
    prior_of,
    solve,
    z_of,
)
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.subject import Values

ROUNDS = 10
POLISH_ROUNDS = 10
LENGTHS = (1.0, 0.4, 0.1)  # of a Gauss-Newton step
DAMPINGS = (1.0, 100.0)  # where the whole step is too bold in every length
AS_GOOD = 0.5  # of what the whole step promises, that is good enough to try no other
LIGHT, FARTHER = (
    (0.01, 0.1),
    2.0,
    # damping, of the normal equations' diagonal; times what another step falls by, from which a
    # damped one takes its place
)
AHEAD = 0.1  # of a step, over which its curvature is measured
ENOUGH = 2e-4  # relative fall of chi-square below which a refit has arrived


@dataclass(frozen=True)
class Fit:
    """An effect refitted at a point. ``values`` holds everything that differs from the plant file;
    ``chi`` with priors.
    """

    effect: str
    values: dict[str, float]
    chi: float
    normal: Normal


def settled(
    problem: Problem,
    effects: tuple[str, ...] = (),
    values: Mapping[str, float] | None = None,
    rounds: int = POLISH_ROUNDS,
) -> Point:
    """Everything free refitted with fresh derivatives: the nominal parameters alone, or with the
    effects that are on. The last step, which hardly falls, keeps those of before. Raises Stopped.
    """
    point = linearised(problem, effects, dict(values or {}))
    for _ in range(rounds):
        after = searched(problem, point)
        if after is None:
            break
        there = carried(problem, point, after)
        if point.normal.chi - there.normal.chi < ENOUGH * point.normal.chi:
            return there
        point = linearised(problem, effects, after, residual=there.residual)
    return point


def settled_with(problem: Problem, effects: tuple[str, ...], values: Mapping[str, float]) -> Point:
    """Everything free refitted with these effects alone on, from values that others may have had a
    part in.
    """
    return settled(problem, effects, problem.kept(values, effects))


def searched(problem: Problem, point: Point, light: bool = False) -> dict[str, float] | None:
    """Values after the first of a few lengths of the Gauss-Newton step, bent and straight, then of
    damped ones, that helps; None where none does.

    Far from a valley's floor a damped step falls several times as far as the first that helps, and
    takes its place where ``light``; on the floor it hardly moves, and a bent one leads along. Fits
    of blocks begin near, and without it. Raises Stopped.
    """
    normal = point.normal
    system = (
        normal.matrix.sum(axis=(0, 1)),
        normal.vector.sum(axis=(0, 1)),
        normal.prior,
        normal.z,
        ~normal.frozen,
    )
    whole = solve(*system)
    bend = cache(
        lambda: bent(
            problem,
            normal.keys,
            point.values,
            point.residual,
            point.columns,
            system,
            whole,
            problem.residual,
        )
    )
    steps = [
        lambda: whole,
        *(lambda part=part: part * whole + part**2 * bend() for part in LENGTHS),
        *(lambda part=part: part * whole for part in LENGTHS[1:]),
        *(lambda by=by: solve(*system, damping=by) for by in DAMPINGS),
    ]
    values, fell = next(
        (one for one in (_fallen(problem, point, step()) for step in steps) if one[1] > 0.0),
        (None, 0.0),
    )
    if light and fell < AS_GOOD * (normal.chi - normal.promised(whole)):
        damped, further = max(
            (_fallen(problem, point, solve(*system, damping=by)) for by in LIGHT),
            key=lambda one: one[1],
        )
        if further > FARTHER * fell:
            return damped
    return values


def _fallen(problem: Problem, point: Point, step: np.ndarray) -> tuple[dict[str, float], float]:
    """Values after a step (k,) in spreads, and what chi-square falls by; none where the step is no
    number: a plant ran away on the way there.
    """
    if not np.isfinite(step).all():
        return dict(point.values), -np.inf
    keys = point.normal.keys
    values = moved(problem, keys, point.values, step)
    chi = sum(
        float(r @ r)
        for r in problem.each(lambda link: problem.residual(values, link), problem.links)
    )
    fell = point.normal.chi - chi - float(point.normal.prior @ z_of(problem, keys, values) ** 2)
    return values, fell if np.isfinite(fell) else -np.inf


def bent(
    problem: Problem,
    keys,
    values: Mapping[str, float],
    residual: Mapping[str, np.ndarray],
    columns,
    system,
    step: np.ndarray,
    evaluated: Callable[[Values, str], np.ndarray],
    damping: float = 1e-9,
) -> np.ndarray:
    """(k,) half the acceleration of the path whose first derivative is ``step``: what its curvature
    adds to it (geodesic acceleration, Transtrum and Sethna, arXiv:1201.5885). ``columns``: link to
    positions in ``keys`` and derivatives, of the links that may be curved. ``evaluated``:
    what gives ``residual``.
    """
    ahead = moved(problem, keys, values, AHEAD * step)
    vector = np.zeros(len(step))
    for link, (positions, table) in columns.items():
        curve = (evaluated(ahead, link) - residual[link] - AHEAD * (table @ step[positions])) * (
            2.0 / AHEAD**2
        )
        vector[positions] += table.T @ curve
    matrix, _, prior, z, free = system
    return 0.5 * solve(matrix, vector, prior, np.zeros(len(z)), free, damping)


def moved(
    problem: Problem, keys, values: Mapping[str, float], step: np.ndarray
) -> dict[str, float]:
    """Values after a step in spreads, clipped to the bounds."""
    found = dict(values)
    for key, by in zip(keys, step, strict=True):
        knob = problem.knobs[key]
        found[key] = float(
            np.clip(found.get(key, knob.value) + by * problem.spread(key), knob.low, knob.high)
        )
    return found


class _Trial:
    """One evaluation of a refit: residuals of the touched links, chi-square of everything."""

    def __init__(
        self,
        problem: Problem,
        point: Point,
        touched: tuple[str, ...],
        values: dict[str, float],
        rest,
    ) -> None:
        keys = point.normal.keys
        self.values = values
        self.residual = {link: problem.near(point, values, link) for link in touched}
        self.by = z_of(problem, keys, values) - point.normal.z
        matrix, vector, square = rest
        untouched = square + 2.0 * vector @ self.by + self.by @ matrix @ self.by
        prior = point.normal.prior @ (point.normal.z + self.by) ** 2
        chi = untouched + prior + sum(float(r @ r) for r in self.residual.values())
        self.chi = float(chi) if np.isfinite(chi) else np.inf


def refit(
    problem: Problem,
    point: Point,
    effect: str,
    start: Mapping[str, float],
    rounds: int = ROUNDS,
    enough: float = ENOUGH,
    in_proportion: bool = False,
) -> Fit:
    """The effect's knobs with everything free at ``point``, from ``start`` (knob key to value),
    until chi-square falls by less than ``enough`` of it. ``in_proportion``: its knobs move
    residuals so nearly in proportion that their derivatives at the start are good everywhere.
    Raises Stopped.
    """
    new = tuple(k for k in problem.effects[effect].knobs if k not in point.normal.keys)
    keys = point.normal.keys + new
    touched = problem.touched(new)
    others = [i for i, link in enumerate(problem.links) if link not in touched]
    rest = (
        point.normal.matrix[others].sum(axis=(0, 1)),
        point.normal.vector[others].sum(axis=(0, 1)),
        float(point.normal.square[others].sum()),
    )
    at = _Trial(problem, point, touched, {**point.values, **start}, rest)
    prior, damping, tables = prior_of(problem, keys), 1e-3, None
    for _ in range(rounds):
        tables = tables or _tables(problem, point, at, touched, new, keys)
        matrix, vector, z, frozen = _whole(problem, point, at, touched, tables, rest, keys)
        better = _stepped(
            problem, point, at, tables, rest, keys, (matrix, vector, prior, z, ~frozen), damping
        )
        if better is None:
            break
        after, damping = better
        arrived = at.chi - after.chi < enough * at.chi
        at, tables = after, tables if in_proportion else None
        if arrived:
            break
    tables = tables or _tables(problem, point, at, touched, new, keys)
    return Fit(effect, at.values, at.chi, _normal(problem, point, at, touched, tables, keys))


def _tables(
    problem: Problem, point: Point, at: _Trial, touched, new, keys
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Columns of the touched links: kept ones of what was free, fresh ones of the new knobs."""
    made = {}
    for link in touched:
        positions, kept = point.columns[link]
        own = [key for key in new if link in problem.touched((key,))]
        fresh = [problem.derivative(at.values, key, link, at.residual[link]) for key in own]
        made[link] = (
            np.concatenate([positions, [keys.index(key) for key in own]]).astype(int),
            np.column_stack([kept, *fresh]),
        )
    return made


def _whole(problem: Problem, point: Point, at: _Trial, touched, tables, rest, keys):
    """Normal equations over all links at a trial, z and which keys are frozen."""
    old, size = len(point.normal.keys), len(keys)
    matrix, vector = np.zeros((size, size)), np.zeros(size)
    matrix[:old, :old] = rest[0]
    vector[:old] = rest[1] + rest[0] @ at.by
    for link in touched:
        positions, table = tables[link]
        matrix[np.ix_(positions, positions)] += table.T @ table
        vector[positions] += table.T @ at.residual[link]
    frozen = frozen_at(problem, keys, at.values, vector[None, None], matrix[None, None])
    return matrix, vector, z_of(problem, keys, at.values), frozen


def _stepped(
    problem: Problem, point: Point, at: _Trial, tables, rest, keys, system, damping: float
):
    """A better trial and the next damping, None where no step helps."""
    for attempt in range(5):
        step = solve(*system, damping=damping)
        after = _Trial(problem, point, tuple(tables), moved(problem, keys, at.values, step), rest)
        if after.chi >= at.chi and attempt == 0:
            step = step + bent(
                problem,
                keys,
                at.values,
                at.residual,
                tables,
                system,
                step,
                lambda values, link: problem.near(point, values, link),
                damping,
            )
            after = _Trial(
                problem, point, tuple(tables), moved(problem, keys, at.values, step), rest
            )
        if after.chi < at.chi:
            return after, max(damping / 10.0, 1e-8)
        damping = max(damping, 1e-4) * 10.0
    return None


def _normal(problem: Problem, point: Point, at: _Trial, touched, tables, keys) -> Normal:
    """Normal equations by block at the end of a refit; untouched links are shifted by what the kept
    keys moved.
    """
    base, old, size = point.normal, len(point.normal.keys), len(keys)
    matrix = np.zeros((len(problem.links), problem.blocks, size, size))
    vector, square = np.zeros(matrix.shape[:3]), base.loss(at.by)
    matrix[:, :, :old, :old] = base.matrix
    vector[:, :, :old] = base.vector + base.matrix @ at.by
    for i, link in enumerate(problem.links):
        if link in touched:
            positions, table = tables[link]
            matrix[i], vector[i] = 0.0, 0.0
            m, v, square[i] = by_block(problem, link, table, at.residual[link])
            matrix[i][:, positions[:, None], positions[None, :]] = m
            vector[i][:, positions] = v
    frozen = frozen_at(problem, keys, at.values, vector, matrix)
    return Normal(
        keys,
        matrix,
        vector,
        square,
        z_of(problem, keys, at.values),
        prior_of(problem, keys),
        frozen,
    )
