"""Errors of readings, and what they may hang on."""

import numpy as np

from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.doubt.states import (
    MOTOR_RAD_S,
    PLACE_RAD_S,
    Shapes,
    calm_force,
    memories,
    minutes,
    modelled_current,
    modelled_gauge,
    waves,
    way,
)
from epa_rt.gap.rig.house.evaluate import Bench

# Of what a reading spans in a log: half widths of its memories, and of what it may be blind to
# around zero.
WIDTHS = (0.003, 0.01, 0.03, 0.1)
BLIND = (0.01, 0.1)
TURNS = (1, 2)  # waves to a turn of the encoder


def _of_any(reading: np.ndarray, rate: np.ndarray) -> Shapes:
    """What a reading of anything may have, whatever its law: zero, scale, bow, lag (another one on
    the way down), a dead zone, and where it came from. ``reading`` and ``rate`` (N,): in parts of
    what counts as one.
    """
    span = max(float(np.ptp(reading)), 1e-12)
    return [
        np.ones(len(reading)),
        reading,
        reading**2,
        reading**3,
        rate,
        np.abs(rate),
        way(rate),
        *(np.clip(reading, -part * span, part * span) / (part * span) for part in BLIND),
        *memories(reading, tuple(part * span for part in WIDTHS)),
    ]


def gauge(bench: Bench, i: int) -> Shapes:
    """Of a pressure: what any reading may have, and drift."""
    q = modelled_gauge(bench, i)
    return [*_of_any(q, smooth.slope(q, bench.prepared.period_s)), minutes(bench)]


def force(bench: Bench) -> Shapes:
    """Of the force: what any reading may have, drift, and what it feels of the pressure."""
    f, q = calm_force(bench, 0), modelled_gauge(bench, 0)
    rate = smooth.slope(f, bench.prepared.period_s)
    return [*_of_any(f, rate), minutes(bench), q, q * q, q * f]


def current(bench: Bench) -> Shapes:
    """Of the current: what any reading may have."""
    c = modelled_current(bench)
    return _of_any(c, smooth.slope(c, bench.prepared.period_s))


def angle(bench: Bench) -> Shapes:
    """Of the motor's angle: out of round, and what any reading may have but a zero."""
    turned, speed, _ = bench.motor()
    return [*waves(turned, TURNS), *_of_any(turned, speed / MOTOR_RAD_S)[1:]]


def place(bench: Bench) -> Shapes:
    """Of the load's place: what any reading may have."""
    s, speed, _ = bench.place()
    return _of_any(s, speed / PLACE_RAD_S)
