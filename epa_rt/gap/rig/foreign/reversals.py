"""What a log does not tell of a sliding part's motion, and what that leaves of a link.

Dry friction and acceleration jump where the part turns round, and the motion that says when has
been filtered, sampled and read with noise. A jump that is foreseen a little early or late leaves a
pulse in the residual. In a rest friction takes any force up to its own. Between two rows slopes may
be taken one way or another, and an output held or not. Rows count for less where that may be larger
than the noise: their variance is the noise's and that of what the log leaves open (errors in
variables).
"""

from typing import NamedTuple

import numpy as np

from epa_rt.gap.finding import stretches
from epa_rt.gap.rig.foreign.component import Numbers
from epa_rt.gap.rig.foreign.law import Motion
from epa_rt.gap.rig.foreign.moved import cut_off
from epa_rt.gap.rig.foreign.rests import least_rows, slow_rows
from epa_rt.gap.rig.foreign.signals import Signals, lowpass

TINY = np.finfo(float).tiny
# a mean over a row differs from the value in its middle by a second difference over this
HELD = 24.0
# of what an output varies by, to which simulators solve their equations where nobody asks for more
EXACT = 1e-3
REACH = 8.0  # cut-off periods after which the low-pass has forgotten a pulse
REVERSALS = (
    (
        "a residual counts for 1 / sqrt(1 + variance / noise^2), where variance = turns^2 + rest^2"
        " + between^2"
    ),
    (
        "turns^2 = sum (J s h)^2 at reversals and a rest's ends, rest = J sum |h|: dry friction"
        " jumps by J, the low-pass answers h to a pulse, the moment is unsure by s"
    ),
    (
        "s^2 = (row^2 + still^2) / 12 + (2 m K / |a + b|)^2, K = |a - b| + |a + b - 2 c|: for the"
        " time still the sign of v is noise; m is the mean time to one side of the place's filter"
    ),
    (
        "a, b and c: acceleration half a period of that filter before the reversal, after it and in"
        " it; K / |a + b| is 1 at most"
    ),
    (
        "between^2 = slopes^2 + held^2 + (J (1 - |sign|) / 2)^2 + (F / 1000)^2, behind the"
        " low-pass: slopes of second and fourth order, or fourth and sixth, differ by the first"
    ),
    (
        "held: a 24th of the output's second difference, for it may be held from row to row or"
        " read in it; F: what the output varies by"
    ),
)


class Turning(NamedTuple):
    """A motion whose direction an output hangs on. ``dry`` (N,): half of what the output jumps by
    where the motion turns round there, in its unit; ``unsure`` (N,): what it hangs by on how slopes
    are taken between rows; ``hertz``: the cut-off of the position's filter; ``slow`` (N,) bool:
    where the direction is noise. ``mass_noise``: deviation of what the position's noise makes of
    the mass' own output in the residual; ``typical``: size of an output as the rig file has it.
    """

    motion: Motion
    dry: np.ndarray
    unsure: np.ndarray
    hertz: float
    slow: np.ndarray
    mass_noise: float
    typical: float


def turning_of(
    signals: Signals, motion: Motion, dry: np.ndarray, unsure: np.ndarray, numbers: Numbers
) -> Turning:
    """Of a motion whose position ``moved.smoothed`` has filtered."""
    behind = cut_off(signals, numbers)
    slow = slow_rows(motion.speed_m_s, behind.speed_m_s, numbers)
    typical = numbers["typical_force"]
    return Turning(motion, dry, unsure, behind.hertz, slow, behind.force_n, typical)


def row_variance(
    signals: Signals, turning: Turning, output: np.ndarray, left: np.ndarray
) -> np.ndarray:
    """(n,) variance of a residual behind the low-pass beyond that of its noise, in its unit
    squared. ``output`` (N,): as measured; ``left`` (n,): the residual at the plant file's numbers,
    NaN where it is not judged.
    """
    from scipy.signal import fftconvolve

    if not np.isfinite(left).any():
        return np.zeros(len(left))
    answer, unsure_s2, rests = (_answer(signals, signals.lowpass_hz), *_unsure(signals, turning))
    dry, share = turning.dry + _beyond(signals, turning.motion, left), answer**2
    held = fftconvolve(np.where(rests, 2.0 * dry, 0.0), np.abs(answer) / signals.rate_hz, "same")
    rounded = signals.lowpass(dry * (1.0 - np.abs(turning.motion.sign)))
    variance = (
        fftconvolve((2.0 * dry) ** 2 * unsure_s2, share, "same")
        + fftconvolve(_between_rows(signals, turning, output) ** 2, share / share.sum(), "same")
        + held**2
        + rounded**2
        + (EXACT * np.std(output)) ** 2
    )
    return np.maximum(variance, 0.0)[:: signals.stride]


