"""Sinusoids of one frequency in noise of any colour, by several tapers on each window.

Thomson, Spectrum estimation and harmonic analysis, Proc. IEEE 70 (1982): the F-test of a harmonic
line. Fisher, Tests of significance in harmonic analysis, Proc. R. Soc. A 125 (1929): the g-test.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

_BANDWIDTH = 4.0  # of the tapers, in bins of a window: what they leave of motion far away is 1e-6
_TAPERS = 5  # of the 2 x _BANDWIDTH that there are: the last ones let motion leak in
_BESIDE = (-4, -3, -2, -1, 1, 2, 3, 4)  # full bandwidths off, where a line's noise is looked at
_PADDED = 4  # times a window's length at least, so that no line falls between two bins


@dataclass(frozen=True)
class Tones:
    """``phasors`` (M,): amplitude and phase at each window's first row, in the channel's unit.
    ``floor`` (M,): deviation of white noise as large as the channel's at that frequency.
    ``chances`` (M,): as of ``line_chances``.
    """

    phasors: np.ndarray
    floor: np.ndarray
    chances: np.ndarray


def half_bandwidth(rows: int) -> float:
    """Frequencies nearer than this are one to a window of so many rows; in cycles a row."""
    return _BANDWIDTH / rows


def line_chances(windows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(B,) frequencies in cycles a row, and (M, B) -ln of the chance that noise alone looks as much
    like a sinusoid, of windows (M, n).

    Steps from row to row are looked at, in which motion is as small as noise.
    """
    n = windows.shape[1] - 1
    tapers, own, squares = _tapers(n)
    size = 1 << (_PADDED * n - 1).bit_length()
    frequencies = np.arange(size // 2 + 1) / size
    kept = (frequencies > 2.0 * half_bandwidth(n)) & (frequencies < 0.5 - half_bandwidth(n))
    chances = np.empty((len(windows), int(kept.sum())))
    for i, window in enumerate(windows):
        spectra = np.fft.rfft(np.diff(window) * tapers, size)[:, kept]
        line, rest = _line_and_rest(spectra, own, squares)
        chances[i] = _chance(line, rest)
    return frequencies[kept], chances


def tones(windows: np.ndarray, frequency: float) -> Tones:
    """What windows (M, n) hold at one frequency, in cycles a row."""
    n = windows.shape[1] - 1
    tapers, own, squares = _tapers(n)
    turns = np.exp(-2j * np.pi * frequency * np.arange(n))
    spectra = np.einsum("mn,kn->mk", np.diff(windows), tapers * turns).T[..., None]
    gain = np.exp(2j * np.pi * frequency) - 1.0  # of a step from row to row
    line, rest = _line_and_rest(spectra, own, squares)
    return Tones(
        2.0 * np.einsum("k,km->m", own, spectra[..., 0]) / squares / gain,
        np.sqrt(rest[:, 0] / (_TAPERS - 1)) / abs(gain),
        _chance(line, rest)[:, 0],
    )


def noise_of_phasor(rows: int) -> float:
    """Deviation of a phasor (either part) of a window of so many rows in white noise of 1."""
    return float(np.sqrt(2.0 / _tapers(rows - 1)[2]))


def noise_beside(windows: np.ndarray, frequency: float) -> float:
    """Deviation of white noise as large as that of windows (M, n) about a frequency (cycles a row):
    the median of bands beside it, so that hardly any chance of few windows is left in it.
    """
    apart = 2.0 * half_bandwidth(windows.shape[1])
    bands = [frequency, *(frequency + times * apart for times in _BESIDE)]
    powers = [
        np.mean(tones(windows, band).floor ** 2) for band in bands if apart < band < 0.5 - apart
    ]
    return float(np.sqrt(np.median(powers))) if powers else 0.0


def error_of_steps(amplitude: float, step: float, noise: float) -> float:
    """Deviation of a line's amplitude by a converter's steps, where so little ``noise`` (deviation,
    with the steps' own) dithers them. Where between two steps the line lies is not known.

    Widrow and Kollar, Quantization Noise (2008): the steps add sines of the reading. Each has the
    line's frequency in it by the Bessel function J1, and dies away with the noise.
    """
    if not (step > 0.0 and amplitude > 0.0):
        return 0.0
    k = np.arange(1, 20)
    dither = max(noise**2 - step**2 / 12.0, 0.0) / step**2
    # J1^2 is 1 / (pi x) in the mean, the cosine of an unknown place one half
    bessel = 1.0 / (2.0 * np.pi**2 * k * amplitude / step)
    squares = 0.5 * (2.0 * step / (np.pi * k)) ** 2 * bessel
    return float(np.sqrt(np.sum(squares * np.exp(-((2.0 * np.pi * k) ** 2) * dither))))


def running(phasors: np.ndarray, starts: np.ndarray, reach: float) -> tuple[float, float]:
    """How far from the frequency of (m,) phasors theirs is that runs on from window to window
    (cycles a row, ``reach`` at most), and the share of their power that runs on.
    """
    apart = np.ptp(starts) + reach**-1.0
    off = np.linspace(-reach, reach, 2 * int(np.ceil(8.0 * reach * apart)) + 1)
    turned = np.einsum("fm,m->f", np.exp(-2j * np.pi * np.outer(off, starts)), phasors)
    power, best = np.abs(turned) ** 2, int(np.argmax(np.abs(turned)))
    most = float(off[best])
    if 0 < best < len(off) - 1:
        left, top, right = power[best - 1 : best + 2]
        bend = left - 2.0 * top + right
        most += float(0.5 * (left - right) / bend) * (off[1] - off[0]) if bend < 0.0 else 0.0
    whole = len(phasors) * float(np.sum(np.abs(phasors) ** 2))
    kept = abs(complex(np.sum(np.exp(-2j * np.pi * most * starts) * phasors))) ** 2
    return most, kept / whole if whole > 0.0 else 0.0


def chance_of_running(share: float, count: int) -> float:
    """-ln of the chance that of ``count`` phasors of noise such a share runs on at any frequency:
    Fisher's g-test, frequencies between bins counted four times.
    """
    return max(-np.log(4.0 * count) - (count - 1) * np.log(max(1.0 - share, 1e-15)), 0.0)


def chance_of_going_along(a: np.ndarray, b: np.ndarray) -> float:
    """-ln of the chance that (m,) phasors of two channels without anything in common are as
    coherent.
    """
    size = float(np.sum(np.abs(a) ** 2) * np.sum(np.abs(b) ** 2))
    share = float(abs(np.vdot(a, b)) ** 2) / size if size > 0.0 else 0.0
    return -(len(a) - 1) * float(np.log(max(1.0 - share, 1e-15)))


def together(chances: np.ndarray) -> np.ndarray:
    """-ln of the chance of several independent ones, (M, ...) to (...): Fisher's method."""
    from scipy.special import gammaincc

    chances = np.asarray(chances, float)
    joint = gammaincc(len(chances), chances.sum(axis=0))
    return -np.log(np.maximum(joint, np.finfo(float).tiny))


@cache
def _tapers(rows: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Discrete prolate spheroidal sequences (K, n), their sums (K,), and the sums' squares' sum."""
    from scipy.signal.windows import dpss

    tapers = dpss(rows, _BANDWIDTH, _TAPERS)
    own = tapers.sum(axis=1)
    own[1::2] = 0.0  # odd sequences add up to nothing but rounding
    return tapers, own, float(own @ own)


def _line_and_rest(
    spectra: np.ndarray, own: np.ndarray, squares: float
) -> tuple[np.ndarray, np.ndarray]:
    """Power of the line and of what is left, over their degrees of freedom but for a factor that
    both have: (K, M, 1) or (K, B) spectra.
    """
    line = np.einsum("k,k...->...", own, spectra) / squares
    left = spectra - own.reshape(-1, *[1] * (spectra.ndim - 1)) * line
    return np.abs(line) ** 2 * squares, np.sum(np.abs(left) ** 2, axis=0)


def _chance(line: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """-ln of the chance of the F-test, with 2 and 2 (K - 1) degrees of freedom."""
    return (_TAPERS - 1) * np.log1p(line / np.maximum(rest, np.finfo(float).tiny))
