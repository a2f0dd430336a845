"""The oracle as a diagnoser: told the laws that may have made a case's logs, it fits them and says
which one fits best.

Each law's parameters and the nominal ones (with their priors) are fitted in free run over the
logged commands: Gauss-Newton with damping, nominal derivatives made afresh every few rounds.
Chi-square counts as the oracle's distances do (gap/blind/oracle.py).
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from epa_rt.benchmark.oracle import INDEPENDENT_HZ, Bench
from epa_rt.models.catalogue import BY_NAME as CATALOGUE
from epa_rt.models.catalogue import read_knob, write_knob
from epa_rt.models.knobs import row_of
from sim_backend.stand_in.effects import BY_NAME
from sim_backend.stand_in.truth import TruePlant, competing, readings

OUTER, INNER, TRIES = 3, 3, 3  # fresh nominal derivatives, rounds with them, shortened steps
RATE_HZ = 100.0  # of the averaged readings
FAR = 25.0  # spreads within which nominal parameters are looked for; their priors charge for it
LEAST = 0.05  # of its believed value, below which none falls
NOMINAL_STEP = 0.1  # spreads
STEP = 0.02  # of an effect's knob, for derivatives
ENOUGH = 1.0  # fall of chi-square below which a fit has arrived


class Free(NamedTuple):
    """A number of a law: ``scale`` is one unit of the fit, ``start`` where it begins."""

    effect: str
    field: str
    scale: float
    low: float
    high: float
    start: float


class Law(NamedTuple):
    """One explanation of the logs. ``effects``: names of the stand-in, or of the catalogue where
    ``same_law``.
    """

    effects: tuple[str, ...]
    free: tuple[Free, ...]
    same_law: bool = False


class Fitted(NamedTuple):
    """A law fitted: ``chi`` is chi-square with the priors, ``values`` the law's own numbers by
    field.
    """

    law: Law
    chi: float
    values: dict[str, float]
    runs: int


def law_of(name: str, start: Mapping[str, float] | None = None, share: float = 1.0) -> Law:
    """A hidden effect as a law: from ``start`` (fields), else from ``share`` of its typical
    strength and the middle of its shapes.
    """
    h, given = BY_NAME[name], dict(start or {})
    low = -h.most if h.either_sign else 0.0
    free = [
        Free(
            name,
            h.field,
            h.typical,
            low,
            h.most,
            given.get(h.field, float(np.clip(share * h.typical, low, h.most))),
        )
    ]
    free += [
        Free(name, field, 0.5 * (b - a), a, b, given.get(field, 0.5 * (a + b)))
        for field, a, b in h.shapes
    ]
    return Law((name,), tuple(free))


def catalogue_law(name: str, start: Mapping[str, float]) -> Law:
    """An effect of the catalogue by its own law, from these knobs."""
    free = []
    for key, typical in zip(CATALOGUE[name].knobs, CATALOGUE[name].starts[0], strict=True):
        _, row, _ = row_of(key)
        size = abs(typical - row.neutral) if row.effect is not None else 0.1 * abs(typical)
        free.append(
            Free(name, key, max(size, 1e-3 * (row.high - row.low)), row.low, row.high, start[key])
        )
    return Law((name,), tuple(free), same_law=True)


def together(first: Law, second: Law) -> Law:
    """Both laws at once."""
    return Law(first.effects + second.effects, first.free + second.free, first.same_law)


class Fitting:
    """A case's logs: ``measured`` readings (n, channels), averaged as the oracle's are, over
    ``commands``; ``noise`` (channels,); ``judged``: rows (n,) bool that count, None for all;
    ``kept``: nominal derivatives to begin with, made elsewhere; ``exact``: as ``readings`` takes
    it, for readings of a log.
    """

    def __init__(
        self,
        believed: TruePlant,
        commands: Sequence[np.ndarray],
        measured: np.ndarray,
        noise: np.ndarray,
        judged: np.ndarray | None = None,
        kept: np.ndarray | None = None,
        exact: bool = False,
    ):
        self.believed, self.commands, self.measured, self.noise, self.judged = (
            believed,
            commands,
            measured,
            noise,
            judged,
        )
        self.items, self.exact = competing(believed.nominal), exact
        self.spread = [
            max(i.relative * abs(read_knob(believed.nominal, i.key)), i.least) for i in self.items
        ]
        values = [abs(read_knob(believed.nominal, i.key)) for i in self.items]
        self.low = [
            -min(FAR, (1.0 - LEAST) * value / spread) if value else -FAR
            for value, spread in zip(values, self.spread, strict=True)
        ]
        self.runs, self._kept = 0, kept

    def fit(self, law: Law, z: np.ndarray | None = None, outer: int = OUTER) -> Fitted:
        """The best fit from the law's own starts, nominal parameters from ``z`` (in spreads); its
        own are then in ``last``.

        With ``z`` the first rounds take the nominal derivatives that the fit before without effects
        ended with (or ``kept``).
        """
        k = len(self.items)
        scale = np.array([f.scale for f in law.free])
        low = np.array([*self.low, *(f.low / f.scale for f in law.free)])
        high = np.array([*([FAR] * k), *(f.high / f.scale for f in law.free)])
        x = np.clip(
            np.concatenate(
                [np.zeros(k) if z is None else z, [f.start / f.scale for f in law.free]]
            ),
            low,
            high,
        )
        began, at = self.runs, self._white(law, x)
        chi = self._chi(at, x)
        for turn in range(outer):
            keep = turn == 0 and z is not None and self._kept is not None
            before, nominal = (
                chi,
                (self._kept if keep else self._columns(law, x, at, range(k), NOMINAL_STEP, high)),
            )
            for _ in range(INNER):
                table = np.column_stack(
                    [nominal, self._columns(law, x, at, range(k, len(x)), STEP, high)]
                )
                better = self._stepped(law, table, x, at, chi, low, high)
                if better is None:
                    break
                arrived = chi - better[2] < ENOUGH
                x, at, chi = better
                if arrived:
                    break
            if before - chi < ENOUGH:
                break
        if not law.free:
            self._kept = nominal
        self.last = x[:k]
        return Fitted(
            law,
            chi,
            {
                f"{f.effect}.{f.field}": float(v * s)
                for f, v, s in zip(law.free, x[k:], scale, strict=True)
            },
            self.runs - began,
        )

    def spreads_of(self, values: Mapping[str, float]) -> np.ndarray:
        """Nominal parameters at ``values`` (those that are not there as believed), in spreads
        (k,).
        """
        at = [
            values.get(item.key, read_knob(self.believed.nominal, item.key)) for item in self.items
        ]
        return np.array(
            [
                (v - read_knob(self.believed.nominal, item.key)) / s
                for v, s, item in zip(at, self.spread, self.items, strict=True)
            ]
        )

    def chi_at(self, law: Law, z: np.ndarray) -> float:
        """Chi-square at the law's own starts and nominal parameters at ``z`` (in spreads)."""
        x = np.concatenate([np.clip(z, self.low, FAR), [f.start / f.scale for f in law.free]])
        return self._chi(self._white(law, x), x)

    def _stepped(self, law: Law, table: np.ndarray, x, at, chi, low, high):
        k, damping = len(self.items), 1e-6
        far = max(
            1.0, RATE_HZ / INDEPENDENT_HZ * chi / len(at)
        )  # a bad fit must not drive what the data hardly show
        prior = np.concatenate([np.full(k, far), np.full(len(x) - k, 1e-9)])
        matrix, slope = (
            table.T @ table + np.diag(prior),
            table.T @ at + prior * np.concatenate([x[:k], np.zeros(len(x) - k)]),
        )
        stuck = ((x <= low) & (slope > 0.0)) | ((x >= high) & (slope < 0.0))
        free = np.flatnonzero(~stuck)
        for _ in range(TRIES):
            step = np.zeros(len(x))
            own = matrix[np.ix_(free, free)]
            step[free] = -np.linalg.solve(own + damping * np.diag(np.diag(own)), slope[free])
            there = np.clip(x + step, low, high)
            found = self._white(law, there)
            if (c := self._chi(found, there)) < chi:
                return there, found, c
            damping = max(30.0 * damping, 0.03)
        return None

    def _columns(self, law: Law, x, at, which, step: float, high) -> np.ndarray:
        made = []
        for i in which:
            moved = x.copy()
            moved[i] += step if x[i] + step <= high[i] else -step
            made.append((self._white(law, moved) - at) / (moved[i] - x[i]))
        return np.column_stack(made) if made else np.zeros((len(at), 0))

    def _chi(self, white: np.ndarray, x: np.ndarray) -> float:
        with np.errstate(over="ignore"):  # a run that went wild is no fit
            chi = float(white @ white + x[: len(self.items)] @ x[: len(self.items)])
        return chi if np.isfinite(chi) else np.inf

    def _white(self, law: Law, x: np.ndarray) -> np.ndarray:
        self.runs += 1
        k, nominal = len(self.items), self.believed.nominal.copy()
        for item, spread, z in zip(self.items, self.spread, x, strict=False):
            write_knob(nominal, item.key, read_knob(nominal, item.key) + z * spread)
        fields: dict[str, dict[str, float]] = {name: {} for name in law.effects}
        for free, value in zip(law.free, x[k:], strict=True):
            fields[free.effect][free.field] = value * free.scale
        plant = TruePlant(nominal, tuple(fields.items()), law.same_law)
        return Bench(
            readings(plant, self.commands, exact=self.exact),
            self.noise,
            np.zeros((0, 0)),
            self.judged,
        ).white(self.measured)
