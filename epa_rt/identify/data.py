"""Trials of one muscle as arrays: gauge pressure, length, speed and force, and what they are normalised by."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from epa_rt.config.rig import Rig
from epa_rt.gap.recording import Recording
from epa_rt.models.blocks.muscle import NO_LOAD

SMOOTH_S = 0.021        # window of the derivative: longer than the encoder's hold, shorter than any stroke
FEWEST_SAMPLES = 500
LEAST_STROKE_M = 1e-3
SAME_PRESSURE_PA = 8e3  # no-load pressures closer than this count as one


class IdentifyError(ValueError):
    """What the logs lack, in one sentence."""


@dataclass(frozen=True)
class Trial:
    """One trial, (n,) each: gauge pressure (Pa), length (m), speed of lengthening (m/s), force (N) at ``period_s``.

    ``p0_pa``: gauge pressure at the start of the trial. ``log``: name of the recording.
    """

    name: str
    log: str
    p0_pa: float
    period_s: float
    gauge_pa: np.ndarray
    length_m: np.ndarray
    speed_m_s: np.ndarray
    force_n: np.ndarray

    @property
    def samples(self) -> int:
        return len(self.force_n)


@dataclass(frozen=True)
class Normalisation:
    """Pressure P/P0 (gauge), elongation from no-load length over ``length_m``, contraction speed over ``speed_m_s``, force over ``force_n``."""

    pressure_pa: float
    no_load_m: float
    length_m: float
    speed_m_s: float
    force_n: float

    def said(self) -> str:
        return (f"P = gauge pressure / {self.pressure_pa / 1e3:g} kPa, L = (length - {self.no_load_m * 1e3:.2f} mm) / {self.length_m * 1e3:g} mm, "
                f"dL/dt = contraction speed / {self.speed_m_s * 1e3:g} mm/s, F = force / {self.force_n:g} N")


def normalisation(params: np.ndarray) -> Normalisation:
    """That of the plant file's polynomial, so that fitted coefficients go straight into one. ``params``: (1,) PARAMS."""
    m = params["muscle"][0, 0]
    return Normalisation(float(m["poly_pressure_pa"]), float(m["braid_length_m"]) * NO_LOAD, float(m["poly_length_m"]), float(m["poly_speed_m_s"]), float(m["poly_force_n"]))


def trials(recordings: Sequence[Recording], rig: Rig, params: np.ndarray) -> list[Trial]:
    """Every trial of all recordings in which the muscle moves.

    Samples without a value are cut off at the ends, refused in the middle. Raises IdentifyError.
    """
    pressure, force, travel = _signals(rig)
    found = []
    for recording in recordings:
        missing = [name for name in (pressure, force, travel) if name not in recording.columns]
        if missing:
            raise IdentifyError(f"{recording.path}: found no column {', '.join(missing)}, expected pressure, force and travel of a muscle")
        rest, ratio = float(params["load"]["rest0_m"][0]), float(params["load"]["travel0_ratio"][0])
        for span in recording.spans:
            if span.trial:
                columns = [recording.columns[name][span.start:span.stop] for name in (pressure, force, travel)]
                found.append(_trial(recording, span.name, rig.atmosphere_pa, rest, ratio, *columns))
    if not found:
        raise IdentifyError(f"found no trial in {', '.join(r.path for r in recordings)}, expected phases marked 'trial: true'")
    return found


def _signals(rig: Rig) -> tuple[str, str, str]:
    """Names of the muscle's pressure and force and of the motor's travel."""
    force = next((row.name for row in rig.signals if row.port == "force_n"), None)
    if force is None or rig.motor is None or not rig.muscles:
        raise IdentifyError(f"the rig '{rig.name}' has no muscle with force, pressure and motor travel, expected all three")
    return rig.muscles[0].pressure, force, rig.motor.position


def _trial(recording: Recording, name: str, atmosphere_pa: float, rest_m: float, ratio: float, pressure, force, travel) -> Trial:
    whole = np.isfinite(pressure) & np.isfinite(force) & np.isfinite(travel)
    where = f"{recording.path}: trial '{name}'"
    if whole.sum() < FEWEST_SAMPLES:
        raise IdentifyError(f"{where}: found {int(whole.sum())} sound samples, expected at least {FEWEST_SAMPLES}")
    first, last = int(np.argmax(whole)), len(whole) - int(np.argmax(whole[::-1]))
    if not whole[first:last].all():
        at = first + int(np.argmin(whole[first:last]))
        raise IdentifyError(f"{where}: found no valid value at sample {at} ({at * recording.period_s:.3f} s into the trial), expected a trial without holes")
    fresh = _renewed(np.asarray(travel[first:last], float))
    length = rest_m + ratio * fresh
    if np.ptp(length) < LEAST_STROKE_M:
        raise IdentifyError(f"{where}: found a stroke of {np.ptp(length) * 1e3:.2f} mm, expected at least {LEAST_STROKE_M * 1e3:g} mm to identify anything")
    window = max(5, round(SMOOTH_S / recording.period_s) // 2 * 2 + 1)
    speed = savgol_filter(length, window, 2, deriv=1, delta=recording.period_s)
    gauge = np.asarray(pressure[first:last], float) - atmosphere_pa
    head = max(1, round(0.05 / recording.period_s))
    return Trial(name, recording.name, float(np.mean(gauge[:head])), recording.period_s, gauge, length, speed, np.asarray(force[first:last], float))


def _renewed(travel: np.ndarray) -> np.ndarray:
    """A held encoder's readings re-interpolated: where every second sample at most is new, only the new ones count."""
    change = np.flatnonzero(np.diff(travel) != 0.0) + 1
    if len(change) < 100:
        return travel
    even = np.bincount(change % 2, minlength=2)
    if even.min() > 0.02 * even.sum():
        return travel
    fresh = np.arange(int(np.argmax(even)), len(travel), 2)
    return np.interp(np.arange(len(travel)), fresh, travel[fresh])


def pressures(found: Sequence[Trial]) -> np.ndarray:
    """Which no-load pressure every trial belongs to, numbered from the lowest: (trials,) of int."""
    order = np.argsort([t.p0_pa for t in found])
    group, groups, before = -1, np.zeros(len(found), int), -np.inf
    for k in order:
        if found[k].p0_pa - before > SAME_PRESSURE_PA:
            group += 1
        groups[k], before = group, found[k].p0_pa
    return groups
