"""A repeat in the plant's place: what the plant leaves over on one recording counts as known on the
next.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from epa_rt.gap.recording import Recording, Span

BINS = 60  # places along the way
FEWEST = 4  # samples that make a place known


@dataclass(frozen=True)
class Baseline:
    """Runs of one experiment. ``by``: 'time' where they run in step, 'stroke' where they pass the
    same places in the same directions.
    """

    runs: tuple[Recording, ...]
    by: Literal["time", "stroke"] = "time"

    def taken_off(self, plain, ready, link: str) -> np.ndarray:
        """(n,) mean of what ``plain`` (the subject without a baseline) leaves of the runs, NaN
        where they say nothing.
        """
        return np.mean(
            [self._seen_from(plain, ready, plain.prepare(run), link) for run in self.runs], axis=0
        )

    def apart(self, plain, link: str) -> np.ndarray | None:
        """What one more run may differ by from the mean of these, end to end with NaN between; None
        for a single run.
        """
        ready = [plain.prepare(run) for run in self.runs]
        grown = np.sqrt(0.5 * (1.0 + 1.0 / len(ready)))
        pairs = [
            grown
            * (
                plain.residual(ready[i], {}, link)
                - self._seen_from(plain, ready[i], ready[j], link)
            )
            for j in range(len(ready))
            for i in range(j)
        ]
        return (
            np.concatenate([part for pair in pairs for part in (pair, [np.nan])]) if pairs else None
        )

    def _seen_from(self, plain, ready, run, link: str) -> np.ndarray:
        """What is left of ``run``, at the samples of ``ready``."""
        left, count = plain.residual(run, {}, link), len(ready.judged[link])
        if self.by == "time":
            return np.concatenate([left[:count], np.full(max(0, count - len(left)), np.nan)])
        known, here = plain.features(run, link), plain.features(ready, link)
        return _by_stroke(
            known["position_m"], known["speed_m_s"], left, here["position_m"], here["speed_m_s"]
        )


def _by_stroke(
    place: np.ndarray, speed: np.ndarray, left: np.ndarray, at: np.ndarray, moving: np.ndarray
) -> np.ndarray:
    """Mean of ``left`` by place and direction, read at other places; between bins linear."""
    edges = np.linspace(*np.nanquantile(place, [0.002, 0.998]), BINS + 1)
    middles = 0.5 * (edges[1:] + edges[:-1])
    found = np.full(len(at), np.nan)
    slow = 0.3 * float(np.nanmedian(np.abs(speed)))
    for sign in (-1.0, 1.0):
        own = np.isfinite(left) & (sign * speed > slow)
        index = np.digitize(place[own], edges) - 1
        inside = (index >= 0) & (index < BINS)
        counts = np.bincount(index[inside], minlength=BINS)
        means = np.bincount(index[inside], left[own][inside], minlength=BINS) / np.maximum(
            counts, 1
        )
        means[counts < FEWEST] = np.nan
        known = np.isfinite(means)
        if known.sum() > 1:
            here = (sign * moving > slow) & (at >= middles[known][0]) & (at <= middles[known][-1])
            found[here] = np.interp(at[here], middles[known], means[known])
    return found


def cut(recording: Recording, start: int, stop: int, name: str) -> Recording:
    """Rows ``start`` to ``stop`` of a recording as one of its own: a lap, say. Trials that lie
    across an edge are shortened.
    """
    part = slice(start, stop)
    last = min(stop, recording.samples)
    spans = tuple(
        Span(s.name, max(s.start, start) - start, min(s.stop, last) - start, s.trial)
        for s in recording.spans
        if min(s.stop, last) > max(s.start, start)
    )
    return replace(
        recording,
        name=name,
        cycle=recording.cycle[part],
        columns={k: v[part] for k, v in recording.columns.items()},
        spans=spans,
        t_ns=None if recording.t_ns is None else recording.t_ns[part],
    )
