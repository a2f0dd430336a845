"""Channels against each other and against their commands: speed and slope, target and position,
signs, swaps.
"""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import si_unit_of
from epa_rt.gap.finding import (
    Finding,
    correlation,
    judged_rows,
    position_pairs,
    regular,
    regular_rows,
    seconds,
    smooth,
    stretches,
)
from epa_rt.gap.hygiene.scale import nearest_factor
from epa_rt.gap.recording import Recording

_SMOOTH_S = 0.02
_GAIN_OFF = 0.3  # |gain - 1| above which it is no sensor's error
_FOREIGN_OFF = 5.0  # the gain above which a speed of others is in another unit
# a position against what it was asked to be: a loop of others may follow badly, not by a factor
# like this; one that is ten times off stays a little below ten
_FOREIGN_GAIN = 5.0
_ALIKE = 0.7  # correlation below which two channels do not show the same motion
_SAME = 0.95  # correlation above which they do, but for sign and size
_APART = 0.08  # of the usual speed: how far speed and slope may be apart ...
_APART_S = 0.1  # ... for so long
_LEAST_MOTION = {"m": 1e-3, "rad": 0.02}


def check_pairs(recording: Recording, rig: Rig | None) -> list[Finding]:
    """Findings on pairs of channels."""
    found = []
    for position, speed in position_pairs(recording, rig):
        found += _speed_and_slope(recording, rig, position, speed)
    if rig is None:
        for position, target in _asked_of_others(recording):
            found += _target(recording, position, target, _SAME, _FOREIGN_GAIN)
    if rig is not None and not found:
        for position, target in _followed(recording, rig):
            found += _target(recording, position, target)
        found += _current(recording, rig)
    return found


def _of(
    recording: Recording, severity: str, kind: str, name: str, sentence: str, rows: list = ()
) -> Finding:
    return Finding(
        severity, kind, recording.name, name, f"{recording.name}: {name}: {sentence}", tuple(rows)
    )


def _speed_and_slope(
    recording: Recording, rig: Rig | None, position: str, speed: str
) -> list[Finding]:
    x, v = regular(recording, position), regular(recording, speed)
    if np.ptp(x) < _LEAST_MOTION["rad" if position.endswith("_rad") else "m"] * (
        1.0 if np.ptp(v) else np.inf
    ):
        return []
    window = round(_SMOOTH_S / recording.period_s)
    slope, v = np.gradient(smooth(x, window), recording.period_s), smooth(v, window)
    alike, gain = correlation(v, slope), float(v @ slope / (slope @ slope))
    if abs(alike) < _ALIKE and rig is None:
        return []  # of a rig of others it is not known what its speed is made of
    if abs(alike) < _ALIKE:
        back = np.gradient(smooth(regular(recording, speed), window), recording.period_s)
        if correlation(smooth(x, window), back) > _ALIKE:
            return [
                _of(
                    recording,
                    "refuse",
                    "swapped",
                    position,
                    f"found it to be the slope of {speed}, expected it the other way round: the two"
                    " are swapped",
                )
            ]
    if alike < -_SAME:
        wrong, why = _stranger(recording, rig, position, speed, gain)
        return [
            _of(
                recording,
                "refuse",
                "sign",
                wrong,
                f"found {speed} against the slope of {position} (correlation {alike:.2f}), expected"
                " the same sign; "
                + (
                    f"{why}: {wrong} looks turned round"
                    if why
                    else f"one of the two looks turned round{_left_out(rig, speed)}"
                ),
            )
        ]
    if alike > _SAME and abs(np.log(gain)) > np.log(1.0 + _GAIN_OFF):
        wrong, why = _stranger(recording, rig, position, speed, gain)
        # a servo of others may make its speed in ways of its own; a wrong unit is further off
        severity = (
            "refuse" if rig is not None or not 1.0 / _FOREIGN_OFF < gain < _FOREIGN_OFF else "note"
        )
        return [
            _of(
                recording,
                severity,
                "units",
                wrong,
                f"found {speed} to be {gain:.4g} times the slope of {position}, expected 1; "
                + (
                    f"{why}: {wrong} looks off by"
                    f" {nearest_factor(gain if wrong != position else 1.0 / gain, si_unit_of(wrong))}"  # noqa: E501
                    if why
                    else (
                        f"{speed} looks off by {nearest_factor(gain, si_unit_of(speed))}, or"
                        f" {position} by"
                        f" {nearest_factor(1.0 / gain, si_unit_of(position))}{_left_out(rig, speed)}"  # noqa: E501
                    )
                ),
            )
        ]
    if rig is None:
        return []
    usual = min(
        np.percentile(np.abs(v), 99.0), np.percentile(np.abs(slope), 99.0)
    )  # a jump of one of them is not usual
    apart = np.abs(v - gain * slope) > _APART * usual if usual > 0.0 else np.zeros(len(v), bool)
    long = [(a, b) for a, b in stretches(apart) if b - a >= round(_APART_S / recording.period_s)]
    if not long:
        return []
    rows = [
        tuple(
            np.searchsorted(
                recording.cycle - recording.cycle[0], (max(a - window, 0), b + window)
            ).tolist()
        )
        for a, b in long
    ]
    a = long[0][0]
    return [
        _of(
            recording,
            "exclude",
            "disagree",
            name,
            f"found {speed} at {v[a]:.4g} and the slope of {position} at {slope[a]:.4g} at"
            f" {seconds(recording, min(rows[0][0], recording.samples - 1)):.3f} s ({len(long)}"
            " stretches), expected the same: one of the two is frozen, cut off or jumps; they are"
            " left out",
            rows,
        )
        for name in (position, speed)
    ]


