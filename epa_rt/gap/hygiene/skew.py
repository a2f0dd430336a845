"""Time skew between channels: how late one shows what the others show, to a fraction of a cycle."""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.finding import (
    Finding,
    judged_rows,
    position_pairs,
    regular,
    regular_rows,
    smooth,
    stretches,
)
from epa_rt.gap.recording import Recording

_SPEED_CYCLES = 6.0  # a drive makes speed from position within a few cycles
_SEARCH_S = 0.1
_SLOW_S = 0.1  # slower than this is gas, creep and friction, no skew
_FAST_S = 0.01
_ALIKE = 0.8
_LEAST_ROWS = 1500
_SENSOR_S = 0.012  # lags of gas, braid and sensors mostly stay below
_CURRENT_S = 0.006  # a current makes its acceleration at once
# what a rig may do by itself: a knee whose muscles damp more than the plant file's showed 13 and 18
# ms, a current with pre-sliding friction 13
_SURE_S = 0.025
_MOST_ROWS = 8000
_EXPLAINED = 0.9  # by the other channels, at the best shift
_SHARPER = 0.5  # what is unexplained there, over what is without a shift
_EVERY_S = 0.004


def check_skew(recording: Recording, rig: Rig | None) -> list[Finding]:
    """Findings on delays between measured channels."""
    rows = regular_rows(recording, judged_rows(recording, trials_only=True))
    if rig is None or rows.sum() < _LEAST_ROWS:
        return []
    for position, speed in position_pairs(recording, rig):
        slope = np.gradient(regular(recording, position), recording.period_s)
        lag_s, alike = lag_of(regular(recording, speed), slope, rows, recording.period_s)
        if abs(lag_s) > _SPEED_CYCLES * recording.period_s and abs(alike) > _ALIKE:
            return [
                _skewed(
                    recording,
                    speed,
                    f"the slope of {position}",
                    lag_s,
                    f"correlation {alike:.2f}",
                    _SPEED_CYCLES * recording.period_s,
                    sure=True,
                )
            ]
    shifts = {name: shift_of(recording, rig, name, rows) for name in sensors(recording, rig)}
    most_s = {name: _CURRENT_S if name == rig.motor.current else _SENSOR_S for name in shifts}
    off = {
        name: found
        for name, found in shifts.items()
        if abs(found[0]) > most_s[name] and found[1] > _EXPLAINED and found[2] < _SHARPER
    }
    if not off:
        return []
    name = min(
        off, key=lambda n: off[n][2]
    )  # a late channel also spoils what is explained by it, but less
    # a law of the catalogue: it is read late, or the pressures are that show where the joint goes
    is_joint = rig.joint is not None and name == rig.joint.position
    is_law = name != rig.motor.current and (off[name][0] > 0.0 or is_joint)
    # better and better up to the end of the search: a channel that drifts looks the same
    is_seen = abs(off[name][0]) < _reach(recording.period_s) * recording.period_s
    return [
        _skewed(
            recording,
            name,
            "the other channels",
            off[name][0],
            f"shifted so they explain {off[name][1]:.1%} of it",
            most_s[name],
            abs(off[name][0]) > _SURE_S and not is_law and is_seen,
        )
    ]


def _reach(period_s: float) -> int:
    """Rows either way in which a delay is searched."""
    return max(round(_SEARCH_S / period_s), 2)


def lag_of(
    late: np.ndarray, early: np.ndarray, rows: np.ndarray, period_s: float
) -> tuple[float, float]:
    """How much ``late`` comes after ``early`` in s, and how alike they then are (correlation, with
    its sign).

    Both pass a band-pass without delay first. Between two cycles a parabola through the peak gives
    the fraction.
    """
    a, b = (_band(values, period_s) * rows for values in (late, early))
    reach = _reach(period_s)
    size = 1 << (2 * len(a) - 1).bit_length()
    cross = np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size)
    cross = np.concatenate([cross[-reach:], cross[: reach + 1]])
    power = np.sqrt((a @ a) * (b @ b))
    if power == 0.0:
        return 0.0, 0.0
    peak = int(np.argmax(np.abs(cross)))
    sign = 1.0 if cross[peak] > 0.0 else -1.0
    return (peak - reach + _vertex(sign * cross, peak)) * period_s, float(cross[peak] / power)


def sensors(recording: Recording, rig: Rig) -> list[str]:
    """Channels that other channels explain: forces, pressures, current, joint."""
    names = [row.name for row in rig.inputs if row.name.endswith("_n")] + [
        muscle.pressure for muscle in rig.muscles
    ]
    names += [rig.motor.current] if rig.motor.current else []
    names += [rig.joint.position] if rig.joint else []
    return [
        name
        for name in names
        if name in recording.columns and np.ptp(regular(recording, name)) > 0.0
    ]


