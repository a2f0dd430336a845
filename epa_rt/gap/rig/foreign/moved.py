"""The place of a sliding part, filtered no more than its noise asks for.

A residual passes its low-pass once, and what goes in proportion to speed or acceleration passes no
other. Dry friction asks for the moment at which the part turns round, which noise of the place
would make many. A filter moves that moment, the more the narrower it is, and a narrow one smooths
what laws make of a place besides: it is as wide as the noise allows.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from epa_rt.gap.hygiene.values import noise_of, smallest_step
from epa_rt.gap.rig.foreign.component import Numbers
from epa_rt.gap.rig.foreign.signals import Signals, lowpass, slope, slope_as_read

WIDER = (4.0, 2.0, 1.0)  # times the residual's cut-off; the widest that the noise allows
QUIET = 3e-3  # of the typical speed, to which the noise of the speed must stay
# of the typical force, to which the mass' own must stay behind both filters
QUIET_FORCE = 6e-3
PROBE, PERIODS = (
    8192,
    40,
)  # rows of white noise that are sent through the filters at least, and periods of the cut-off
# of a log's rate, above which a central difference takes the more off the higher a frequency is
SLOPED = 0.25
MASS = "carriage.inertia_kg"


class CutOff(NamedTuple):
    """A position's cut-off, Hz, and deviations of what the place's noise, or its step, makes: of
    the speed behind it, m/s, and of the mass' own force in the residual, N (or rad/s, N*m).
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
    mass = numbers.get(MASS, 0.0)
    for times in WIDER:
        hertz = times * signals.lowpass_hz
        speed, asked = _behind(size, hertz, signals.rate_hz, signals.lowpass_hz)
        if (
            speed < QUIET * numbers["typical_speed"]
            and mass * asked < QUIET_FORCE * numbers["typical_force"]
        ):
            break
    alone = _as_read(size, signals.rate_hz, signals.lowpass_hz)
    return CutOff(hertz, speed, mass * alone)


@lru_cache
def _behind(size: float, hertz: float, rate_hz: float, lowpass_hz: float) -> tuple[float, float]:
    """Deviations of what white noise of a ``size`` in a place makes behind a cut-off at ``hertz``:
    of the speed, and of the acceleration as it passes the residual's low-pass.
    """
    white = _white(size, rate_hz, lowpass_hz)
    filtered = hertz < SLOPED * rate_hz
    speed = slope(lowpass(white, rate_hz, hertz), rate_hz, filtered)
    asked = lowpass(slope(speed, rate_hz, filtered), rate_hz, lowpass_hz)
    return _inside(speed), _inside(asked)


@lru_cache
def _as_read(size: float, rate_hz: float, lowpass_hz: float) -> float:
    """Deviation of what that noise makes of an acceleration that passes the residual's low-pass
    alone.
    """
    speed = slope_as_read(_white(size, rate_hz, lowpass_hz), rate_hz)
    return _inside(lowpass(slope_as_read(speed, rate_hz), rate_hz, lowpass_hz))


def _white(size: float, rate_hz: float, lowpass_hz: float) -> np.ndarray:
    rows = max(PROBE, int(PERIODS * rate_hz / lowpass_hz))
    return size * np.random.default_rng(0).standard_normal(rows)


def _inside(values: np.ndarray) -> float:
    """Deviation away from the ends, where a filter has settled."""
    return float(np.std(values[len(values) // 4 : -len(values) // 4]))
