"""The place of a sliding part, filtered no more than its noise asks for.

A residual passes its low-pass once. What it is made of should pass no second one that is as narrow:
at a reversal dry friction and acceleration jump together, and a motion that is as smooth as the
residual puts both jumps elsewhere than the drive's force does (a carriage without a gap showed 4.2
times its floor, behind a filter of four times its cut-off 1.4). A wider filter lets half as much
again of the place's noise through into what the mass asks for: where that is not far below the
forces of interest, it is not worth it.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from epa_rt.gap.hygiene.values import noise_of, smallest_step
from epa_rt.gap.rig.foreign.component import Numbers
from epa_rt.gap.rig.foreign.signals import Signals, lowpass, slope

WIDER = (4.0, 2.0, 1.0)  # times the residual's cut-off; the widest that the noise allows
QUIET = 3e-3  # of the typical speed, to which the noise of the speed must stay
QUIET_FORCE = 6e-3  # of the typical force, to which that of the mass' own must stay in the residual
PROBE, PERIODS = (
    8192,
    40,
)  # rows of white noise that are sent through the filters at least, and periods of the cut-off
# of a log's rate, above which a central difference takes the more off the higher a frequency is
SLOPED = 0.25
MASS = "carriage.inertia_kg"


class CutOff(NamedTuple):
    """A position's cut-off, Hz, and deviations of what the place's noise, or its step, makes behind
    it: of the speed, m/s, and of the mass' own force in the residual, N (or rad/s, N*m).
    """

    hertz: float
    speed_m_s: float
    force_n: float


def smoothed(signals: Signals, numbers: Numbers) -> tuple[np.ndarray, bool]:
    """(N,) the place in m (or rad), low-passed, and whether that has left nothing of it above
    ``SLOPED``.
    """
    hertz = cut_off(signals, numbers).hertz
    place_m = lowpass(signals.columns["position"], signals.rate_hz, hertz)
    return place_m, hertz < SLOPED * signals.rate_hz


def cut_off(signals: Signals, numbers: Numbers) -> CutOff:
    """The widest of ``WIDER`` behind which noise is little, the narrowest where it is nowhere."""
    position = signals.columns["position"]
    moving = position[1:][np.diff(position) != 0.0]  # a log may begin with a long rest
    size = max(noise_of(position), smallest_step(moving) / np.sqrt(12.0))
    for times in WIDER:
        hertz = times * signals.lowpass_hz
        speed, asked = _behind(size, hertz, signals.rate_hz, signals.lowpass_hz)
        found = CutOff(hertz, speed, numbers.get(MASS, 0.0) * asked)
        if (
            found.speed_m_s < QUIET * numbers["typical_speed"]
            and found.force_n < QUIET_FORCE * numbers["typical_force"]
        ):
            break
    return found


@lru_cache
def _behind(size: float, hertz: float, rate_hz: float, lowpass_hz: float) -> tuple[float, float]:
    """Deviations of what white noise of a ``size`` in a place makes behind a cut-off at ``hertz``:
    of the speed, and of the acceleration as it passes the residual's low-pass.
    """
    rows = max(PROBE, int(PERIODS * rate_hz / lowpass_hz))
    white = size * np.random.default_rng(0).standard_normal(rows)
    filtered = hertz < SLOPED * rate_hz
    speed = slope(lowpass(white, rate_hz, hertz), rate_hz, filtered)
    asked = lowpass(slope(speed, rate_hz, filtered), rate_hz, lowpass_hz)
    return _inside(speed), _inside(asked)


def _inside(values: np.ndarray) -> float:
    """Deviation away from the ends, where a filter has settled."""
    return float(np.std(values[len(values) // 4 : -len(values) // 4]))