def shift_of(
    recording: Recording, rig: Rig, name: str, rows: np.ndarray
) -> tuple[float, float, float]:
    """(delay in s of a channel against the others, share of it that they then explain, unexplained
    then over unexplained now).

    The others go in as values, slopes, directions and, with motion, products: a line through them
    holds for small motions.
    """
    period_s = recording.period_s
    reach = _reach(period_s)
    every = max(round(_EVERY_S / period_s), int(rows.sum()) // _MOST_ROWS, 1)
    parts = [
        np.arange(a + reach, b - reach, every) for a, b in stretches(rows) if b - a > 4 * reach
    ]
    picked = np.concatenate(parts or [np.zeros(0, int)])
    trial = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    if len(picked) < 300:
        return 0.0, 0.0, 1.0
    basis = _centred(np.column_stack(_basis(recording, rig, name))[picked], trial)
    scale = basis.std(axis=0)
    q = np.linalg.qr(basis[:, scale > 1e-12 * scale.max()] / scale[scale > 1e-12 * scale.max()])[0]
    own = smooth(regular(recording, name), round(_FAST_S / period_s))
    steps = np.arange(-reach, reach + 1, max(round(0.5 * _EVERY_S / period_s), 1))
    left, total = np.empty(len(steps)), np.empty(len(steps))
    for i, step in enumerate(steps):
        y = _centred(own[picked + step][:, None], trial)[:, 0]
        total[i] = y @ y
        left[i] = total[i] - np.sum((q.T @ y) ** 2)
    share = left / np.maximum(total, 1e-300)
    best = int(np.argmin(share))
    now = share[int(np.argmin(np.abs(steps)))]
    delay = (steps[best] + _vertex(-share, best) * (steps[1] - steps[0])) * period_s
    return float(delay), float(1.0 - share[best]), float(share[best] / max(now, 1e-12))


def _basis(recording: Recording, rig: Rig, name: str) -> list[np.ndarray]:
    window = round(_FAST_S / recording.period_s)
    motions = [rig.motor.position] + ([rig.joint.position] if rig.joint else [])
    others = [
        n for n in [*motions, *sensors(recording, rig)] if n != name and n in recording.columns
    ]
    columns, moving = [], []
    for other in dict.fromkeys(others):
        value = smooth(regular(recording, other), window)
        columns.append(value)
        if other in motions:
            slope = np.gradient(value, recording.period_s)
            columns += [
                slope,
                np.gradient(slope, recording.period_s),
                np.tanh(slope / max(0.1 * np.std(slope), 1e-12)),
                value**2,
            ]
            moving.append(value)
    pressures = [
        smooth(regular(recording, m.pressure), window) for m in rig.muscles if m.pressure in others
    ]
    return columns + [p * x for p in pressures for x in moving]


def _centred(columns: np.ndarray, trial: np.ndarray) -> np.ndarray:
    """Less the mean of each trial: the amount of air differs from one to the next."""
    out = columns.astype(float)
    for k in np.unique(trial):
        out[trial == k] -= out[trial == k].mean(axis=0)
    return out


def _vertex(values: np.ndarray, peak: int) -> float:
    """Where the parabola through a maximum and its neighbours has its top, in steps from it."""
    if not 0 < peak < len(values) - 1:
        return 0.0
    left, top, right = values[peak - 1 : peak + 2]
    bend = left - 2.0 * top + right
    return float(0.5 * (left - right) / bend) if bend < 0.0 else 0.0


def _band(values: np.ndarray, period_s: float) -> np.ndarray:
    return smooth(values, round(_FAST_S / period_s)) - smooth(values, round(_SLOW_S / period_s))


def _skewed(
    recording: Recording, name: str, other: str, lag_s: float, how: str, most_s: float, sure: bool
) -> Finding:
    """Not ``sure``: a reading that comes late, or the rig's own damping or friction may do it, and
    the diagnosis goes on.
    """
    what = "after" if lag_s > 0.0 else "before"
    says = (
        f"{recording.name}: {name}: found it {abs(lag_s) * 1e3:.2f} ms"
        f" ({abs(lag_s) / recording.period_s:.1f} cycles) {what} {other} ({how}), expected at most"
        f" {most_s * 1e3:g} ms between channels of one rig"
    )
    may_be = "its stamps, a late reading, or the rig's own damping and friction; taken as it is"
    return Finding(
        "refuse" if sure else "note",
        "skew",
        recording.name,
        name,
        says if sure else f"{says}: {may_be}",
    )
