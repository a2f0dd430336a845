"""Margins of a loop from its response over frequency, and whether it is stable at all.

Sensitivity S = 1 / (1 + L). Its peak Ms is one over the least distance of L to -1; a loop keeps a
gain margin of Ms / (Ms - 1) and a phase margin of 2 asin(1 / (2 Ms)) at least (Astrom and
Hagglund, Advanced PID Control, 2006, 4.3).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

GRID = 1200  # frequencies, spread evenly over the octaves, on which margins are read
LEAST_RADIUS = 0.05  # of the plant: friction makes stiffness differ by as much with amplitude
QUIET = 0.5  # a loop gain that is below this at the highest frequency known may stay unmeasured
HOPELESS = 10.0  # Ms: a gain margin of 1.1 is none
BANDWIDTH = float(np.sqrt(0.5))  # of |S|: errors are halved in power


@dataclass(frozen=True)
class Margins:
    """What keeps a loop from swinging up; NaN where there is none within the frequencies known.

    ``gain`` a factor on the loop gain, ``phase_rad``, ``delay_s`` more delay that it stands,
    ``peak`` Ms, ``peak_hz`` where, ``crossover_hz`` the highest at which the loop gain is one,
    ``bandwidth_hz`` up to which errors are halved in power. ``worst_peak``: Ms over the
    plant's uncertainty, infinite where that does not exclude instability.
    """

    stable: bool
    gain: float
    gain_hz: float
    phase_rad: float
    delay_s: float
    peak: float
    peak_hz: float
    worst_peak: float
    crossover_hz: float
    bandwidth_hz: float
    gain_at_end: float


@dataclass(frozen=True)
class Interpolated:
    """Plant and 95 % radius on a fine grid of frequencies, (m,) each."""

    frequency_hz: np.ndarray
    plant: np.ndarray
    radius: np.ndarray


def interpolated(
    frequency_hz: np.ndarray,
    plant: np.ndarray,
    radius: np.ndarray,
    shape: Callable[[np.ndarray], np.ndarray],
) -> Interpolated:
    """Between the frequencies (n,) the plant follows a model's ``shape`` (its response at
    frequencies in Hz), times what that is off by at both neighbours: a resonance may peak between.
    """
    grid = np.geomspace(frequency_hz[0], frequency_hz[-1], GRID)
    between = plant_at(grid, frequency_hz, plant, shape)
    known = np.maximum(radius / np.abs(plant), LEAST_RADIUS)
    relative = np.interp(np.log(grid), np.log(frequency_hz), known)
    return Interpolated(grid, between, relative * np.abs(between))


def plant_at(
    wanted_hz: np.ndarray,
    frequency_hz: np.ndarray,
    plant: np.ndarray,
    shape: Callable[[np.ndarray], np.ndarray],
) -> np.ndarray:
    """A plant known at frequencies (n,) at others (m,), all in Hz: a model's ``shape`` times what
    it is off by at both neighbours, or at the nearest frequency known.
    """
    at, known = np.log(wanted_hz), np.log(frequency_hz)
    off = plant / shape(frequency_hz)
    size = np.exp(np.interp(at, known, np.log(np.abs(off))))
    turn = np.interp(at, known, np.unwrap(np.angle(off)))
    found: np.ndarray = shape(wanted_hz) * size * np.exp(1j * turn)
    return found


def margins_of(plant: Interpolated, feedback: np.ndarray) -> Margins:
    """Margins of the loop ``plant`` times ``feedback`` (m,)."""
    frequency, loop = plant.frequency_hz, plant.plant * feedback
    distance = np.abs(1.0 + loop)
    at = int(np.argmin(distance))
    reach = np.min(distance - np.abs(feedback) * plant.radius)
    phase_rad, delay_s, crossover_hz = _at_gain_one(frequency, loop)
    gain, gain_hz = _at_half_turn(frequency, loop)
    stable = is_stable(loop)
    return Margins(
        stable,
        gain,
        gain_hz,
        phase_rad,
        delay_s,
        1.0 / float(distance[at]),
        float(frequency[at]),
        float(1.0 / reach) if reach > 0.0 and stable else float("inf"),
        crossover_hz,
        _bandwidth(frequency, distance),
        float(np.abs(loop[-1])),
    )


def shortfall(margins: Margins, limit: float) -> str | None:
    """What these margins fall short of Ms <= ``limit`` over the uncertainty; None: nothing."""
    if not margins.stable:
        return "the measured response calls the loop unstable"
    if not margins.worst_peak < HOPELESS:
        return "the response's uncertainty does not exclude that the loop swings up"
    if margins.worst_peak > limit:
        return f"Ms reaches {margins.worst_peak:.3g} over the response's uncertainty"
    return None


def is_stable(loop: np.ndarray) -> bool:
    """Nyquist's criterion for a plant that is stable but for integrators, from 1 + L along rising
    frequency: its angle makes no whole turn about -1.
    """
    angle = np.unwrap(np.angle(1.0 + loop))
    turned = angle[-1] - np.angle(1.0 + loop[-1])
    return bool(abs(turned) < 1.0 and abs(loop[-1]) < 1.0)


def _crossings(values: np.ndarray) -> np.ndarray:
    return np.flatnonzero(np.signbit(values[:-1]) != np.signbit(values[1:]))


def _at_gain_one(frequency: np.ndarray, loop: np.ndarray) -> tuple[float, float, float]:
    """Least phase margin (rad) and delay margin (s) over all crossings, and the highest crossing
    (Hz).
    """
    logs = np.log(np.abs(loop))
    places = _crossings(logs)
    if not len(places):
        return float("nan"), float("nan"), float("nan")
    share = logs[places] / (logs[places] - logs[places + 1])
    hertz = frequency[places] * (frequency[places + 1] / frequency[places]) ** share
    angle = np.unwrap(np.angle(-loop))
    margin = angle[places] + share * (angle[places + 1] - angle[places])
    margin = np.mod(margin + np.pi, 2.0 * np.pi) - np.pi  # to -1, along the shorter way
    later = np.mod(margin, 2.0 * np.pi)  # a delay turns one way only
    return (
        float(margin[np.argmin(np.abs(margin))]),
        float(np.min(later / (2.0 * np.pi * hertz))),
        float(hertz[-1]),
    )


def _at_half_turn(frequency: np.ndarray, loop: np.ndarray) -> tuple[float, float]:
    """Least factor above one on the loop gain that reaches -1, and where (Hz)."""
    places = _crossings(loop.imag)
    least, where = float("nan"), float("nan")
    for i in places:
        a, b = loop[i], loop[i + 1]
        real = a.real - a.imag * (b.real - a.real) / (b.imag - a.imag)
        if -1.0 < real < 0.0 and not -1.0 / real >= least:
            least, where = float(-1.0 / real), float(frequency[i])
    return least, where


def _bandwidth(frequency: np.ndarray, distance: np.ndarray) -> float:
    """Highest frequency (Hz) up to which |S| stays below BANDWIDTH; NaN where it never does."""
    above = np.flatnonzero(1.0 / distance >= BANDWIDTH)
    if not len(above):
        return float(frequency[-1])
    return float(frequency[above[0]]) if above[0] > 0 else float("nan")
