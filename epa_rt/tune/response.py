"""Frequency response of a plant inside its loop, from the samples of one or more trials.

Excitation in closed loop biases the direct estimate, for the input then holds the output's noise.
Here the reference is the instrument: the plant is the response of the measured output to the
reference, divided by that of the sent command to the reference (joint input-output method; Ljung,
System Identification, 2nd ed. 1999, 13.5; Pintelon and Schoukens, System Identification, 2nd ed.
2012, 2.6).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

BANDS_PER_OCTAVE = 16  # no more than one bin of the segments: a resonance must not be smeared
SEGMENTS_S = (16.0, 8.0, 4.0, 2.0, 1.0)  # the longer for the lower octaves
PERIODS_LEAST = 2.0  # of a frequency in a segment; with fewer the window hides it
PERIODS_FULL = 8.0  # of a frequency in a segment: a band of an eighth of an octave has its own bin
LEAST_POWER = 1e-4  # of a trial's strongest line, as speed: below it only leakage is seen
LEAKED = 0.3  # of a neighbour's power: no more than what leaks from it
LEAST_COHERENCE = 0.8  # below it, phase is known to no better than some 10 deg (Bendat, Piersol)
SETTLE_S = 2.0  # after the fade, for what the plant still rings of it
SAME = 1e-6  # of a reference's height: rounding, not another period
CONFIDENCE = -np.log(0.05)  # |error|^2 over variance that 95 % of complex normal errors keep


@dataclass(frozen=True)
class Excited:
    """Samples of one trial, (N,) each in SI: reference, sent command, measured output."""

    reference: np.ndarray
    command: np.ndarray
    output: np.ndarray


@dataclass(frozen=True)
class Response:
    """Plant over frequency, (n,) each: Hz, complex output per command, variance of that, coherence
    of reference and output (0 to 1), and how much of the reference stood there (unit^2).
    """

    frequency_hz: np.ndarray
    plant: np.ndarray
    variance: np.ndarray
    coherence: np.ndarray
    reference_power: np.ndarray

    @property
    def radius(self) -> np.ndarray:
        """Radius (n,) of the disc that holds the plant with 95 %."""
        radius: np.ndarray = np.sqrt(CONFIDENCE * self.variance)
        return radius

    @property
    def sound(self) -> np.ndarray:
        """Where the coherence carries a statement, bool (n,)."""
        return self.coherence >= LEAST_COHERENCE

    def only(self, keep: np.ndarray) -> "Response":
        """The frequencies that ``keep`` (n,) names."""
        return Response(
            self.frequency_hz[keep],
            self.plant[keep],
            self.variance[keep],
            self.coherence[keep],
            self.reference_power[keep],
        )


def response_of(trials: Sequence[Excited], period_s: float, highest_hz: float) -> Response:
    """The plant's response up to ``highest_hz``, in bands of 1 / BANDS_PER_OCTAVE octave.

    A trial whose reference repeats is cut into whole periods, without a window, from SETTLE_S after
    its fade. Any other goes through Hann windows that overlap by half. Each octave has segments of
    its own length. Bands in which nothing was excited are left out; there may be none.
    """
    rows: list[tuple[float, complex, float, float, float]] = []
    longest_s = max((len(t.output) for t in trials), default=0) * period_s
    first = next((s for s in SEGMENTS_S if s <= longest_s), None)
    for segment_s in SEGMENTS_S:
        if first is None or segment_s > first:
            continue
        low = PERIODS_LEAST / segment_s if segment_s == first else PERIODS_FULL / segment_s
        high = 2.0 * PERIODS_FULL / segment_s
        if segment_s == SEGMENTS_S[-1]:
            high = highest_hz
        entries = [_entries(trial, segment_s, period_s) for trial in trials]
        rows += _octave([e for e in entries if e is not None], low, min(high, highest_hz))
    columns = np.array(rows, dtype=complex).reshape(-1, 5).T
    return Response(columns[0].real, columns[1], *(c.real for c in columns[2:]))


def widened(
    found: Response, trials: Sequence[Excited], period_s: float, highest_hz: float
) -> Response:
    """The response with a radius that holds what each trial says on its own: trials of another size
    meet another plant where it rubs or plays.
    """
    variance, logs = found.variance.copy(), np.log2(found.frequency_hz)
    for trial in trials:
        own = response_of([trial], period_s, highest_hz)
        own = own.only(own.sound)
        for hertz, plant in zip(own.frequency_hz, own.plant, strict=True):
            at = int(np.argmin(np.abs(logs - np.log2(hertz))))
            if abs(logs[at] - np.log2(hertz)) < 1.0 / BANDS_PER_OCTAVE:
                away = abs(plant - found.plant[at]) ** 2
                variance[at] = max(variance[at], float(away / CONFIDENCE))
    return replace(found, variance=variance)


@dataclass(frozen=True)
class _Entries:
    """Spectra of one trial's segments, (segments, bins) each, at ``frequency_hz`` (bins,).
    ``independent``: how many of the segments count.
    """

    frequency_hz: np.ndarray
    r: np.ndarray
    u: np.ndarray
    y: np.ndarray
    independent: float


def _entries(trial: Excited, segment_s: float, period_s: float) -> _Entries | None:
    """Spectra in segments of this length, or of the next longer one in which the reference repeats;
    None where the trial is shorter.
    """
    for longer_s in reversed([s for s in SEGMENTS_S if s >= segment_s]):
        count = round(longer_s / period_s)
        span = _repeats(trial.reference, count, round(SETTLE_S / period_s))
        if span is not None:
            starts = range(span[0], span[1] - count + 1, count)
            return _spectra(trial, starts, np.ones(count), period_s, 1.0)
    count = round(segment_s / period_s)
    if len(trial.output) < count:
        return None
    starts = range(0, len(trial.output) - count + 1, max(count // 2, 1))
    # neighbours overlap by half, which leaves 0.53 of them independent under a Hann window
    # (Welch 1967)
    return _spectra(trial, starts, np.hanning(count + 1)[:-1], period_s, 0.53)


def _repeats(reference: np.ndarray, count: int, settle: int) -> tuple[int, int] | None:
    """First and last sample (not included) between which the reference repeats after ``count``
    samples, without its fades; None where it does not, or not for a whole period.
    """
    if len(reference) <= count:
        return None
    same = np.abs(reference[count:] - reference[:-count]) < SAME * np.ptp(reference)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], same, [False]]).astype(int)))
    if not len(edges):
        return None
    runs = edges.reshape(-1, 2)  # of samples that all repeat; by chance one does within a fade
    begin, end = runs[np.argmax(runs[:, 1] - runs[:, 0])].tolist()
    first, stop = begin + settle, end + count
    return (first, stop) if stop - first >= count else None


def _spectra(
    trial: Excited, starts: range, window: np.ndarray, period_s: float, independent: float
) -> _Entries:
    spectra = []
    for values in (trial.reference, trial.command, trial.output):
        pieces = np.stack([values[i : i + len(window)] for i in starts])
        pieces = pieces - pieces.mean(axis=1, keepdims=True)
        spectra.append(np.fft.rfft(pieces * window) / window.sum() * 2.0)
    frequency = np.fft.rfftfreq(len(window), period_s)
    power = (np.abs(spectra[0]) ** 2).sum(axis=0)
    own = _own_power(power) & _is_excited(power, frequency)
    r, u, y = (spectrum[:, own] for spectrum in spectra)
    return _Entries(frequency[own], r, u, y, independent)


def _is_excited(power: np.ndarray, frequency_hz: np.ndarray) -> np.ndarray:
    """Bins (n,) that the trial excited, and not only what leaks from others: its neighbour in the
    same loop may be a hundred times as large.
    """
    speed = power * frequency_hz**2  # a position's power falls as 1/f^2
    excited: np.ndarray = speed > LEAST_POWER * np.max(speed)
    return excited


def _own_power(power: np.ndarray) -> np.ndarray:
    """Bins (n,) that hold a line of their own: a Hann window puts a quarter of a line's power into
    each neighbour, which then says nothing of its own frequency.
    """
    padded = np.pad(power, 1)
    own: np.ndarray = power > LEAKED * np.maximum(padded[:-2], padded[2:])
    return own


def _octave(
    entries: Sequence[_Entries], low_hz: float, high_hz: float
) -> list[tuple[float, complex, float, float, float]]:
    """Rows of Response: bands between ``low_hz`` and ``high_hz``."""
    if not entries or not low_hz < high_hz:
        return []
    edges = low_hz * 2.0 ** (
        np.arange(int(np.log2(high_hz / low_hz) * BANDS_PER_OCTAVE + 1e-9) + 1) / BANDS_PER_OCTAVE
    )
    rows = []
    for bottom, top in zip(edges, [*edges[1:], high_hz], strict=True):
        parts = []
        for e in entries:
            inside = (e.frequency_hz >= bottom - 1e-9) & (e.frequency_hz < top - 1e-9)
            if inside.any():
                frequency = np.broadcast_to(e.frequency_hz[inside], e.r[:, inside].shape)
                count = np.full(frequency.size, e.independent)
                parts.append(
                    [
                        v.ravel()
                        for v in (frequency, count, e.r[:, inside], e.u[:, inside], e.y[:, inside])
                    ]
                )
        if parts:
            row = _band(*(np.concatenate(column) for column in zip(*parts, strict=True)))
            rows += [row] if row else []
    return rows


def _band(
    frequency: np.ndarray, independent: np.ndarray, r: np.ndarray, u: np.ndarray, y: np.ndarray
) -> tuple[float, complex, float, float, float] | None:
    """One band: mean frequency by the reference's power, plant, its variance, coherence, power."""
    power = np.abs(r) ** 2
    total = power.sum()
    u_r, y_r = (u * r.conj()).sum(), (y * r.conj()).sum()
    if not (total > 0.0 and abs(u_r) > 0.0 and np.isfinite(u_r) and np.isfinite(y_r)):
        return None
    plant = y_r / u_r
    # segments count by the power that they bring
    share = (power * independent).sum() / total
    effective = max(total**2 / (power**2).sum() * share, 1.0)
    rest = (np.abs(y - plant * u) ** 2 * power).sum() * effective / max(effective - 1.0, 0.5)
    variance = rest / abs(u_r) ** 2 / share
    coherence = abs(y_r) ** 2 / (total * (np.abs(y) ** 2).sum())
    centre = float((frequency * power).sum() / total)
    return centre, complex(plant), float(variance), float(coherence), float(power.mean())
