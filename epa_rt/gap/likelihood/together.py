"""Blocks and free run at once: the numbers that a patched plant gets must serve both.

A block fed with measured inputs hardly feels some directions of the nominal parameters along which
the whole plant's run goes far astray.
"""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from epa_rt.gap.likelihood.as_one import LINK
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.subject import Values

ROUNDS = 2  # more change nothing: free run has been fitted before


class Together:
    """The links of a problem and the one of the whole plant, as far as a fit asks for them."""

    def __init__(self, parts: Problem, whole: Problem) -> None:
        self._parts, self._whole = parts, whole
        self.links, self.blocks = parts.links + whole.links, max(parts.blocks, whole.blocks)
        self.nominal, self.knobs, self.effects = parts.nominal, parts.knobs, parts.effects
        self.edges = {
            link: np.pad(edges, (0, self.blocks + 1 - len(edges)), mode="edge")
            for link, edges in {**parts.edges, **whole.edges}.items()
        }

    def _of(self, link: str) -> Problem:
        return self._whole if link == LINK else self._parts

    def touched(self, keys: Iterable[str]) -> tuple[str, ...]:
        return self._parts.touched(keys) + self._whole.links

    def residual(self, values: Values, link: str) -> np.ndarray:
        return self._of(link).residual(values, link)

    def derivative(self, values: Values, key: str, link: str, here: np.ndarray) -> np.ndarray:
        return self._of(link).derivative(values, key, link, here)

    def samples(self, link: str) -> int:
        return self._of(link).samples(link)

    def spread(self, key: str) -> float:
        return self._parts.spread(key)

    def each(self, function: Callable, items: Sequence) -> list:
        return self._parts.each(function, items)
