"""Columns of a recording on a full grid, and the zero-phase filter that every residual passes."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from epa_rt.gap.finding import stretches
from epa_rt.gap.likelihood.colour import LOWPASS_ORDER
from epa_rt.gap.recording import Recording, Span


@dataclass
class Signals:
    """``columns``: (N,) each by role, holes bridged; ``valid``: by role or link where the numbers
    are measured.

    ``stride`` samples of the recording make one of the residual.
    """

    name: str
    rate_hz: float  # of the recording
    lowpass_hz: float
    stride: int
    columns: dict[str, np.ndarray]
    valid: dict[str, np.ndarray]
    spans: tuple[Span, ...] = ()

    @property
    def samples(self) -> int:
        """N, rows of the full grid."""
        return len(next(iter(self.columns.values())))

    def lowpass(self, values: np.ndarray) -> np.ndarray:
        """(N,) of the recording's rate and cut-off, as ``lowpass``; ValueError where that raises
        it.
        """
        return lowpass(values, self.rate_hz, self.lowpass_hz)

    def slope(self, values: np.ndarray) -> np.ndarray:
        """Central difference per second, (N,)."""
        return slope(values, self.rate_hz, filtered=False)

    def settled(self, valid: np.ndarray, periods: float) -> np.ndarray:
        """Where a filtered signal is free of holes and of the recording's ends, (N,) bool: so many
        cut-off periods away.
        """
        if self.lowpass_hz >= 0.5 * self.rate_hz:
            return valid.copy()
        reach = int(np.ceil(periods / self.lowpass_hz * self.rate_hz))
        bad = np.concatenate([[1.0], np.where(valid, 0.0, 1.0), [1.0]])
        near = (
            np.convolve(bad, np.ones(2 * reach + 1))[reach : reach + len(bad)] > 0.5
        )  # "same" is as long as the window where that is longer
        return ~near[1:-1]


BRIDGED = (
    0.1  # of a cut-off period: a shorter hole, bridged by a line, leaves nothing below the cut-off
)


def on_grid(
    recording: Recording, roles: dict[str, str], rate_hz: float, lowpass_hz: float
) -> Signals:
    """A recording's columns by role, a sample for every cycle; a bridged hole that is far shorter
    than the low-pass counts as measured.

    Raises KeyError with the columns that are not there.
    """
    missing = sorted(name for name in roles.values() if name not in recording.columns)
    if missing:
        raise KeyError(
            f"{recording.name}: found no column {', '.join(missing)}, expected what the rig file"
            " names under channels"
        )
    rate_in = 1.0 / recording.period_s
    index = np.asarray(recording.cycle - recording.cycle[0], dtype=np.int64)
    samples = int(index[-1]) + 1
    columns, valid = {}, {}
    for role, name in roles.items():
        full = np.full(samples, np.nan)
        full[index] = recording.columns[name]
        good = np.isfinite(full)
        places = np.flatnonzero(good)
        columns[role] = (
            np.interp(np.arange(samples), places, full[places])
            if len(places)
            else np.zeros(samples)
        )
        valid[role] = _bridged(good, int(BRIDGED * rate_in / lowpass_hz))
    spans = tuple(
        Span(s.name, int(index[s.start]), int(index[min(s.stop, len(index)) - 1]) + 1, s.trial)
        for s in recording.spans
        if s.stop > s.start
    )
    return Signals(
        recording.name, rate_in, lowpass_hz, stride(rate_in, rate_hz), columns, valid, spans
    )


def slope(values: np.ndarray, rate_hz: float, filtered: bool) -> np.ndarray:
    """(N,) per second: of fourth order where a filter has left nothing above a quarter of the rate,
    else the central difference, which makes less of noise there.
    """
    found: np.ndarray = np.gradient(values)
    if filtered:
        found[2:-2] = (values[:-4] - 8.0 * values[1:-3] + 8.0 * values[3:-1] - values[4:]) / 12.0
    return found * rate_hz


def slope_as_read(values: np.ndarray, rate_hz: float) -> np.ndarray:
    """(N,) per second of what no filter has passed, by central differences of sixth order: for what
    a low-pass follows, which takes the noise that they make.
    """
    found: np.ndarray = np.gradient(values)
    reach, taps = 3, (45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0)
    found[reach:-reach] = sum(
        tap * (values[reach + k : len(values) - reach + k] - values[reach - k : -reach - k])
        for k, tap in enumerate(taps, 1)
    )
    return found * rate_hz


def stride(recorded_hz: float, rate_hz: float) -> int:
    """How many samples of a recording make one of its residuals."""
    return max(1, round(recorded_hz / rate_hz))


def _bridged(good: np.ndarray, most: int) -> np.ndarray:
    """``good`` with its holes of ``most`` samples at most closed, those at the ends not."""
    found = good.copy()
    for start, stop in stretches(~good):
        if stop - start <= most and start > 0 and stop < len(good):
            found[start:stop] = True
    return found


def lowpass(values: np.ndarray, rate_hz: float, lowpass_hz: float) -> np.ndarray:
    """(N,) zero-phase Butterworth; unchanged where the cut-off is at or above half the rate. Raises
    ValueError where it filters less than 16 rows.
    """
    if lowpass_hz >= 0.5 * rate_hz:
        return np.array(values, dtype=float)
    return _forth_and_back(*_sections(lowpass_hz / (0.5 * rate_hz)), values)


@cache
def _sections(share: float) -> tuple[np.ndarray, np.ndarray]:
    """Second-order sections of the filter whose cut-off is that share of half the rate, and their
    state after a constant of one.
    """
    from scipy import signal

    sections = signal.butter(LOWPASS_ORDER, share, output="sos")
    return sections, signal.sosfilt_zi(sections)


def _forth_and_back(sections: np.ndarray, steady: np.ndarray, values: np.ndarray) -> np.ndarray:
    """As scipy's ``sosfiltfilt``, to the bit, with the steady state that is known already."""
    from epa_rt.gap.rig.foreign.zero_phase import forth_and_back

    edge = 3 * (2 * len(sections) + 1)  # no section of a low-pass lacks a coefficient
    if len(values) <= edge:
        raise ValueError(f"found {len(values)} rows, expected more than {edge} to filter")
    return forth_and_back(sections, steady, np.ascontiguousarray(values, dtype=float), edge)


