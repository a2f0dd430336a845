"""Trials of one muscle as arrays: gauge pressure, length, speed and force, and what they are
normalised by.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from epa_rt.config.rig import Rig
from epa_rt.gap.recording import Recording
from epa_rt.models.blocks.muscle import NO_LOAD

SMOOTH_S = (
    0.021  # window of the derivative: longer than the encoder's hold, shorter than any stroke
)
HEAD_S = 0.05
FEWEST_SAMPLES = 500
LEAST_STROKE_M = 1e-3
BLOCK_S = 2.0  # what intervals resample: longer than what a residual remembers of a stroke
FEWEST_BLOCKS = (
    30  # with 45 a 95 % interval holds the truth in 91 to 94 % of repeats (docs/identification.md)
)
SAME_PRESSURE_PA = 8e3  # no-load pressures closer than this count as one


class IdentifyError(ValueError):
    """What the logs lack, in one sentence."""


@dataclass(frozen=True)
class Trial:
    """One trial, (n,) each: gauge pressure (Pa), length (m), speed of lengthening (m/s), force (N)
    at ``period_s``.

    ``p0_pa``: gauge pressure at the start of the trial, over HEAD_S. ``log``: name of the
    recording.
    """

    name: str
    log: str
    p0_pa: float
    atmosphere_pa: float
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
    """Pressure P/P0 (gauge), elongation from no-load length over ``length_m``, contraction speed
    over ``speed_m_s``, force over ``force_n``.
    """

    pressure_pa: float
    no_load_m: float
    length_m: float
    speed_m_s: float
    force_n: float

    def said(self) -> str:
        return (
            f"P = gauge pressure / {self.pressure_pa / 1e3:g} kPa, L = (length -"
            f" {self.no_load_m * 1e3:.2f} mm) / {self.length_m * 1e3:g} mm, dL/dt = contraction"
            f" speed / {self.speed_m_s * 1e3:g} mm/s, F = force / {self.force_n:g} N"
        )


def normalisation(params: np.ndarray) -> Normalisation:
    """That of the plant file's polynomial, so that fitted coefficients go straight into one.
    ``params``: (1,) PARAMS.
    """
    m = params["muscle"][0, 0]
    return Normalisation(
        float(m["poly_pressure_pa"]),
        float(m["braid_length_m"]) * NO_LOAD,
        float(m["poly_length_m"]),
        float(m["poly_speed_m_s"]),
        float(m["poly_force_n"]),
    )


def trials(recordings: Sequence[Recording], rig: Rig, params: np.ndarray) -> list[Trial]:
    """Every trial of all recordings in which the muscle moves.

    Samples without a value are cut off at the ends, refused in the middle. The pressure sensor's
    lag, as the plant file has it, is taken back: gas that answers late looks like damping. Raises
    IdentifyError, also where a load moves the muscle.
    """
    pressure, force, travel = _signals(rig)
    load = params["load"][0]
    if load["kind_code"] != 0.0 and load["load0_ratio"] != 0.0:
        raise IdentifyError(
            "found a plant file whose load moves the muscle as well (load: kind_code:"
            f" {load['kind_code']:g}, load0: {load['load0_ratio']:g}), expected a muscle held by"
            " the load cell (kind_code: 0): its length is read from the motor's travel alone"
        )
    found = []
    for recording in recordings:
        missing = [name for name in (pressure, force, travel) if name not in recording.columns]
        if missing:
            raise IdentifyError(
                f"{recording.path}: found no column {', '.join(missing)}, expected pressure, force"
                " and travel of a muscle"
            )
        for span in recording.spans:
            if span.trial:
                columns = [
                    recording.columns[name][span.start : span.stop]
                    for name in (pressure, force, travel)
                ]
                found.append(_trial(recording, span.name, rig.atmosphere_pa, params, *columns))
    if not found:
        raise IdentifyError(
            f"found no trial in {', '.join(r.path for r in recordings)}, expected phases marked"
            " 'trial: true'"
        )
    return found


def remarks(found: Sequence[Trial]) -> tuple[str, ...]:
    """What these trials cannot tell, in sentences."""
    said = []
    if pressures(found).max() == 0:
        said.append(
            f"one no-load pressure only ({found[0].p0_pa / 1e3:.0f} kPa): nothing can be left out"
            " by pressure, and what depends on pressure is told from what depends on length only"
            " by what the stroke changes"
        )
    blocks = sum(-(-t.samples // max(1, round(BLOCK_S / t.period_s))) for t in found)
    if blocks < FEWEST_BLOCKS:
        said.append(
            f"{sum(t.samples * t.period_s for t in found):.0f} s of trials are {blocks} blocks of"
            f" {BLOCK_S:g} s, expected at least {FEWEST_BLOCKS}: 95 % intervals of so few are too"
            " narrow"
        )
    moving = np.concatenate([np.abs(t.speed_m_s) for t in found])
    moving = moving[moving > 0.2 * moving.max()]
    if np.std(moving) < 0.05 * np.mean(moving):
        said.append(
            f"one speed only ({np.mean(moving) * 1e3:.1f} mm/s): damping cannot be told from"
            " friction"
        )
    return tuple(said)


def _signals(rig: Rig) -> tuple[str, str, str]:
    """Names of the muscle's pressure and force and of the motor's travel."""
    force = next((row.name for row in rig.signals if row.port == "force_n"), None)
    if force is None or rig.motor is None or not rig.muscles:
        raise IdentifyError(
            f"the rig '{rig.name}' has no muscle with force, pressure and motor travel, expected"
            " all three"
        )
    return rig.muscles[0].pressure, force, rig.motor.position


def _trial(
    recording: Recording,
    name: str,
    atmosphere_pa: float,
    params: np.ndarray,
    pressure,
    force,
    travel,
) -> Trial:
    whole = np.isfinite(pressure) & np.isfinite(force) & np.isfinite(travel)
    where = f"{recording.path}: trial '{name}'"
    if whole.sum() < FEWEST_SAMPLES:
        raise IdentifyError(
            f"{where}: found {int(whole.sum())} sound samples, expected at least {FEWEST_SAMPLES}"
        )
    first, last = int(np.argmax(whole)), len(whole) - int(np.argmax(whole[::-1]))
    if not whole[first:last].all():
        at = first + int(np.argmin(whole[first:last]))
        raise IdentifyError(
            f"{where}: found no valid value at sample {at} ({at * recording.period_s:.3f} s into"
            " the trial), expected a trial without holes"
        )
    length = float(params["load"]["rest0_m"][0]) + float(
        params["load"]["travel0_ratio"][0]
    ) * renewed(np.asarray(travel[first:last], float))
    if np.ptp(length) < LEAST_STROKE_M:
        raise IdentifyError(
            f"{where}: found a stroke of {np.ptp(length) * 1e3:.2f} mm, expected at least"
            f" {LEAST_STROKE_M * 1e3:g} mm to identify anything"
        )
    gauge = np.asarray(pressure[first:last], float) - atmosphere_pa
    found = trial_of(
        name,
        recording.name,
        recording.period_s,
        gauge,
        length,
        np.asarray(force[first:last], float),
        atmosphere_pa,
        float(params["sensors"]["pressure_lag_s"][0]),
    )
    if not closed_path(found.length_m).any():
        raise IdentifyError(
            f"{where}: found motion that never comes back, expected the muscle stretched and"
            " released at least twice"
        )
    return found


def trial_of(
    name: str,
    log: str,
    period_s: float,
    gauge_pa: np.ndarray,
    length_m: np.ndarray,
    force_n: np.ndarray,
    atmosphere_pa: float,
    pressure_lag_s: float = 0.0,
) -> Trial:
    """A trial from (n,) of measured gauge pressure, length and force: speed by a derivative without
    delay, sensor lag taken back.
    """
    window = max(5, round(SMOOTH_S / period_s) // 2 * 2 + 1)
    speed = savgol_filter(length_m, window, 2, deriv=1, delta=period_s)
    if pressure_lag_s:
        gauge_pa = gauge_pa + pressure_lag_s * savgol_filter(
            gauge_pa, window, 2, deriv=1, delta=period_s
        )
    head = max(1, round(HEAD_S / period_s))
    return Trial(
        name,
        log,
        float(np.mean(gauge_pa[:head])),
        atmosphere_pa,
        period_s,
        gauge_pa,
        length_m,
        speed,
        force_n,
    )


def closed_path(length: np.ndarray) -> np.ndarray:
    """Steps of length, (n,), zero outside whole loops: from the first to the last time that the
    middle length is passed upwards.

    Force times these is the work lost in loops; elastic energy left at the end of a trial does not
    count.
    """
    middle, steps = 0.5 * (length.min() + length.max()), np.gradient(length)
    upwards = np.flatnonzero((length[:-1] < middle) & (length[1:] >= middle))
    if len(upwards) < 2:
        return np.zeros(len(length))
    steps[: upwards[0] + 1] = 0.0
    steps[upwards[-1] + 1 :] = 0.0
    return steps


def renewed(travel: np.ndarray) -> np.ndarray:
    """A held encoder's readings re-interpolated: where every second sample at most is new, only the
    new ones count.
    """
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
