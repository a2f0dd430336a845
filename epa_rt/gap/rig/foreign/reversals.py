"""How well the moment is known at which a sliding part turns round, and what that leaves of a link.

Dry friction and acceleration jump there, and the motion that says when has been filtered, sampled
and read with noise. A jump that is foreseen a little early or late leaves a pulse in the residual.
Rows count for less where it may be larger than the noise: their variance is the noise's and that of
the pulse (errors in variables).
"""

from typing import NamedTuple

import numpy as np

from epa_rt.gap.finding import stretches
from epa_rt.gap.likelihood.colour import white_size
from epa_rt.gap.rig.foreign.component import Numbers
from epa_rt.gap.rig.foreign.law import Motion
from epa_rt.gap.rig.foreign.moved import cut_off
from epa_rt.gap.rig.foreign.rests import RESTS, slow_rows
from epa_rt.gap.rig.foreign.signals import Signals, lowpass

TINY = np.finfo(float).tiny
REACH = 8.0  # cut-off periods after which the low-pass has forgotten a pulse
# of what an output varies by, to which no law foresees it: noise counts as that much at least, for
# a log without any would hang on the filter's tails
EXACT = 1e-3
UNTOUCHED = 1e-3  # of the largest variance of a pulse, below which a row tells the noise
REVERSALS = (
    (
        "near reversals and a rest's ends the residual counts for 1 / sqrt(1 + sum (J s h /"
        " noise)^2): dry friction jumps by J, the low-pass answers h to a pulse, the moment is"
        " unsure by s"
    ),
    (
        "s^2 = (row^2 + rest^2) / 12 + (2 m K / |a + b|)^2, K = |a - b| + |a + b - 2 c|: for the"
        " time rest the sign of v is noise; m is the mean time to one side of the place's filter"
    ),
    (
        "a, b and c: acceleration half a period of that filter before the reversal, after it and in"
        " it; K / |a + b| is 1 at most"
    ),
)


class Turning(NamedTuple):
    """A motion whose direction an output hangs on. ``dry`` (N,): half of what the output jumps by
    where the motion turns round there, in its unit; ``hertz``: the cut-off of the position's
    filter; ``slow`` (N,) bool: where the direction is noise.
    """

    motion: Motion
    dry: np.ndarray
    hertz: float
    slow: np.ndarray


def turning_of(signals: Signals, motion: Motion, dry: np.ndarray, numbers: Numbers) -> Turning:
    """Of a motion whose position ``moved.smoothed`` has filtered."""
    hertz, noise = cut_off(signals, numbers)
    return Turning(motion, dry, hertz, slow_rows(motion.speed_m_s, noise, numbers))


def weights(
    signals: Signals, turning: Turning, output: np.ndarray, left: np.ndarray, rate_hz: float
) -> np.ndarray:
    """(n,) 0 to 1, by which a residual counts at ``rate_hz`` behind the low-pass. ``output`` (N,):
    as measured; ``left`` (n,): the residual at the plant file's numbers, NaN where it is not
    judged.
    """
    from scipy.signal import fftconvolve

    unsure_s2 = _unsure_s2(signals, turning)
    if not unsure_s2.any() or not np.isfinite(left).any():
        return np.ones(len(left))
    jump = 2.0 * (turning.dry + _beyond(signals, turning.motion, left))
    pulses = fftconvolve(jump**2 * unsure_s2, _answer(signals, signals.lowpass_hz) ** 2, "same")
    variance = np.maximum(pulses[:: signals.stride], 0.0)
    quiet = np.where(variance > UNTOUCHED * variance.max(), np.nan, left)
    lowpass_hz = min(signals.lowpass_hz, rate_hz)
    noise = white_size([quiet], rate_hz, lowpass_hz) or white_size([left], rate_hz, lowpass_hz)
    noise = max(noise, EXACT * float(np.std(output)), TINY)
    found: np.ndarray = 1.0 / np.sqrt(1.0 + variance / noise**2)
    return found


def _turned(speed_m_s: np.ndarray) -> np.ndarray:
    """Rows behind which the motion goes the other way than up to there."""
    moves = np.flatnonzero(speed_m_s)  # in steps it may stand between two of them
    forth = speed_m_s[moves] > 0.0
    rows: np.ndarray = moves[1:][forth[1:] != forth[:-1]] - 1
    return rows


def _unsure_s2(signals: Signals, turning: Turning) -> np.ndarray:
    """(N,) variance of the moments of reversals, 0 where there is none: a row, the time over which
    the direction is noise, and the way by which the position's filter moves the zero of a speed
    that has a kink there. Where the direction is noise for a while the moment may be any row of it,
    and friction gives way there also where the motion then goes on: at both ends of a rest.
    """
    row_s = 1.0 / signals.rate_hz
    moved_s2, found = _zero_moves_s(signals, turning) ** 2, np.zeros(signals.samples)
    rows = _turned(turning.motion.speed_m_s)
    found[rows] = row_s**2 / 12.0 + moved_s2[rows]
    most = max(round(RESTS / turning.hertz * signals.rate_hz), 1)  # a rest is not judged but there
    for start, stop in stretches(turning.slow):
        first = max(start - 1, 0)  # the row before the sign changes may be outside
        for begins, ends in {(first, min(first + most, stop)), (max(stop - most, first), stop)}:
            stands_s2 = ((ends - begins) * row_s) ** 2
            variance = stands_s2 / 12.0 + moved_s2[begins:ends].max()
            found[begins:ends] = variance / (ends - begins)
    return found


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
    shapes = (motion.sign, motion.position_m, motion.speed_m_s, motion.acceleration_m_s2)
    table = np.column_stack(
        [*(signals.lowpass(shape)[:: signals.stride] for shape in shapes), np.ones(len(left))]
    )
    judged = np.isfinite(left)
    sizes = np.abs(table[judged]).max(axis=0)
    sizes[sizes == 0.0] = 1.0
    return float(np.linalg.lstsq(table[judged] / sizes, left[judged], rcond=None)[0][0] / sizes[0])
