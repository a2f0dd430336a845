"""Force models that are linear in their coefficients, fitted and judged from normal equations
alone.

Every block of a trial is read once; whatever is fitted, left out or resampled afterwards is sums of
these blocks.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from epa_rt.identify.data import BLOCK_S, HEAD_S, Normalisation, Trial, closed_path

RESAMPLES = 300


class Scaled(NamedTuple):
    """One stretch of a trial, normalised: pressure, elongation, contraction speed, force, the
    geometry's force (eq. 1), the same at the pressure that Boyle gives from the trial's start (eqs.
    1-3).
    """

    p: np.ndarray
    l: np.ndarray
    v: np.ndarray
    f: np.ndarray
    geometric: np.ndarray
    boyle: np.ndarray


@dataclass(frozen=True)
class Model:
    """``columns``: Scaled to (n, k); ``fixed``: what needs no coefficient, (n,) or None.

    ``mix``: for a coefficient that does not enter linearly, its value to the (k, j) matrix that
    makes the k terms from j coefficients; searched within ``mix_range``.
    """

    name: str
    says: str
    terms: tuple[str, ...]
    columns: Callable[[Scaled], np.ndarray]
    fixed: Callable[[Scaled], np.ndarray] | None = None
    mix: Callable[[float], np.ndarray] | None = None
    mix_name: str = ""
    mix_range: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Sums:
    """Of each block: ``matrix`` (B, k, k), ``right`` (B, k), ``square`` (B,) of the target (force
    minus fixed), ``force`` (B, 3): sum, sum of squares and count of the force; ``work`` (B, k + 2):
    columns, fixed part and force integrated over the elongation of whole loops; ``drag`` (B, k +
    1): what halving the speed takes off the columns, times speed, and speed squared. ``trial``
    (B,).
    """

    matrix: np.ndarray
    right: np.ndarray
    square: np.ndarray
    force: np.ndarray
    work: np.ndarray
    drag: np.ndarray
    trial: np.ndarray


def scaled(trial: Trial, norm: Normalisation, braid_length_m: float, turns: float) -> Scaled:
    """A trial in normalised quantities. Source: eqs. 1 and 3; shorter than no-load length the strap
    is slack.
    """
    length, b2 = np.maximum(trial.length_m, norm.no_load_m), braid_length_m**2
    area = (3.0 * length**2 - b2) / (4.0 * np.pi * turns**2)
    volume = (b2 - length**2) * length
    head = max(1, round(HEAD_S / trial.period_s))
    boyle = (trial.p0_pa + trial.atmosphere_pa) * np.mean(
        volume[:head]
    ) / volume - trial.atmosphere_pa
    return Scaled(
        trial.gauge_pa / norm.pressure_pa,
        (trial.length_m - norm.no_load_m) / norm.length_m,
        -trial.speed_m_s / norm.speed_m_s,
        trial.force_n / norm.force_n,
        trial.gauge_pa * area / norm.force_n,
        boyle * area / norm.force_n,
    )


def sums(model: Model, data: Sequence[Scaled], period_s: float) -> Sums:
    """The normal equations of every block of every trial."""
    rows, step = [], max(1, round(BLOCK_S / period_s))
    for index, whole in enumerate(data):
        moved = closed_path(whole.l)
        for start in range(0, len(whole.f), step):
            part = Scaled(*(values[start : start + step] for values in whole))
            rows.append((*_block(model, part, moved[start : start + step]), index))
    return Sums(
        *(np.array([row[i] for row in rows], float) for i in range(6)),
        np.array([row[6] for row in rows]),
    )


def _block(model: Model, part: Scaled, moved: np.ndarray) -> tuple:
    columns = model.columns(part)
    fixed = model.fixed(part) if model.fixed else np.zeros(len(part.f))
    target, slower = part.f - fixed, model.columns(part._replace(v=0.5 * part.v))
    return (
        columns.T @ columns,
        columns.T @ target,
        target @ target,
        (part.f.sum(), part.f @ part.f, len(part.f)),
        (*(moved @ columns), moved @ fixed, moved @ part.f),
        (*(part.v @ (columns - slower)), part.v @ part.v),
    )


def predicted(model: Model, fitted: "Fitted", data: Scaled) -> np.ndarray:
    """Normalised force (n,) of a fitted model."""
    fixed = model.fixed(data) if model.fixed else np.zeros(len(data.f))
    return model.columns(data) @ fitted.coefficients + fixed


@dataclass(frozen=True)
class Fitted:
    """``coefficients`` (k,) of the terms; ``free`` (j,) those that were fitted, ``mixed`` the value
    that ``mix`` took.
    """

    coefficients: np.ndarray
    free: np.ndarray
    mixed: float | None
    condition: float


def fit(model: Model, data: Sums, weights: np.ndarray, mixed: float | None = None) -> Fitted:
    """Least squares over blocks counted ``weights`` (B,) times; ``mixed`` given, the mix stays
    there.
    """
    matrix, right = np.tensordot(weights, data.matrix, 1), weights @ data.right
    if model.mix is None:
        free = _solve(matrix, right)
        return Fitted(free, free, None, _condition(matrix))
    if mixed is None:
        mixed = _searched(model, matrix, right)
    mix = model.mix(mixed)
    free = _solve(mix.T @ matrix @ mix, mix.T @ right)
    return Fitted(mix @ free, free, mixed, _condition(mix.T @ matrix @ mix))


def _searched(
    model: Model, matrix: np.ndarray, right: np.ndarray, near: float | None = None
) -> float:
    """The value of the nonlinear coefficient with the least squared error: a coarse grid, then
    refined; ``near``: no grid.
    """

    def error(value: float) -> float:
        mix = model.mix(value)
        inner, own = mix.T @ matrix @ mix, mix.T @ right
        return -float(own @ _solve(inner, own))

    if near is not None:
        reach = 0.1 * (model.mix_range[1] - model.mix_range[0])
        return float(
            minimize_scalar(
                error,
                bounds=(near - reach, near + reach),
                method="bounded",
                options={"xatol": 1e-3 * reach},
            ).x
        )
    grid = np.linspace(*model.mix_range, 25)
    best = int(np.argmin([error(value) for value in grid]))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    return float(minimize_scalar(error, bounds=(low, high), method="bounded").x)


def _solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Least squares with columns scaled to one; directions that the data lack stay at zero."""
    if not len(right):
        return np.zeros(0)
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    values, vectors = np.linalg.eigh(matrix / np.outer(size, size))
    inverse = np.where(values > 1e-13 * values[-1], 1.0 / np.maximum(values, 1e-300), 0.0)
    return vectors @ (inverse * (vectors.T @ (right / size))) / size


