"""Time skew between channels: how late one shows what another shows, to a fraction of a cycle."""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.hygiene_finding import Finding, judged_rows, position_pairs, regular, regular_rows, smooth
from epa_rt.gap.recording import Recording

_SPEED_CYCLES = 6.0       # a drive makes speed from position within a few cycles
_SPEED_S = 0.006
_SENSOR_S = 0.02          # gas, braid and sensor lags stay below
_SEARCH_S = 0.06
_SLOW_S = 0.1             # slower than this is gas, creep and friction, no skew
_FAST_S = 0.01
_ALIKE = 0.8
_LEAST_ROWS = 1500


def check_skew(recording: Recording, rig: Rig | None) -> list[Finding]:
    """Findings on delays between measured channels."""
    rows = regular_rows(recording, judged_rows(recording, trials_only=True))
    if rows.sum() < _LEAST_ROWS:
        return []
    found = []
    for position, speed in position_pairs(recording, rig):
        if rig is None:
            continue
        most_s = max(_SPEED_S, _SPEED_CYCLES * recording.period_s)
        slope = np.gradient(regular(recording, position), recording.period_s)
        found += _skewed(recording, speed, position, lag_of(regular(recording, speed), slope, rows, recording.period_s), most_s)
    if rig is not None and not found:
        for name, other in _related(recording, rig):
            found += _skewed(recording, name, other, lag_of(regular(recording, name), regular(recording, other), rows, recording.period_s), _SENSOR_S)
    return found


def lag_of(late: np.ndarray, early: np.ndarray, rows: np.ndarray, period_s: float) -> tuple[float, float]:
    """How much ``late`` comes after ``early`` in s, and how alike they then are (correlation, with its sign).

    Both pass a band-pass without delay first. Between two cycles a parabola through the peak gives the fraction.
    """
    a, b = (_band(values, period_s) * rows for values in (late, early))
    reach = max(round(_SEARCH_S / period_s), 2)
    size = 1 << (2 * len(a) - 1).bit_length()
    cross = np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)
    cross = np.concatenate([cross[-reach:], cross[: reach + 1]])
    power = np.sqrt((a @ a) * (b @ b))
    if power == 0.0:
        return 0.0, 0.0
    peak = int(np.argmax(np.abs(cross)))
    sign = 1.0 if cross[peak] > 0.0 else -1.0
    fraction = 0.0
    if 0 < peak < len(cross) - 1:
        left, top, right = sign * cross[peak - 1 : peak + 2]
        bend = left - 2.0 * top + right
        fraction = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return (peak - reach + fraction) * period_s, float(cross[peak] / power)


def _band(values: np.ndarray, period_s: float) -> np.ndarray:
    return smooth(values, round(_FAST_S / period_s)) - smooth(values, round(_SLOW_S / period_s))


def _related(recording: Recording, rig: Rig) -> list[tuple[str, str]]:
    """Sensors that show the same motion at once: force and pressure against the joint, or the motor where there is none."""
    motion = rig.joint.position if rig.joint is not None else rig.motor.position
    names = [muscle.pressure for muscle in rig.muscles] + [row.name for row in rig.inputs if row.name.endswith("_n")]
    return [(name, motion) for name in names if name in recording.columns and motion in recording.columns]


def _skewed(recording: Recording, name: str, other: str, lag: tuple[float, float], most_s: float) -> list[Finding]:
    lag_s, alike = lag
    if abs(lag_s) <= most_s or abs(alike) < _ALIKE:
        return []
    what = "after" if lag_s > 0.0 else "before"
    return [Finding("refuse", "skew", recording.name, name, f"{recording.name}: {name}: found it {abs(lag_s) * 1e3:.2f} ms ({abs(lag_s) / recording.period_s:.1f} cycles) {what} {other} "
                    f"(correlation {alike:.2f}), expected at most {most_s * 1e3:g} ms between channels of one rig")]
