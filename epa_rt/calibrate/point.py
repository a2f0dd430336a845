"""Points of a calibration: a reference beside what the converter read."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

BATCHES = 10  # a record is cut into so many: their means' scatter holds also for slow noise
# of the means of a record's halves, in their own uncertainties: noise does that once in 10^6
MOVING_SIGMAS = 5.0


class CalibrationError(Exception):
    """Points that make no calibration; one sentence."""


@dataclass(frozen=True)
class Point:
    """A reference in the signal's unit (gauge where the sensor reads gauge) and its standard
    uncertainty; the reading in the entry's native unit: mean, standard uncertainty of the mean,
    scatter of the samples, and by how much it moved between the halves of the record.
    """

    reference: float
    reference_u: float
    reading: float
    reading_u: float
    scatter: float = 0.0
    moved: float = 0.0
    where: str = ""  # for sentences: 'point 3', 'log.csv:7'


def reading_of(samples: np.ndarray, step: float) -> tuple[float, float, float, float]:
    """Mean, its standard uncertainty, scatter and movement of native samples, (n,).

    ``step``: the converter's resolution. Where the noise is smaller than half a step the mean keeps
    an error of the rounding, up to half a step, uniform (GUM F.2.2.1).
    """
    mean, scatter = float(samples.mean()), float(samples.std())
    batches = [float(part.mean()) for part in np.array_split(samples, min(BATCHES, len(samples)))]
    u = float(np.std(batches, ddof=1)) / math.sqrt(len(batches)) if len(batches) > 1 else step
    # noise of half a step and more averages the rounding out (Widrow)
    rounding = step / math.sqrt(12.0) if scatter < 0.5 * step else 0.0
    half = len(samples) // 2
    moved = float(samples[half:].mean() - samples[:half].mean()) if half else 0.0
    return mean, math.hypot(u, rounding), scatter, moved


def directions(references: Sequence[float]) -> tuple[str, ...]:
    """'up' or 'down' for each point: from where it was come to."""
    found: list[str] = []
    for before, now in zip(references, references[1:], strict=False):
        last = found[-1] if found else ""
        found.append("up" if now > before else "down" if now < before else last)
    first = next((word for word in found if word), "up")
    return tuple(word or first for word in [first, *found])