def shifted(values: np.ndarray, samples: float) -> np.ndarray:
    """``values`` delayed by a number of samples, whole or not (negative: advanced), cubic between
    them, ends held.
    """
    count, whole = len(values), int(np.floor(samples))
    part = samples - whole
    begin = min(max(whole, -count - 2), count + 2)  # beyond its ends all is held alike
    behind, ahead = max(begin + 2, 0), max(1 - begin, 0)
    held = np.concatenate([np.full(behind, values[0]), values, np.full(ahead, values[-1])])
    first = behind - begin - 2
    if part == 0.0:
        return held[first + 2 : first + 2 + count]
    # by Lagrange, of the samples from one ahead to two behind
    taps = np.array(
        [
            -part * (1 - part) * (2 - part) / 6,
            (1 + part) * (1 - part) * (2 - part) / 2,
            part * (1 + part) * (2 - part) / 2,
            -part * (1 + part) * (1 - part) / 6,
        ]
    )
    return np.convolve(held[first : first + 3 + count], taps, "valid")


def lagged(values: np.ndarray, lag_samples: float) -> np.ndarray:
    """(N,) ``values`` through a lag of first order, exactly for straight lines from row to row;
    settled on the first one before.
    """
    from scipy import signal

    kept = float(np.exp(-1.0 / lag_samples))
    new = 1.0 - lag_samples * (1.0 - kept)  # of the row's own value, the rest of the one before
    taps = [new, 1.0 - kept - new]
    found: np.ndarray = signal.lfilter(taps, [1.0, -kept], values, zi=[values[0] * (1.0 - new)])[0]
    return found
