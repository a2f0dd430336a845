"""Errors of readings, and what they may hang on."""

import numpy as np

from epa_rt.gap.house import smooth
from epa_rt.gap.house.doubt.states import (
    MOTOR_RAD_S,
    PRESSURE_PA,
    Shapes,
    calm_force,
    memories,
    minutes,
    modelled_current,
    modelled_gauge,
    waves,
)
from epa_rt.gap.house.evaluate import Bench

WIDTHS_PA = (90.0, 900.0)  # of memories of a pressure
TURNS = (1, 2)  # waves to a turn of the encoder


def gauge(bench: Bench, i: int) -> Shapes:
    """Of a pressure: zero, scale, bow, lag, drift, and a reading that sticks."""
    q = modelled_gauge(bench, i)
    return [
        np.ones(len(q)),
        q,
        q * q,
        smooth.slope(q, bench.prepared.period_s),
        minutes(bench),
        *memories(q * PRESSURE_PA, WIDTHS_PA),
    ]


def force(bench: Bench) -> Shapes:
    """Of the force: zero, scale, bow, lag, drift, and what it feels of the pressure."""
    f, q = calm_force(bench, 0), modelled_gauge(bench, 0)
    return [
        np.ones(len(f)),
        f,
        f * f,
        f**3,
        smooth.slope(f, bench.prepared.period_s),
        minutes(bench),
        q,
        q * q,
        q * f,
    ]


def current(bench: Bench) -> Shapes:
    """Of the current: zero and scale."""
    c = modelled_current(bench)
    return [np.ones(len(c)), c]


def angle(bench: Bench) -> Shapes:
    """Of the motor's angle: out of round, and late."""
    turned, speed, _ = bench.motor()
    return [*waves(turned, TURNS), speed / MOTOR_RAD_S]


def place(bench: Bench) -> Shapes:
    """Of the load's place: zero, scale, bow."""
    s = bench.place()[0]
    return [np.ones(len(s)), s, s * s]
