"""A finding of hygiene, and what all checks look at: channels, rows that count, a regular grid to
compare on.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.recording import Recording

_MOVES = 1e-3  # of a target, in its SI unit: less is no motion that is asked for


@dataclass(frozen=True)
class Sinusoid:
    """``cosine`` cos(2 pi f k) + ``sine`` sin(2 pi f k) at bus cycle k of a log, from ``start`` to
    ``stop``, both counted from its first; f: ``frequency`` in cycles a row. In the channel's unit.
    """

    start: int
    stop: int
    frequency: float
    cosine: float
    sine: float

    def at(self, cycles: np.ndarray) -> np.ndarray:
        """(N,) at cycles (N,) counted from the log's first; 0 outside."""
        turns = 2.0 * np.pi * self.frequency * cycles
        inside = (self.start <= cycles) & (cycles < self.stop)
        return np.where(inside, self.cosine * np.cos(turns) + self.sine * np.sin(turns), 0.0)


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong: ``refuse`` the diagnosis, ``exclude`` the ``rows`` (start, stop) or
    the ``sinusoids`` of a channel, or a ``note``.

    ``kind``: 'lost cycles', 'units', ... ``channel`` '' where it is about the log as a whole.
    ``says``: the sentence.
    """

    severity: Literal["refuse", "exclude", "note"]
    kind: str
    log: str
    channel: str
    says: str
    rows: tuple[tuple[int, int], ...] = ()
    sinusoids: tuple[Sinusoid, ...] = ()


def measured_names(recording: Recording) -> list[str]:
    """Channels that a sensor makes: no commands, no references, no words."""
    return [
        name
        for name in recording.columns
        if not name.startswith(("cmd_", "ref_", "est_")) and not name.endswith("_raw")
    ]


def judged_rows(recording: Recording, trials_only: bool = False) -> np.ndarray:
    """(N,) bool: rows within a phase (or a trial); all where the recording has none."""
    spans = [span for span in recording.spans if span.trial] if trials_only else recording.spans
    if not spans:
        return np.ones(recording.samples, bool)
    rows = np.zeros(recording.samples, bool)
    for span in spans:
        rows[span.start : span.stop] = True
    return rows


def target_moves(recording: Recording, rows: np.ndarray | None = None) -> bool:
    """Whether the motor is told to move, on all rows or on those of a mask (N,)."""
    told = (
        values if rows is None else values[rows]
        for name, values in recording.columns.items()
        if name.startswith(("cmd_motor", "ref_motor"))
    )
    known = (values[np.isfinite(values)] for values in told)
    return any(len(values) and np.ptp(values) > _MOVES for values in known)


def seconds(recording: Recording, row: int) -> float:
    """When a row was, s from the first one on, lost cycles counted. Raises IndexError past the
    last.
    """
    return float(recording.cycle[row] - recording.cycle[0]) * recording.period_s


def regular(recording: Recording, name: str) -> np.ndarray:
    """A column without holes and NaN, bridged by straight lines: to compare channels on, never to
    diagnose from.
    """
    values, cycle = recording.columns[name], recording.cycle
    known = np.isfinite(values)
    grid = np.arange(cycle[0], cycle[-1] + 1)
    if not known.any():
        return np.zeros(len(grid))
    return np.interp(grid, cycle[known], values[known])


def regular_rows(recording: Recording, rows: np.ndarray) -> np.ndarray:
    """A mask of rows on the grid of ``regular``; False in holes."""
    mask = np.zeros(int(recording.cycle[-1] - recording.cycle[0]) + 1, bool)
    mask[(recording.cycle - recording.cycle[0])[rows]] = True
    return mask


def stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    """Where a mask is True: (start, stop) each."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def smooth(values: np.ndarray, samples: int) -> np.ndarray:
    """Two passes of a centred mean over an odd number of samples: no delay."""
    from scipy.ndimage import uniform_filter1d

    samples = max(samples | 1, 1)
    return uniform_filter1d(
        uniform_filter1d(values, samples, mode="nearest"), samples, mode="nearest"
    )


def position_pairs(recording: Recording, rig: Rig | None) -> list[tuple[str, str]]:
    """(position, speed) channels that belong together: by the rig's roles, else by name."""
    if rig is not None:
        pairs = [(rig.motor.position, rig.motor.speed)] if rig.motor.speed else []
    else:
        names = measured_names(recording)
        swaps = (
            ("_position_m", "_speed_m_s"),
            ("_position_rad", "_speed_rad_s"),
            ("_angle_rad", "_speed_rad_s"),
        )
        pairs = [
            (n, n.removesuffix(a) + b)
            for n in names
            for a, b in swaps
            if n.endswith(a) and n.removesuffix(a) + b in names
        ]
    return [(x, v) for x, v in pairs if x in recording.columns and v in recording.columns]


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Of two columns (N,), about their means; 0 where one of them stands still."""
    a, b = a - a.mean(), b - b.mean()
    size = np.sqrt((a @ a) * (b @ b))
    return float(a @ b / size) if size > 0.0 else 0.0