def _stranger(
    recording: Recording, rig: Rig | None, position: str, speed: str, gain: float
) -> tuple[str, str]:
    """Which of position and speed is off, and why: the one that does not follow its target, the
    other where it does. Without a target '' as why, and of a rig of others the position, which it
    may use, where no kind of rig uses a speed.
    """
    if rig is None:
        return _stranger_of_others(recording, position, speed, gain)
    for name, target in ((position, rig.motor.position_target), (speed, rig.motor.speed_target)):
        if target in recording.columns and np.ptp(recording.columns[target]) > 0.0:
            found = _gain(recording, name, target)
            if found is not None and found[0] > _ALIKE:
                fits = abs(np.log(abs(found[1]))) < 0.5 and found[1] > 0
                return (
                    {position: speed, speed: position}[name] if fits else name
                ), f"{name} {'fits' if fits else 'does not fit'} {target}"
            if found is not None and found[0] < -_ALIKE:
                return name, f"{name} does not fit {target}"
    return speed, ""


def _stranger_of_others(
    recording: Recording, position: str, speed: str, gain: float
) -> tuple[str, str]:
    """As ``_stranger``: the position is right where it follows its target more nearly than it would
    with the mistake that the speed shows.
    """
    for target in (target for name, target in _asked_of_others(recording) if name == position):
        found = _gain(recording, position, target)
        if found is None or abs(found[0]) < _ALIKE:
            continue
        size = abs(found[1])
        fits = found[1] > 0.0 and (gain < 0.0 or abs(np.log(size)) < abs(np.log(size * gain)))
        return (
            speed if fits else position
        ), f"{position} {'fits' if fits else 'does not fit'} {target}"
    return position, ""


def _left_out(rig: Rig | None, speed: str) -> str:
    """What may be done where it cannot be told which one is off."""
    return (
        f" (where it is {speed}: no kind of rig reads it, import the log without that column)"
        if rig is None
        else ""
    )


def _followed(recording: Recording, rig: Rig) -> list[tuple[str, str]]:
    """(measured, target or reference) that a loop keeps together."""
    pairs = [
        (rig.motor.position, rig.motor.position_target),
        (rig.motor.position, f"ref_{rig.motor.position}"),
        (rig.motor.speed, rig.motor.speed_target),
    ]
    if rig.joint is not None:
        pairs.append((rig.joint.position, f"ref_{rig.joint.position}"))
    return [(a, b) for a, b in pairs if a in recording.columns and b in recording.columns]


