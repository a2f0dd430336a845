"""A set of values at which every link's residual and its derivatives are known, and normal
equations by block.
"""

from dataclasses import dataclass, replace

import numpy as np

from epa_rt.gap.likelihood.problem import Problem

HELD = 0.02  # part of all information on a key that holds it while a fold is left out


@dataclass(frozen=True)
class Normal:
    """Normal equations by link and block: ``matrix`` (L, B, k, k), ``vector`` (L, B, k), ``square``
    (L, B).

    Columns are per spread of a knob. ``z`` (k,): distance of each key from its plant-file value, in
    spreads; ``prior`` (k,): 1 for nominal parameters, 0 for effects' knobs. ``frozen`` (k,): keys
    that sit on a bound and cannot move.
    """

    keys: tuple[str, ...]
    matrix: np.ndarray
    vector: np.ndarray
    square: np.ndarray
    z: np.ndarray
    prior: np.ndarray
    frozen: np.ndarray

    @property
    def chi(self) -> float:
        """Chi-square with the priors' part."""
        return float(self.square.sum() + self.prior @ self.z**2)

    @property
    def uncertain(self) -> np.ndarray:
        """(k,) keys whose covariance counts: those that can move, and nominal parameters on a bound
        too. A step may not take these further, and what is believed of them still lies on their
        other side (a command's delay and the row in which it is logged, which cannot be before its
        own).
        """
        return ~self.frozen | (self.prior > 0.0)

    def covariance(self) -> np.ndarray:
        """(f, f) of the keys that are ``uncertain``, in spreads: residuals white, the priors
        believed.
        """
        free = self.uncertain
        return np.linalg.inv(
            self.matrix.sum(axis=(0, 1))[np.ix_(free, free)] + np.diag(self.prior[free] + 1e-9)
        )

    def weighted(self, by: np.ndarray) -> "Normal":
        """The same where link l counts ``by[l]`` times, (L,)."""
        return replace(
            self,
            matrix=self.matrix * by[:, None, None, None],
            vector=self.vector * by[:, None, None],
            square=self.square * by[:, None],
        )

    def loss(self, step: np.ndarray) -> np.ndarray:
        """(L, B) chi-square after a step (k,) in spreads, linearised."""
        return (
            self.square
            + 2.0 * self.vector @ step
            + np.einsum("i,lbij,j->lb", step, self.matrix, step, optimize=True)
        )

    def promised(self, step: np.ndarray) -> float:
        """Chi-square after a step (k,) in spreads, linearised, with the priors' part."""
        return float(self.loss(step).sum() + self.prior @ (self.z + step) ** 2)

    def solved(self, weights: np.ndarray, held: np.ndarray | float = 0.0) -> np.ndarray:
        """(k,) step to the optimum where block b counts ``weights[b]`` times; ``held`` (k,) pulls
        each key to where it is.
        """
        matrix = np.einsum("b,lbij->ij", weights, self.matrix, optimize=True) + np.diag(
            np.broadcast_to(held, len(self.z))
        )
        vector = np.einsum("b,lbi->i", weights, self.vector, optimize=True)
        return solve(matrix, vector, self.prior, self.z, ~self.frozen)

    def missed(self, after: "Normal") -> float:
        """By how much chi-square after a step is not what was promised of it, and what is promised
        of the rest of the way.
        """
        promised = self.promised(after.z - self.z)
        return abs(after.chi - promised) + promised - self.reached()

    def reached(self) -> float:
        """Chi-square at the optimum, linearised, with the priors' part."""
        return self.promised(self.solved(np.ones(self.square.shape[1])))

    def left_out(self, fold_of_block: np.ndarray) -> np.ndarray:
        """(L, B) chi-square of every block under the fit to the other folds.

        Every key is held to where all folds want it by ``HELD`` of all that the folds say of it:
        where one trial alone shows a knob, the others would throw it anywhere, and a nominal
        parameter back to the plant file.
        """
        found = np.empty_like(self.square)
        held = HELD * np.einsum("lbii->i", self.matrix)
        for fold in np.unique(fold_of_block):
            inside = fold_of_block == fold
            found[:, inside] = self.loss(self.solved((~inside).astype(float), held))[:, inside]
        return found


@dataclass(frozen=True)
class Point:
    """``values``: knob key to value, of all that may differ from the plant file. ``effects``: names
    that are on.

    ``residual``: link to (n,). ``columns``: link to (positions in ``keys``, (n, m) derivatives per
    spread).
    """

    effects: tuple[str, ...]
    values: dict[str, float]
    residual: dict[str, np.ndarray]
    columns: dict[str, tuple[np.ndarray, np.ndarray]]
    normal: Normal

    def derivatives(self) -> dict[str, dict[str, np.ndarray]]:
        """Key to link to (n,) derivative per spread."""
        found: dict[str, dict[str, np.ndarray]] = {key: {} for key in self.normal.keys}
        for link, (positions, table) in self.columns.items():
            for at, column in zip(positions, table.T, strict=True):
                found[self.normal.keys[at]][link] = column
        return found


def solve(
    matrix: np.ndarray,
    vector: np.ndarray,
    prior: np.ndarray,
    z: np.ndarray,
    free: np.ndarray,
    damping: float = 1e-9,
) -> np.ndarray:
    """Step (k,) that minimises the quadratic form with priors, over the free keys alone."""
    step = np.zeros(len(z))
    if free.any():
        pick = np.ix_(free, free)
        whole = matrix[pick] + np.diag(prior[free])
        diagonal = np.diag(whole)
        whole = whole + np.diag(damping * diagonal + 1e-12 * max(diagonal.max(), 1.0))
        step[free] = -np.linalg.solve(whole, vector[free] + prior[free] * z[free])
    return step


