"""Instruments of this house both ways: what they show of a truth, and the truth behind what they
showed.

Forward in the order of models/blocks/sensors.py: frame, age, lags, crosstalk, bow, warming, gain,
offset.
"""

import math

import numpy as np

from epa_rt.gap.rig.house.compiled import compiled
from epa_rt.models.blocks.instruments import lagged
from epa_rt.models.tables_load import CHANNELS, split

_STEMS = {channel: split(channel) for channel, _ in CHANNELS}
_FIELDS = {
    channel: (f"{stem}_gain_ratio", f"{stem}_offset{suffix}")
    for channel, (stem, suffix) in _STEMS.items()
}
_BOWS = {
    "muscle0_gauge_pa": "muscle0_gauge_bow_per_pa",
    "muscle1_gauge_pa": "muscle1_gauge_bow_per_pa",
    "force_n": "force_bow_per_n",
}
_DRIFTS = {
    "muscle0_gauge_pa": ("muscle0_gauge_drift_pa", "gauge_warm_up_s"),
    "muscle1_gauge_pa": ("muscle1_gauge_drift_pa", "gauge_warm_up_s"),
    "force_n": ("force_drift_n", "force_warm_up_s"),
}


def _warming(sensors, port: str, count: int, period_s: float) -> np.ndarray | float:
    drift, warm_up = _DRIFTS.get(port, (None, None))
    if drift is None or sensors[drift] == 0.0:
        return 0.0
    return float(sensors[drift]) * -np.expm1(
        -(np.arange(count) + 1.0) * period_s / float(sensors[warm_up])
    )


def straight(sensors, port: str, reading: np.ndarray, period_s: float) -> np.ndarray:
    """(N,) reading with offset, gain, warming and bow taken off; the same array where there is
    none.
    """
    gain, offset = (float(sensors[name]) for name in _FIELDS[port])
    value = reading if gain == 1.0 and offset == 0.0 else (reading - offset) / gain
    drift = _warming(sensors, port, len(reading), period_s)
    value = value if np.isscalar(drift) else value - drift
    bow = float(sensors[_BOWS[port]]) if port in _BOWS else 0.0
    return (
        value
        if bow == 0.0
        else 2.0 * value / (1.0 + np.sqrt(np.maximum(1.0 + 4.0 * bow * value, 0.01)))
    )


def shown(sensors, port: str, value: np.ndarray, period_s: float) -> np.ndarray:
    """(N,) the way back of ``straight``."""
    bow = float(sensors[_BOWS[port]]) if port in _BOWS else 0.0
    if bow != 0.0:
        value = value * (1.0 + bow * value)
    value = value + _warming(sensors, port, len(value), period_s)
    gain, offset = (float(sensors[name]) for name in _FIELDS[port])
    return value if gain == 1.0 and offset == 0.0 else gain * value + offset


def line_of(sensors, port: str) -> tuple[float, float]:
    """Gain and offset of a channel."""
    gain, offset = _FIELDS[port]
    return float(sensors[gain]), float(sensors[offset])


def moved(values: np.ndarray, cycles: float) -> np.ndarray:
    """(N,) as they are ``cycles`` later, straight between samples; the ends are held."""
    if cycles == 0.0:
        return values
    out = np.empty(len(values))
    _moved(np.ascontiguousarray(values), cycles, out)
    return out


@compiled
def _moved(values, cycles, out):
    whole, last = math.floor(cycles), len(values) - 1
    part = cycles - whole
    for k in range(len(out)):
        a, b = min(max(k + whole, 0), last), min(max(k + whole + 1, 0), last)
        out[k] = values[a] + part * (values[b] - values[a])


def cell(sensors, force: np.ndarray, period_s: float) -> np.ndarray:
    """(N,) force behind frame, age and the cell's own lag."""
    if sensors["frame_mode_ratio"] != 0.0:
        out = np.empty(len(force))
        _swung(
            float(sensors["frame_mode_ratio"]),
            float(sensors["frame_hz"]),
            float(sensors["frame_damping_ratio"]),
            force,
            period_s,
            out,
        )
        force = out
    force = moved(force, -float(sensors["force_skew_s"]) / period_s)
    return late(force, float(sensors["force_lag_s"]), period_s)


def late(values: np.ndarray, lag_s: float, period_s: float) -> np.ndarray:
    """(N,) behind a first-order lag, settled at first."""
    if lag_s == 0.0:
        return values
    out = np.empty(len(values))
    _lagged(lag_s, np.ascontiguousarray(values), period_s, out)
    return out


def is_dynamic(sensors) -> bool:
    """Whether frame, age or lag stand between the force and its cell."""
    return (
        sensors["frame_mode_ratio"] != 0.0
        or sensors["force_skew_s"] != 0.0
        or sensors["force_lag_s"] != 0.0
    )


@compiled
def _lagged(lag_s, values, period_s, out):
    decay = math.exp(-period_s / lag_s)
    out[0] = values[0]
    for k in range(1, len(out)):
        out[k] = lagged(out[k - 1], values[k - 1], values[k], lag_s, period_s, decay)


@compiled
def _swung(ratio, frame_hz, damping, force, period_s, out):
    """As models/blocks/instruments.py's ``swung``, along a log."""
    rate = 2.0 * math.pi * frame_hz
    damp = damping * rate
    swing = math.sqrt(rate * rate - damp * damp)
    fade, c, s = (
        math.exp(-damp * period_s),
        math.cos(swing * period_s),
        math.sin(swing * period_s) / swing,
    )
    place, speed = force[0], 0.0
    out[0] = force[0]
    for k in range(1, len(out)):
        slope = (force[k] - force[k - 1]) / period_s
        behind = 2.0 * damping / rate * slope
        away, away_rate = place - force[k - 1] + behind, speed - slope
        place = force[k] - behind + fade * (away * c + (away_rate + damp * away) * s)
        speed = slope + fade * (away_rate * c - (damp * away_rate + rate * rate * away) * s)
        out[k] = force[k] + ratio * (place - force[k])
