"""Rivals on the same cases: what one gets from libraries without this package's method.

Each is a diagnoser (``--diagnoser epa_rt.benchmark.rivals:NAME``) with the same logs, links and
catalogue (arena.py says what of the logs it looks at and how a fitted vector is read). Budgets are
counted in evaluations, so that an answer is the same on every machine:

- ``cma_es``: CMA-ES over all parameters at once, as PACE does (library cma), CMA_EVALUATIONS
  evaluations on the first log;
- ``least_squares``: scipy's bounded least squares over all parameters at once, at most ROUNDS
  rounds with a whole Jacobian each;
- ``sparse``: sparse regression of each link's residual (pysindy's STLSQ) on the terms of
  gap/regressors without their products, every SPARSE_EVERY-th sample; terms have no names, so it is
  given the name of the effect whose signature, at the nearest of its starts and of either sign,
  lies closest to what the terms explain;
- ``rmse``: every effect alone at its typical strengths; the one with the lowest RMSE.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from epa_rt.benchmark.arena import Arena

CMA_EVALUATIONS = 300
CMA_SIZE = 0.03  # of the first steps, in amplitudes
ROUNDS = 4
STEP = 0.02  # of a finite difference, in amplitudes
SPARSE_EVERY = 4
SPARSE_RIDGE = 0.05


def cma_es(
    rig: Path, plant: Path, logs: Sequence[Path], holdout: Sequence[Path], leave_out: Sequence[str]
) -> dict:
    """One CMA-ES over everything, with the library's diagonal matrix for many parameters and few
    evaluations.
    """
    import cma

    arena = Arena(rig, plant, logs[:1], leave_out)
    options = {
        "bounds": [arena.low.tolist(), arena.high.tolist()],
        "maxfevals": CMA_EVALUATIONS,
        "verbose": -9,
        "seed": 1,
        "CMA_diagonal": True,
    }
    search = cma.CMAEvolutionStrategy(np.zeros(arena.size), CMA_SIZE, options)
    while not search.stop():
        asked = search.ask()
        search.tell(asked, [arena.rmse(arena.values(np.asarray(z))) for z in asked])
    return {
        **arena.answer(np.asarray(search.result.xbest)),
        "evaluations": int(search.result.evaluations),
    }


def least_squares(
    rig: Path, plant: Path, logs: Sequence[Path], holdout: Sequence[Path], leave_out: Sequence[str]
) -> dict:
    """Plain least squares over everything."""
    from scipy.optimize import least_squares as fit

    arena = Arena(rig, plant, logs, leave_out)
    found = fit(
        lambda z: arena.residual(arena.values(z)),
        np.zeros(arena.size),
        lambda z: arena.jacobian(z, STEP),
        bounds=(arena.low, arena.high),
        max_nfev=ROUNDS,
    )
    return {**arena.answer(found.x), "evaluations": int(found.nfev + found.njev * arena.size)}


def sparse(
    rig: Path, plant: Path, logs: Sequence[Path], holdout: Sequence[Path], leave_out: Sequence[str]
) -> dict:
    """Sparse regression of the residual."""
    arena = Arena(rig, plant, logs, leave_out)
    explained = np.concatenate([_explained(arena, link) for link in arena.links])
    zero = arena.residual({})
    best = max(
        (
            (
                max(
                    abs(_cosine(zero - arena.residual(arena.switched(e, start, 1.0)), explained))
                    for start in e.starts
                ),
                -i,
                e,
            )
            for i, e in enumerate(arena.effects)
        ),
        default=None,
    )
    after = float(np.sqrt(np.mean((zero - explained) ** 2)))
    return arena.said(arena.rmse({}), after, [best[2]] if best else [])


def _explained(arena: Arena, link: str) -> np.ndarray:
    """What the sparse model makes of a link's residual, at the samples that are judged."""
    import pysindy

    from epa_rt.gap.likelihood.regressors import terms

    tables = []
    for p in arena.prepared:
        with np.errstate(invalid="ignore"):  # the memory of a place that stands still
            found = terms(arena.subject.features(p, link), arena.subject.rate_hz)
        tables.append({name: columns for name, columns in found.items() if " x " not in name})
    widths = {name: columns.shape[1] for table in tables for name, columns in table.items()}
    columns = np.concatenate(
        [
            np.column_stack(
                [
                    _usable(table.get(name), width, next(iter(table.values())))
                    for name, width in widths.items()
                ]
            )
            for table in tables
        ]
    )
    columns, residual = columns[arena.good[link]], arena.link({}, link)
    good = np.all(np.isfinite(columns), axis=1)
    out = np.zeros(len(residual))
    if good.sum() <= 2 * SPARSE_EVERY * columns.shape[1]:
        return out
    columns = columns[good] / (columns[good].std(axis=0) + 1e-12)
    wanted = residual[good]
    model = pysindy.STLSQ(threshold=SPARSE_RIDGE * float(np.std(wanted)), alpha=SPARSE_RIDGE)
    model.fit(columns[::SPARSE_EVERY], wanted[::SPARSE_EVERY, None])
    out[good] = (columns @ model.coef_.T).ravel()
    return out


def _usable(columns: np.ndarray | None, width: int, like: np.ndarray) -> np.ndarray:
    """A group's columns (n, width); zeros where a state stands still in a window and has none."""
    out = np.zeros((len(like), width)) if columns is None else columns
    return np.where(np.isfinite(out).any(axis=0), out, 0.0)


def rmse(
    rig: Path, plant: Path, logs: Sequence[Path], holdout: Sequence[Path], leave_out: Sequence[str]
) -> dict:
    """Every effect alone; the lowest RMSE wins."""
    arena = Arena(rig, plant, logs, leave_out)
    after, _, _, effect = min(
        (arena.rmse(arena.switched(e, start, 1.0)), i, k, e)
        for i, e in enumerate(arena.effects)
        for k, start in enumerate(e.starts)
    )
    return arena.said(arena.rmse({}), after, [effect])


def _cosine(a: np.ndarray, b: np.ndarray) -> float:
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size > 0.0 else 0.0