def _gain(recording: Recording, name: str, target: str) -> tuple[float, float] | None:
    """Correlation and gain of a channel against its target, on rows where the target moves; None
    where it hardly does.
    """
    rows = (
        judged_rows(recording)
        & np.isfinite(recording.columns[name])
        & np.isfinite(recording.columns[target])
    )
    y, u = recording.columns[name][rows], recording.columns[target][rows]
    if len(u) < 200 or np.ptp(u) == 0.0:
        return None
    live = np.abs(u - np.median(u)) > 0.05 * np.ptp(u)
    if live.sum() < 100:
        return None
    y, u = y[live] - y[live].mean(), u[live] - u[live].mean()
    return (correlation(y, u), float(y @ u / (u @ u))) if u @ u > 0.0 else None


def _asked_of_others(recording: Recording) -> list[tuple[str, str]]:
    """Positions and what they were asked to be, by their names."""
    return [
        (name, kind + name)
        for name in recording.columns
        if name.endswith(("_position_m", "_position_rad", "_angle_rad"))
        for kind in ("ref_", "cmd_")
        if kind + name in recording.columns
    ]


def _target(
    recording: Recording, name: str, target: str, least: float = _ALIKE, most: float = 3.0
) -> list[Finding]:
    """Sign and size of a channel against its target, where they are alike by ``least``; ``most``: a
    gain that is no control error.
    """
    found = _gain(recording, name, target)
    if found is None:
        return []
    alike, gain = found
    span = np.ptp(
        recording.columns[target][judged_rows(recording) & np.isfinite(recording.columns[target])]
    )
    if span < (0.02 if name.endswith(("_rad", "_m_s")) else 2e-3):
        return []
    if alike < -least:
        return [
            _of(
                recording,
                "refuse",
                "sign",
                name,
                f"found it against {target} (correlation {alike:.2f}), expected it to follow",
            )
        ]
    if alike > least and not 1.0 / most < gain < most:
        return [
            _of(
                recording,
                "refuse",
                "units",
                name,
                f"found {gain:.4g} times the motion of {target}, expected it to follow; it looks"
                f" off by {nearest_factor(gain, si_unit_of(name))}",
            )
        ]
    return []


def _current(recording: Recording, rig: Rig) -> list[Finding]:
    """Current against the motor's acceleration: an inertia is positive."""
    motor = rig.motor
    if None in (motor.current, motor.speed) or not {
        motor.current,
        motor.speed,
        motor.position,
    } <= set(recording.columns):
        return []
    window = round(_SMOOTH_S / recording.period_s)
    trial = regular_rows(recording, judged_rows(recording, trials_only=True))
    v = smooth(regular(recording, motor.speed), window)
    i, a = (
        smooth(regular(recording, motor.current), window)[trial],
        np.gradient(v, recording.period_s)[trial],
    )
    x = regular(recording, motor.position)[trial]
    if len(i) < 500 or np.ptp(a) == 0.0 or np.ptp(i) == 0.0:
        return []
    load = [
        regular(recording, row.name)[trial]
        for row in rig.inputs
        if row.name.endswith("_n") and row.name in recording.columns
    ]
    basis = np.column_stack([a, v[trial], x, *load, np.ones(len(a))])
    scale = np.where(np.ptp(basis, axis=0) > 0.0, basis.std(axis=0), 1.0)
    basis = basis / np.where(scale > 0.0, scale, 1.0)
    weights = np.linalg.lstsq(basis, i, rcond=None)[0]
    explained = 1.0 - np.var(i - basis @ weights) / np.var(i)
    if (
        explained > 0.6
        and weights[0] < -0.3 * np.std(i)
        and all(w < 0.0 for w in weights[3 : 3 + len(load)])
    ):
        return [
            _of(
                recording,
                "refuse",
                "sign",
                motor.current,
                "found a current that falls where the motor speeds up and the load grows (it"
                f" explains {explained:.0%}), expected it to grow",
            )
        ]
    return []
