"""Measured columns as the plant's ports: scaled to SI, gaps bridged, what steps did to still
readings taken back.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.channels import Channel
from epa_rt.gap.rig.house.rounding import unrounded
from epa_rt.gap.rig.house.whole import on_grid

ENCODER = ("motor_angle_rad", "motor_speed_rad_s")


class Readings(NamedTuple):
    """``readings``: port to (N,) what the instrument showed on the gapless grid of cycles. ``bad``:
    port to (N,) bool, where it showed nothing. ``hold``, ``phase``: of the encoder's, cycles from
    one renewal to the next, and the cycle of the first.
    """

    readings: dict[str, np.ndarray]
    bad: dict[str, np.ndarray]
    hold: int
    phase: int


def read(channels: Mapping[str, Channel], hold_s: float, recording: Recording) -> Readings:
    """All of a recording's readings. ``hold_s``: of the encoder's. Raises KeyError where a column
    is missing.
    """
    columns, place = on_grid(recording)
    readings, bad = {}, {}
    for port, channel in channels.items():
        raw = columns[channel.column]
        bad[port] = ~np.isfinite(raw)
        readings[port] = smooth.bridged(raw) * channel.scale + channel.offset
        if channel.floors:
            readings[port] = readings[port] + 0.5 * channel.step  # a counter cuts downward
        if "gauge" in port:
            readings[port] = unrounded(readings[port], channel)
    hold = max(int(hold_s / recording.period_s + 0.5), 1)
    _fill_held(readings, bad, hold)
    _, speed = encoder(readings, int(place[-1]) + 1, recording.period_s)
    return Readings(readings, bad, hold, smooth.hold_phase(speed, hold))


def phase_of(channels: Mapping[str, Channel], hold_s: float, recording: Recording) -> int:
    """On which cycle the encoder renews. Raises KeyError where a column is missing."""
    for channel in channels.values():
        recording.columns[channel.column]  # another one that is missing is as much of an error here
    return read(
        {port: channels[port] for port in ENCODER if port in channels}, hold_s, recording
    ).phase


def encoder(
    readings: Mapping[str, np.ndarray], count: int, period_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """(N,) angle and speed as read; a speed that is not read is the angle's slope."""
    angle = readings["motor_angle_rad"] if "motor_angle_rad" in readings else np.zeros(count)
    return angle, (
        readings["motor_speed_rad_s"]
        if "motor_speed_rad_s" in readings
        else smooth.slope(angle, period_s)
    )


def _fill_held(readings: dict[str, np.ndarray], bad: Mapping[str, np.ndarray], hold: int) -> None:
    """Gaps in the encoder's readings take what another cycle of the same hold has shown: half-way
    between two holds is no reading.
    """
    for port in ENCODER:
        if port in readings and bad[port].any():
            phase = smooth.hold_phase(readings[port], hold)
            readings[port] = smooth.bridged(
                smooth.filled_by_hold(np.where(bad[port], np.nan, readings[port]), hold, phase)
            )
