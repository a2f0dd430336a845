"""What the noise of readings leaves of a model, beyond the noise of its output: a model that takes
its motion from readings foresees a reversal as early or late as they say (errors in variables).

The same motion is read again without noise and with it. What a model foresees from the two differs
by what the noise of the readings does to this model, at these values.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from epa_rt.gap.likelihood.floor import weight
from epa_rt.gap.likelihood.intervals import TWO_SIDED_95
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Values

READ_SEEDS = tuple(range(8001, 8007))  # of readings that made neither a floor nor a twin


class PerSample(NamedTuple):
    """Chi-square per sample that noise leaves on average, and how far off that it is at random in
    one of twenty cases. ``filtered``: how much less it leaves than of the plant without effects,
    whatever the rig has: no explanation of anything.
    """

    mean: float
    off: float
    filtered: float = 0.0


WHITE = PerSample(1.0, 0.0)  # of the output's noise alone


class ReadingNoise:
    """Of a problem's recordings; nothing is known of it where a rig cannot read a motion again.
    ``values``: of the plant without effects.
    """

    def __init__(self, problem: Problem, values: Values) -> None:
        self._problem = problem
        made = problem.each(self._read, problem.recordings)
        self._read_again = [] if None in made else [one for one in made if one]
        links = problem.links if self._read_again else ()
        self._bare = {link: float(self._each(link, values).mean()) for link in links}

    def _read(self, recording: Recording) -> tuple[object, list[object]] | None:
        """What is prepared of the motion without noise, and with it, by seed."""
        subject = self._problem.subject
        quiet, *noisy = (subject.read_again(recording, {}, seed) for seed in (None, *READ_SEEDS))
        if quiet is None or any(one is None for one in noisy):
            return None
        return subject.prepare(quiet), [subject.prepare(one) for one in noisy]

    def per_sample(self, values: Values) -> Mapping[str, PerSample]:
        """By link what noise leaves of a model at these values: no less than the output's own."""
        links = self._problem.links
        if not self._read_again:
            return dict.fromkeys(links, WHITE)
        found = self._problem.each(lambda link: self._of(link, values), links)
        return dict(zip(links, found, strict=True))

    def _of(self, link: str, values: Values) -> PerSample:
        each = self._each(link, values)
        mean, bare = float(each.mean()), self._bare[link]
        filtered = max(bare - mean, 0.0) if np.isfinite((bare, mean)).all() else 0.0
        if not np.isfinite(each).all() or mean <= 1.0:
            return WHITE._replace(filtered=filtered)
        return PerSample(mean, TWO_SIDED_95 * float(each.std(ddof=1)), filtered)

    def _each(self, link: str, values: Values) -> np.ndarray:
        """Chi-square per sample of the motion read again, seed by seed."""
        subject, floor = self._problem.subject, self._problem.floors[link]
        squares, samples = np.zeros(len(READ_SEEDS)), np.zeros(len(READ_SEEDS))
        with np.errstate(all="ignore"):  # a plant that runs away
            for quiet, noisy in self._read_again:
                foreseen, counts = (
                    subject.residual(quiet, values, link),
                    weight(subject, quiet, floor),
                )
                for i, one in enumerate(noisy):
                    white = floor.whiten(counts * (subject.residual(one, values, link) - foreseen))
                    squares[i] += np.nansum(white**2)
                    samples[i] += np.isfinite(white).sum()
            found: np.ndarray = squares / samples
        return found
