"""Rivals on the same cases: what one gets from libraries without this package's method.

Each is a diagnoser (``--diagnoser epa_rt.gap.blind.rivals:NAME``) with the same logs, the same links and the same catalogue,
and one amplitude per effect (0 off, 1 typical) beside the nominal parameters:

- ``cma_es``: CMA-ES over all parameters at once, as PACE does (library cma), at most BUDGET_S seconds;
- ``least_squares``: scipy's bounded least squares over all parameters at once, at most BUDGET_S seconds;
- ``sparse``: sparse regression of the residual on the terms of gap/regressors (pysindy's STLSQ); terms have no names, so it
  is given the name of the effect whose signature lies closest to the fitted terms;
- ``rmse``: every effect alone at its typical strengths; the one with the lowest RMSE.

Named is the effect whose switching off raises the RMSE most; nothing where the RMSE falls by less than LEAST.
"""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

BUDGET_S = 120.0
LEAST = 0.02
REACH = 3.0          # amplitudes run from -REACH or 0 to REACH, nominal parameters so many of their spreads
SPARSE_TERMS = 12
SPARSE_RIDGE = 0.05


class Arena:
    """The logs of a case as one residual vector over one vector of parameters, and the clock."""

    def __init__(self, rig: Path, plant: Path, logs: Sequence[Path], leave_out: Sequence[str]):
        from epa_rt.config.rig import load_rig
        from epa_rt.gap.read import read_recordings
        from epa_rt.gap.subjects import open_subject

        self.begun_s = time.monotonic()
        self.subject = open_subject(rig, plant)
        self.prepared = [self.subject.prepare(recording) for recording in read_recordings(list(logs), load_rig(rig))]
        self.effects = [effect for effect in self.subject.catalogue if effect.name not in leave_out]
        self.nominal = list(self.subject.nominal)
        self.size = len(self.nominal) + len(self.effects)
        self.links = [link.name for link in self.subject.links]
        self.scale = {name: self._noise(name) for name in self.links}
        self.links = [name for name in self.links if self.scale[name] > 0.0]
        n = len(self.nominal)
        self.high = np.full(self.size, REACH)
        self.low = np.array([-REACH] * n + [-REACH if self._two_sided(effect) else 0.0 for effect in self.effects])

    def _noise(self, link: str) -> float:
        """Size of the fast part of a link's residual: what differences from sample to sample leave."""
        steps = np.concatenate([np.diff(self.subject.residual(p, {}, link)) for p in self.prepared])
        steps = steps[np.isfinite(steps)]
        return float(1.4826 * np.median(np.abs(steps)) / np.sqrt(2.0)) if len(steps) else 0.0

    def _two_sided(self, effect) -> bool:
        knob = self.subject.knobs[effect.knobs[0]]
        return knob.low < knob.value and any(start[0] < knob.value for start in effect.starts)

    def values(self, z: np.ndarray) -> dict[str, float]:
        """Knob values of a parameter vector."""
        out = {k.key: float(np.clip(k.value + zi * k.spread, k.low, k.high)) for k, zi in zip(self.nominal, z, strict=False) if zi != 0.0}
        for effect, amplitude in zip(self.effects, z[len(self.nominal):], strict=True):
            if amplitude != 0.0:
                out |= self.switched(effect, effect.starts[0], amplitude)
        return out

    def switched(self, effect, start: Sequence[float], amplitude: float) -> dict[str, float]:
        """Knobs of one effect, an amplitude of the way from neutral to a start; those that only shape it as the start says."""
        knobs, first = [self.subject.knobs[key] for key in effect.knobs], True
        out = {}
        for knob, wanted in zip(knobs, start, strict=True):
            share = amplitude if first else 1.0
            out[knob.key] = float(np.clip(knob.value + share * (wanted - knob.value), knob.low, knob.high))
            first = first and wanted == knob.value
        return out

    def residual(self, values: dict[str, float]) -> np.ndarray:
        """All links of all logs, each in units of its noise; samples that are not judged are left out."""
        parts = [self.subject.residual(p, values, link) / self.scale[link] for p in self.prepared for link in self.links]
        whole = np.concatenate(parts)
        return np.clip(np.nan_to_num(whole[np.isfinite(self._base)], nan=1e3), -1e3, 1e3)

    @property
    def _base(self) -> np.ndarray:
        if not hasattr(self, "_kept"):
            self._kept = np.concatenate([self.subject.residual(p, {}, link) for p in self.prepared for link in self.links])
        return self._kept

    def rmse(self, z: np.ndarray) -> float:
        return float(np.sqrt(np.mean(self.residual(self.values(z)) ** 2)))

    @property
    def left_s(self) -> float:
        return BUDGET_S - (time.monotonic() - self.begun_s)

    def answer(self, z: np.ndarray) -> dict:
        """Names what matters most in a fitted vector."""
        n, before, after = len(self.nominal), self.rmse(np.zeros(self.size)), self.rmse(z)
        rises = []
        for i, effect in enumerate(self.effects):
            if z[n + i] != 0.0:
                without = z.copy()
                without[n + i] = 0.0
                rises.append((self.rmse(without) - after, effect))
        rises.sort(key=lambda item: -item[0])
        return self.said(before, after, [effect for rise, effect in rises if rise > LEAST * before])

    def said(self, before: float, after: float, effects: Sequence) -> dict:
        """An answer in the diagnosis' own words."""
        rough = {link.name: np.sqrt(np.nanmean(np.concatenate([self.subject.residual(p, {}, link.name) for p in self.prepared]) ** 2)) / self.scale[link.name]
                 for link in self.subject.links if link.name in self.links}
        worst = sorted((link for link in self.subject.links if link.name in rough), key=lambda link: -rough[link.name])
        found = effects if after < (1.0 - LEAST) * before else []
        return {"verdict": "explained" if found else "no_gap", "says": f"RMSE {before:.3g} to {after:.3g} times the noise",
                "effects": [{"name": e.name, "family": e.family, "block": e.block, "confidence": 1.0, "parameters": []} for e in found],
                "location": [{"block": link.block, "channel": link.channel} for link in worst], "shrinkage": []}