def _condition(matrix: np.ndarray) -> float:
    """Condition number of the regressors, columns scaled to one."""
    if not len(matrix):
        return 1.0
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    values = np.linalg.eigvalsh(matrix / np.outer(size, size))
    return float(np.sqrt(values[-1] / max(values[0], 1e-300)))


def error_of(data: Sums, coefficients: np.ndarray, inside: np.ndarray) -> float:
    """Squared error over the blocks ``inside`` (B,) of bool."""
    matrix, right = data.matrix[inside].sum(axis=0), data.right[inside].sum(axis=0)
    return max(
        float(
            data.square[inside].sum()
            - 2.0 * coefficients @ right
            + coefficients @ matrix @ coefficients
        ),
        0.0,
    )  # rounding


def resampled(model: Model, data: Sums, fitted: Fitted, seed: int = 0) -> np.ndarray:
    """(RESAMPLES, j) coefficients of block-bootstrap resamples, the mixed one last where there is
    one.
    """
    rng = np.random.default_rng(seed)
    blocks = len(data.square)
    weights = rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), size=RESAMPLES).astype(float)
    return np.array([_again(model, data, row, fitted.mixed) for row in weights])


def _again(model: Model, data: Sums, weights: np.ndarray, mixed: float | None) -> np.ndarray:
    if mixed is None:
        return fit(model, data, weights).free
    found = _searched(model, np.tensordot(weights, data.matrix, 1), weights @ data.right, mixed)
    return np.append(fit(model, data, weights, found).free, found)