def z_of(problem: Problem, keys, values) -> np.ndarray:
    """(k,) distance of each key from its plant-file value, in spreads. Raises KeyError for an
    unknown key.
    """
    return np.array(
        [
            (values.get(k, problem.knobs[k].value) - problem.knobs[k].value) / problem.spread(k)
            for k in keys
        ]
    )


def prior_of(problem: Problem, keys) -> np.ndarray:
    """(k,) 1 for nominal parameters, 0 for effects' knobs. Raises KeyError for an unknown key."""
    return np.array([1.0 if problem.knobs[k].effect is None else 0.0 for k in keys])


def by_block(
    problem: Problem, link: str, columns: np.ndarray, residual: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal equations of one link by block: (B, m, m), (B, m), (B,)."""
    edges, width = problem.edges[link], columns.shape[1]
    matrix, vector, square = (
        np.zeros((problem.blocks, width, width)),
        np.zeros((problem.blocks, width)),
        np.zeros(problem.blocks),
    )
    for b in np.flatnonzero(np.diff(edges)):
        j, r = columns[edges[b] : edges[b + 1]], residual[edges[b] : edges[b + 1]]
        matrix[b], vector[b], square[b] = j.T @ j, j.T @ r, r @ r
    return matrix, vector, square


def normal_of(problem: Problem, keys: tuple[str, ...], values, residual, columns) -> Normal:
    """Normal equations of all links at one set of values."""
    count, size = len(problem.links), len(keys)
    matrix, vector = (
        np.zeros((count, problem.blocks, size, size)),
        np.zeros((count, problem.blocks, size)),
    )
    square = np.zeros((count, problem.blocks))
    for i, link in enumerate(problem.links):
        at, table = columns[link]
        m, v, square[i] = by_block(problem, link, table, residual[link])
        matrix[i][:, at[:, None], at[None, :]] = m
        vector[i][:, at] = v
    return Normal(
        keys,
        matrix,
        vector,
        square,
        z_of(problem, keys, values),
        prior_of(problem, keys),
        frozen_at(problem, keys, values, vector, matrix),
    )


def frozen_at(problem: Problem, keys, values, vector, matrix) -> np.ndarray:
    """(k,) keys that sit on a bound and are pushed outward, or that change nothing at all."""
    push = vector.sum(axis=(0, 1))
    dead = np.einsum("lbii->i", matrix) <= 0.0
    found = np.zeros(len(keys), bool)
    for i, key in enumerate(keys):
        knob, at, hair = (
            problem.knobs[key],
            values.get(key, problem.knobs[key].value),
            1e-9 * problem.spread(key),
        )
        found[i] = (
            (at <= knob.low + hair and push[i] > 0.0)
            or (at >= knob.high - hair and push[i] < 0.0)
            or (dead[i] and knob.effect is not None)
        )
    return found


def linearised(
    problem: Problem,
    effects: tuple[str, ...],
    values: dict[str, float],
    near: Point | None = None,
    residual: dict[str, np.ndarray] | None = None,
) -> Point:
    """Residuals and derivatives of all links over the nominal parameters and the knobs of the
    effects that are on. ``near``: a point whose derivatives are kept for the keys that it has;
    ``residual``: that at these values, where it is known.
    """
    keys = problem.nominal + tuple(
        dict.fromkeys(k for e in effects for k in problem.effects[e].knobs)
    )
    here = residual or residual_at(problem, values)
    known = near.derivatives() if near else {}
    new = [key for key in keys if key not in known]
    made = problem.each(
        lambda key: {
            link: problem.derivative(values, key, link, here[link])
            for link in problem.touched((key,))
        },
        new,
    )  # links share much of a plant
    of_key = {**known, **dict(zip(new, made, strict=True))}
    columns = {}
    for link in problem.links:
        own = [(i, of_key[key][link]) for i, key in enumerate(keys) if link in of_key[key]]
        table = (
            np.column_stack([c for _, c in own]) if own else np.zeros((problem.samples(link), 0))
        )
        columns[link] = (np.array([i for i, _ in own], int), table)
    return Point(
        effects, dict(values), here, columns, normal_of(problem, keys, values, here, columns)
    )


def carried(problem: Problem, point: Point, values: dict[str, float]) -> Point:
    """The same effects at other values, with the derivatives of ``point``."""
    here = residual_at(problem, values)
    normal = normal_of(problem, point.normal.keys, values, here, point.columns)
    return Point(point.effects, values, here, point.columns, normal)


def costs(problem: Problem, keys: tuple[str, ...], values: dict[str, float]) -> float:
    """Chi-square of all links at these values, with the priors' part."""
    chi = sum(float(r @ r) for r in residual_at(problem, values).values())
    return chi + float(prior_of(problem, keys) @ z_of(problem, keys, values) ** 2)


def residual_at(problem: Problem, values: dict[str, float]) -> dict[str, np.ndarray]:
    """Link to (n,) residual at these values."""
    made = problem.each(lambda link: problem.residual(values, link), problem.links)
    return dict(zip(problem.links, made, strict=True))