def _between_rows(signals: Signals, turning: Turning, output: np.ndarray) -> np.ndarray:
    """(N,) what the low-pass lets through of what no row tells: how slopes are taken between rows,
    and whether an output is held from one row to the next or read in it.
    """
    held = np.zeros(len(output))
    held[1:-1] = np.diff(output, 2) / HELD
    found: np.ndarray = np.hypot(signals.lowpass(turning.unsure), signals.lowpass(held))
    return found


def _turned(sign: np.ndarray) -> np.ndarray:
    """Rows behind which the motion goes the other way than up to there."""
    moves = np.flatnonzero(sign)  # in steps it may stand between two of them
    forth = sign[moves] > 0.0
    rows: np.ndarray = moves[1:][forth[1:] != forth[:-1]] - 1
    return rows


def _unsure(signals: Signals, turning: Turning) -> tuple[np.ndarray, np.ndarray]:
    """(N,) variance of the moments of reversals, s^2, 0 where there is none: a row, the time over
    which the direction is noise (the moment may be any row of it), and the way by which the
    position's filter moves the zero of a speed that has a kink there. (N,) bool: rests, in which
    friction takes any force up to its own.
    """
    row_s = 1.0 / signals.rate_hz
    moved_s2, found = _zero_moves_s(signals, turning) ** 2, np.zeros(signals.samples)
    rests, rows = np.zeros(signals.samples, bool), _turned(turning.motion.sign)
    found[rows] = row_s**2 / 12.0 + moved_s2[rows]
    least = least_rows(turning.hertz, signals.rate_hz)
    most = max(round(least), 1)
    for start, stop in stretches(turning.slow):
        first = max(start - 1, 0)  # the row before the sign changes may be outside
        rests[first:stop] = stop - start >= least
        for begins, ends in {(first, min(first + most, stop)), (max(stop - most, first), stop)}:
            stands_s2 = ((ends - begins) * row_s) ** 2
            variance = stands_s2 / 12.0 + moved_s2[begins:ends].max()
            found[begins:ends] = variance / (ends - begins)
    return found, rests


def _zero_moves_s(signals: Signals, turning: Turning) -> np.ndarray:
    """(N,) how far the filter moves a zero of the speed there, at most: 2 m K / |a + b|. Of
    accelerations a before, b after and c in that row K = |a - b| + |a + b - 2 c| says how sharp the
    motion is; m is the filter's mean time to one side. A motion that turns round moves its zero by
    2 m at most.
    """
    answer = np.abs(_answer(signals, turning.hertz))
    away_s = np.abs(np.arange(len(answer)) - len(answer) // 2) / signals.rate_hz
    one_side_s = 0.5 * float(answer @ away_s) / signals.rate_hz
    apart = max(round(0.5 * signals.rate_hz / turning.hertz), 1)  # rows: half a period of it
    rows = np.arange(signals.samples)
    before, after = (
        turning.motion.acceleration_m_s2[np.clip(rows + k, 0, signals.samples - 1)]
        for k in (-apart, apart)
    )
    here, both = turning.motion.acceleration_m_s2, np.abs(before + after)
    kink = np.abs(before - after) + np.abs(before + after - 2.0 * here)
    found: np.ndarray = 2.0 * one_side_s * kink / np.maximum(np.maximum(kink, both), TINY)
    return found


def _answer(signals: Signals, hertz: float) -> np.ndarray:
    """What a low-pass answers to a pulse of one unit second, per second, centred."""
    reach = int(REACH * signals.rate_hz / hertz)
    pulse = np.zeros(2 * max(reach, 16) + 1)
    pulse[len(pulse) // 2] = signals.rate_hz
    return lowpass(pulse, signals.rate_hz, hertz)


def _beyond(signals: Signals, motion: Motion, left: np.ndarray) -> float:
    """Dry friction that the log shows beyond that of the plant file, in the residual's unit: what
    goes with the motion's direction beside place, speed and acceleration (least squares).
    """
    shapes = (motion.sign, motion.position_m, motion.read_speed_m_s, motion.read_acceleration_m_s2)
    table = np.column_stack(
        [*(signals.lowpass(shape)[:: signals.stride] for shape in shapes), np.ones(len(left))]
    )
    judged = np.isfinite(left)
    sizes = np.abs(table[judged]).max(axis=0)
    sizes[sizes == 0.0] = 1.0
    return float(np.linalg.lstsq(table[judged] / sizes, left[judged], rcond=None)[0][0] / sizes[0])
