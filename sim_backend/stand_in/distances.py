"""How far readings with an effect are from a plant without it, and from a rival, after its nominal
parameters are fitted in free run.

The oracle's own distances are linear in the nominal parameters. That serves the search for a
strength; what is recorded is fitted, because an effect that nominal parameters imitate (a payload,
a changed mass) moves readings by hundreds of deviations before they are.
"""

from collections.abc import Sequence

import numpy as np

from epa_rt.benchmark.oracle import LIMIT, Bench, distance, explained
from sim_backend.stand_in.effects import BY_NAME, Hidden
from sim_backend.stand_in.fitted import Fitting, Law, law_of
from sim_backend.stand_in.truth import TruePlant, readings

LEAST = 0.5  # of the limit, below which a distance is left linear: nothing depends on it
GOES, FALLS = (
    5,
    0.97,
    # fits with fresh derivatives, each as long as the one before took off 3 %: one at 19 limits
    # fell to the limit itself
)
RIVAL = 4.0  # limits below which the nearest rival's distance is fitted: what says separable or not


class Apart:
    """Noise-free readings ``seen`` (n, channels) of a plant with an effect against the same plant
    without. ``linear`` and ``distance`` (never above it: fitted where so asked); ``shown``: what a
    fit of the nearest rival has reached, infinite where none was made. ``plant``: its effects are
    left out; ``bench`` around it.
    """

    def __init__(
        self,
        plant: TruePlant,
        bench: Bench,
        commands: Sequence[np.ndarray],
        seen: np.ndarray,
        fitted: bool = True,
    ):
        self.plant, self.bench, self.commands, self.seen = (
            plant._replace(effects=()),
            bench,
            commands,
            seen,
        )
        self.fitting, self.z = self._fitting(-bench.nominal), np.zeros(bench.nominal.shape[1])
        self.linear = self.distance = distance(bench, seen)
        self.shown = np.inf
        for go in range(GOES if fitted else 0):
            if self.distance < LEAST * LIMIT:
                break
            if go > 0:
                self.fitting = self._fitting(None)
            before = self.distance
            chi = self.fitting.fit(Law((), (), plant.same_law), self.z, outer=1).chi
            self.z, self.distance = self.fitting.last, min(before, float(np.sqrt(chi)))
            if go > 0 and self.distance > FALLS * before:
                break

    def _fitting(self, kept: np.ndarray | None) -> Fitting:
        return Fitting(
            self.plant, self.commands, self.seen, self.bench.noise, self.bench.judged, kept
        )

    def beside(self, law: Law) -> float:
        """Fitted distance where ``law`` with its numbers free, from its starts, may explain the
        readings too.
        """
        return float(np.sqrt(self.fitting.fit(law, self.z, outer=1).chi))

    def rivals(self, names: Sequence[str], fitted: bool) -> dict[str, float]:
        """Distance by rival of free strength: linear, but fitted for the nearest where that may
        decide.
        """
        found = {name: self._linear(BY_NAME[name]) for name in names}
        near = {name: min(left, self.distance) for name, (left, _, _) in found.items()}
        nearest = min(near, key=near.get, default=None)
        if fitted and nearest is not None and near[nearest] < RIVAL * LIMIT:
            self.shown = self._fitted(nearest, *found[nearest][1:])
            near[nearest] = min(near[nearest], self.shown)
        return near

    def _linear(self, rival: Hidden) -> tuple[float, np.ndarray, float]:
        """Distance, nominal parameters and strength of the rival that leave it, within what it may
        be; its signature at a strength of like size.
        """
        shapes = {name: 0.5 * (low + high) for name, low, high in rival.shapes}
        white, nominal = self.bench.white(self.seen), self.bench.nominal

        def signature(strength: float) -> np.ndarray:
            return self.bench.white(
                readings(
                    self.plant._replace(effects=((rival.name, {**shapes, rival.field: strength}),)),
                    self.commands,
                )
            )

        size = np.linalg.norm(white) / max(np.linalg.norm(signature(rival.typical)), 1e-9)
        strength = min(rival.typical * float(np.clip(size, 0.02, 5.0)), rival.most)
        column = signature(strength)
        left, x = explained(white, nominal, [column])
        wanted = float(x[-1]) * strength
        allowed = float(np.clip(wanted, -rival.most if rival.either_sign else 0.0, rival.most))
        if allowed != wanted:
            left, x = explained(white - column * (allowed / strength), nominal)
        return left, x[: nominal.shape[1]], allowed

    def _fitted(self, name: str, z: np.ndarray, strength: float) -> float:
        """From what is best linear, or from a weak rival beside what is fitted without: whichever
        is nearer.
        """
        rival = BY_NAME[name]
        strong = law_of(name, {rival.field: strength})
        weak = law_of(name, share=0.1 if rival.either_sign else 0.3)
        law, start = min(((strong, z), (weak, self.z)), key=lambda at: self.fitting.chi_at(*at))
        return float(np.sqrt(self.fitting.fit(law, start, outer=1).chi))
