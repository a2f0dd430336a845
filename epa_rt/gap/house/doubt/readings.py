"""Errors of readings, and what they may hang on."""

import numpy as np

from epa_rt.gap.house import smooth
from epa_rt.gap.house.doubt.states import (
    CURRENT_A,
    FORCE_N,
    MOTOR_RAD_S,
    PLACE_RAD_S,
    PRESSURE_PA,
    Shapes,
    calm_force,
    memories,
    minutes,
    modelled_current,
    modelled_gauge,
    waves,
    way,
)
from epa_rt.gap.house.evaluate import Bench

WIDTHS_PA = (90.0, 900.0)  # of memories of a pressure
WIDTHS_N = (0.3, 1.0, 3.0, 10.0)  # of memories of a force
WIDTHS_A = (0.02, 0.2)  # of memories of a current
WIDTHS_RAD = (1e-3, 1e-2, 0.1)  # of memories of the motor's angle
WIDTHS_PLACE = (1e-4, 1e-3, 1e-2)  # of memories of the load's place, rad or m
DEAD = (0.01, 0.1)  # of a reading, around its zero, in which it may be blind
TURNS = (1, 2)  # waves to a turn of the encoder


def held_back(reading: np.ndarray, period_s: float) -> Shapes:
    """What any reading of something may have: its rate (late), the sign of that, and a dead zone
    around zero. ``reading``: in parts of what counts as one.
    """
    rate = smooth.slope(reading, period_s)
    return [rate, way(rate), *(np.clip(reading, -half, half) / half for half in DEAD)]


def gauge(bench: Bench, i: int) -> Shapes:
    """Of a pressure: zero, scale, bow, lag, dead zone, drift, and a reading that sticks."""
    q = modelled_gauge(bench, i)
    return [
        np.ones(len(q)),
        q,
        q * q,
        *held_back(q, bench.prepared.period_s),
        minutes(bench),
        *memories(q * PRESSURE_PA, WIDTHS_PA),
    ]


def force(bench: Bench) -> Shapes:
    """Of the force: zero, scale, bow, lag, dead zone, drift, where it came from, and what it feels
    of the pressure.
    """
    f, q = calm_force(bench, 0), modelled_gauge(bench, 0)
    return [
        np.ones(len(f)),
        f,
        f * f,
        f**3,
        *held_back(f, bench.prepared.period_s),
        minutes(bench),
        *memories(f * FORCE_N, WIDTHS_N),
        q,
        q * q,
        q * f,
    ]


def current(bench: Bench) -> Shapes:
    """Of the current: zero, scale, bow, lag, dead zone, and where it came from."""
    c = modelled_current(bench)
    return [
        np.ones(len(c)),
        c,
        c * c,
        *held_back(c, bench.prepared.period_s),
        *memories(c * CURRENT_A, WIDTHS_A),
    ]


def angle(bench: Bench) -> Shapes:
    """Of the motor's angle: scale, out of round, late, and where it came from."""
    turned, speed, _ = bench.motor()
    return [
        turned,
        *waves(turned, TURNS),
        speed / MOTOR_RAD_S,
        way(speed / MOTOR_RAD_S),
        *memories(turned, WIDTHS_RAD),
    ]


def place(bench: Bench) -> Shapes:
    """Of the load's place: zero, scale, bow, lag, and where it came from."""
    s, speed, _ = bench.place()
    return [
        np.ones(len(s)),
        s,
        s * s,
        speed / PLACE_RAD_S,
        way(speed / PLACE_RAD_S),
        *memories(s, WIDTHS_PLACE),
    ]
