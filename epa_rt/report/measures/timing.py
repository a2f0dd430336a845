"""Lateness of the cycles."""

from dataclasses import dataclass

import numpy as np

from epa_rt.logs.layout import FLAG_OVERRUN
from epa_rt.report.run import Run

SHARES = (("p50", 0.5), ("p99", 0.99), ("p99.9", 0.999), ("max", 1.0))


@dataclass(frozen=True)
class Timing:
    """Quantiles in ns by name, the smallest value that so great a share does not exceed; counts per
    bin in us.
    """

    overruns: int
    lateness_ns: dict[str, int]
    busy_ns: dict[str, int]
    edges_us: np.ndarray
    lateness_counts: np.ndarray
    busy_counts: np.ndarray

    @property
    def recorded(self) -> bool:
        """Whether any cycle had a lateness or a busy time."""
        return any(self.lateness_ns.values()) or any(self.busy_ns.values())


def timing_of(run: Run) -> Timing:
    """Over all samples of a run."""
    lateness, busy = run.cycle["lateness_ns"], run.cycle["busy_ns"]
    edges_us = np.concatenate([[0.0], 2.0 ** np.arange(0, 17)])
    counts = [
        np.histogram(np.clip(values / 1e3, 0.0, edges_us[-1]), edges_us)[0]
        for values in (lateness, busy)
    ]
    overruns = int(np.count_nonzero(run.cycle["flags"] & FLAG_OVERRUN))
    return Timing(overruns, _quantiles(lateness), _quantiles(busy), edges_us, *counts)


def _quantiles(values_ns: np.ndarray) -> dict[str, int]:
    if not len(values_ns):
        return {name: 0 for name, _ in SHARES}
    ranks = [max(int(np.ceil(share * len(values_ns))), 1) - 1 for _, share in SHARES]
    ordered = np.partition(values_ns, ranks)
    return {name: int(ordered[rank]) for (name, _), rank in zip(SHARES, ranks, strict=True)}