def cma_es(rig: Path, plant: Path, logs: Sequence[Path], holdout: Sequence[Path], leave_out: Sequence[str]) -> dict:
    """One CMA-ES over everything."""
    import cma

    arena = Arena(rig, plant, logs, leave_out)
    options = {"bounds": [arena.low.tolist(), arena.high.tolist()], "timeout": max(arena.left_s, 1.0), "verbose": -9, "seed": 1}
    search = cma.CMAEvolutionStrategy(np.where(arena.low < 0.0, 0.0, 0.1), 0.3, options)
    while not search.stop():
        asked = search.ask()
        search.tell(asked, [arena.rmse(np.asarray(z)) for z in asked])
    return arena.answer(np.asarray(search.result.xbest))


def least_squares(rig: Path, plant: Path, logs: Sequence[Path], holdout: Sequence[Path], leave_out: Sequence[str]) -> dict:
    """Plain least squares over everything."""
    from scipy.optimize import least_squares as fit

    arena, best = Arena(rig, plant, logs, leave_out), [np.inf, None]

    def vector(z: np.ndarray) -> np.ndarray:
        if arena.left_s < 0.0:
            raise TimeoutError
        found = arena.residual(arena.values(z))
        if (size := float(found @ found)) < best[0]:
            best[:] = [size, z.copy()]
        return found

    start = np.where(arena.low < 0.0, 0.0, 0.05)
    try:
        fit(vector, start, bounds=(arena.low, arena.high), diff_step=0.02, max_nfev=20)
    except TimeoutError:
        pass
    return arena.answer(start if best[1] is None else best[1])


def sparse(rig: Path, plant: Path, logs: Sequence[Path], holdout: Sequence[Path], leave_out: Sequence[str]) -> dict:
    """Sparse regression of the residual."""
    import pysindy

    from epa_rt.gap.regressors import terms

    arena, fitted = Arena(rig, plant, logs, leave_out), []
    for p in arena.prepared:
        for link in arena.links:
            residual = arena.subject.residual(p, {}, link) / arena.scale[link]
            columns = np.column_stack(list(terms(arena.subject.features(p, link), arena.subject.rate_hz).values()))
            good = np.isfinite(residual) & np.all(np.isfinite(columns), axis=1)
            out = np.zeros(len(residual))
            if good.sum() > 2 * columns.shape[1]:
                scaled = columns[good] / (columns[good].std(axis=0) + 1e-12)
                threshold = SPARSE_RIDGE * float(np.std(residual[good]))
                model = pysindy.STLSQ(threshold=threshold, alpha=SPARSE_RIDGE, max_iter=SPARSE_TERMS)
                model.fit(scaled, residual[good][:, None])
                out[good] = (scaled @ model.coef_.T).ravel()
            fitted.append(out)
    explained, zero = np.concatenate(fitted)[np.isfinite(arena._base)], arena.residual({})
    best = max(((_cosine(zero - arena.residual(arena.switched(e, start, 1.0)), explained), i, e)
                for i, e in enumerate(arena.effects) for start in e.starts[:1]), default=None)
    after = float(np.sqrt(np.mean((zero - explained) ** 2)))
    return arena.said(float(np.sqrt(np.mean(zero**2))), after, [best[2]] if best else [])


def rmse(rig: Path, plant: Path, logs: Sequence[Path], holdout: Sequence[Path], leave_out: Sequence[str]) -> dict:
    """Every effect alone; the lowest RMSE wins."""
    arena = Arena(rig, plant, logs, leave_out)
    before = arena.rmse(np.zeros(arena.size))
    found = [(float(np.sqrt(np.mean(arena.residual(arena.switched(e, start, 1.0)) ** 2))), i, e) for i, e in enumerate(arena.effects) for start in e.starts]
    after, _, effect = min(found)
    return arena.said(before, after, [effect])


def _cosine(a: np.ndarray, b: np.ndarray) -> float:
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size > 0.0 else 0.0
