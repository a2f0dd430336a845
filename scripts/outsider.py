"""What an outsider's simulator gives of one machine, and what all of them draw and write alike."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.recording import Recording, Span

Strength = Callable[[str, float], float]  # effect and what one would meet to how strong it is


@dataclass(frozen=True)
class Outsider:
    """``has``: effects that its plant file lacks. ``bits``: of its encoder or gauge. ``plant``,
    ``rig``: texts of its files; the rig file names the other as plant.yaml.
    """

    has: tuple[str, ...]
    bits: int
    logs: Sequence[Recording]
    plant: str
    rig: str


def strengths(
    random: np.random.Generator,
    effects: Collection[str],
    count: int,
    instead: Mapping[str, str] | None = None,
) -> tuple[tuple[str, ...], Strength]:
    """``count`` of the effects, and the strength of each at 0.6 to 1.6 of what one would meet; 0 of
    the others. ``instead``: effect to one that it takes the place of.
    """
    has = {str(name) for name in random.choice(list(effects), count, replace=False)}
    has -= {other for name, other in (instead or {}).items() if name in has}
    size = dict(zip(effects, random.uniform(0.6, 1.6, len(effects)).tolist(), strict=True))
    return tuple(sorted(has)), lambda name, of_one: of_one * size[name] if name in has else 0.0


def sines(
    random: np.random.Generator, t: np.ndarray, parts: Sequence[tuple[float, float]]
) -> np.ndarray:
    """(N,) sum of sines at t, s, each of some Hz, a tenth off, and a size, from any phase."""
    total = np.zeros_like(t)
    for hz, size in parts:
        rate, begins = 2.0 * np.pi * hz * random.uniform(0.9, 1.1), random.uniform(0.0, 2.0 * np.pi)
        total += size * np.sin(rate * t + begins)
    return total


def one_trial(
    name: str, kind: str, period_s: float, columns: Mapping[str, np.ndarray]
) -> Recording:
    """A log that is one trial."""
    rows = len(next(iter(columns.values())))
    trial = (Span("trial", 0, rows, True),)
    return Recording(name, "", kind, "", "", period_s, np.arange(rows), columns, trial)
