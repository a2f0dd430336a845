"""How well a run followed its reference."""

from dataclasses import dataclass

import numpy as np

from epa_rt.experiments import oscillations
from epa_rt.experiments.coordinate import Coordinate
from epa_rt.report.run import Run, Span


@dataclass(frozen=True)
class Tracking:
    """Measured minus reference of the same cycle over one span, in the coordinate's SI unit; speeds
    per s.
    """

    span: Span
    coordinate: Coordinate
    rms: float
    peak: float
    peak_at: int
    bias: float
    speed_rms: float


def error_of(run: Run, span: Span) -> tuple[Coordinate, np.ndarray] | None:
    """Measured minus reference of a span; None where its loop measures nothing."""
    if span.phase is None:
        return None
    coordinate = span.phase.coordinate
    if coordinate.measured not in run.signals or coordinate.position_key not in run.signals:
        return None
    return (
        coordinate,
        run.signals[coordinate.measured][span.samples]
        - run.signals[coordinate.position_key][span.samples],
    )


def tracking_of(run: Run, span: Span) -> Tracking | None:
    """RMS, largest and mean error of a span; None where there is nothing to compare."""
    found = error_of(run, span)
    if found is None or not np.isfinite(found[1]).any():
        return None
    coordinate, error = found
    peak_at = int(np.nanargmax(np.abs(error)))
    return Tracking(
        span,
        coordinate,
        float(np.sqrt(np.nanmean(error**2))),
        float(error[peak_at]),
        span.begin + peak_at,
        float(np.nanmean(error)),
        _speed_rms(run, span, coordinate),
    )


def _speed_rms(run: Run, span: Span, coordinate: Coordinate) -> float:
    motor = run.rig.motor
    if coordinate.measured != motor.position or motor.speed not in run.signals:
        return float("nan")
    error = run.signals[motor.speed][span.samples] - run.signals[coordinate.speed_key][span.samples]
    return float(np.sqrt(np.nanmean(error**2)))


@dataclass(frozen=True)
class Periods:
    """One value per period of an oscillation: its samples, its frequency in Hz, achieved over asked
    amplitude, lag in rad.
    """

    begins: np.ndarray
    ends: np.ndarray
    frequency_hz: np.ndarray
    ratio: np.ndarray
    lag_rad: np.ndarray


def is_oscillation(span: Span) -> bool:
    """A chirp or a sine: a motion that has periods."""
    planned = span.phase.motion.planned if span.phase is not None else None
    return isinstance(planned, oscillations.Chirp | oscillations.Sine)


def periods_of(run: Run, span: Span) -> Periods | None:
    """Whole periods between the fades, from one upward passing of the mean to the next; None
    without any.

    In each, the measured signal is fitted by the reference, the reference shifted by a quarter and
    a constant.
    """
    if not is_oscillation(span):
        return None
    coordinate, mean = span.phase.coordinate, span.phase.motion.planned.mean
    reference = run.signals[coordinate.position_key][span.samples] - mean
    speed, measured = (
        run.signals[coordinate.speed_key][span.samples],
        run.signals[coordinate.measured][span.samples],
    )
    up = np.flatnonzero((reference[:-1] < 0.0) & (reference[1:] >= 0.0)) + 1
    planned = span.phase.motion.planned
    up = up[
        (up * run.period_s >= planned.fade_s)
        & (up * run.period_s <= planned.duration_s - planned.fade_s)
    ]
    if len(up) < 2:
        return None
    fits = [
        _fit(reference[a:b], speed[a:b], measured[a:b]) for a, b in zip(up, up[1:], strict=False)
    ]
    ratio, lag_rad = np.array(fits).T
    frequency_hz = 1.0 / (np.diff(up) * run.period_s)
    return Periods(span.begin + up[:-1], span.begin + up[1:], frequency_hz, ratio, lag_rad)


def _fit(reference: np.ndarray, speed: np.ndarray, measured: np.ndarray) -> tuple[float, float]:
    good = np.isfinite(measured)
    height, rate = np.std(reference), np.std(speed)
    if good.sum() < 8 or not height > 0.0 or not rate > 0.0:
        return float("nan"), float("nan")
    quarter = speed * (height / rate)
    columns = np.column_stack([reference, quarter, np.ones(len(reference))])[good]
    (inphase, leading, _), *_ = np.linalg.lstsq(columns, measured[good], rcond=None)
    return float(np.hypot(inphase, leading)), float(np.arctan2(-leading, inphase))
