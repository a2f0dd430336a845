"""Errors of drive, motor and load, and what they may hang on."""

import numpy as np

from epa_rt.gap.rig.house import load_link, smooth
from epa_rt.gap.rig.house.doubt.states import (
    FORCE_N,
    MOTOR_RAD_S,
    PLACE_RAD_S,
    Shapes,
    memories,
    modelled_current,
    spool_force,
    spool_turn,
    waves,
    way,
)
from epa_rt.gap.rig.house.evaluate import Bench
from epa_rt.gap.rig.house.states import slow

STRIBECK = 0.2  # of the motor's speed, over which dry friction falls
WARMING_S = 4.0
TURNS, COGS = (1, 2), (1, 2, 4, 6, 8, 12)  # waves to a turn of the spool, of the motor
WIDTHS_RAD = (2e-4, 1e-3, 5e-3, 2e-2, 0.1)  # of memories of a joint's angle


def torque(bench: Bench) -> Shapes:
    """Of the current that the motion takes: dry and other friction, waves, heat, whatever hangs on
    the current.
    """
    turned, speed, _ = bench.motor()
    w, c, f = speed / MOTOR_RAD_S, modelled_current(bench), np.abs(spool_force(bench))
    to = way(w)
    dry = [
        to,
        to * np.exp(-((w / STRIBECK) ** 2)),
        to * f,
        *(to * x for x in waves(spool_turn(bench), TURNS)),
    ]
    return [
        np.ones(len(w)),
        *dry,
        w,
        w * np.abs(w),
        c,
        c * np.abs(c),
        c * slow(c * c, bench.prepared.period_s, WARMING_S),
        *waves(turned, COGS),
    ]


def loop(bench: Bench) -> Shapes:
    """Of the current that the commands give: by targets, errors, motion, and their rates."""
    p, (turned, speed, acceleration), c = bench.prepared, bench.motor(), modelled_current(bench)
    wanted = np.ascontiguousarray(p.commands["target_speed_rad_s"], float) / MOTOR_RAD_S
    error = np.where(p.commands["mode"] == 8, p.commands["target_angle_rad"] - turned, 0.0)
    rates = [
        smooth.slope(smooth.flat_smoothed(x, smooth.gaussian_taps(smooth.SLOPE_CYCLES)), p.period_s)
        for x in (wanted, error, c)
    ]
    return [
        np.ones(len(c)),
        wanted,
        speed / MOTOR_RAD_S,
        acceleration / (10.0 * MOTOR_RAD_S),
        error,
        *rates,
        c,
        c * np.abs(speed) / MOTOR_RAD_S,
    ]


def command(bench: Bench) -> Shapes:
    """Targets that come late or early: the speed that is asked for."""
    p = bench.prepared
    asked = smooth.slope(np.ascontiguousarray(p.commands["target_angle_rad"], float), p.period_s)
    return [
        np.where(p.commands["mode"] == 8, asked, p.commands["target_speed_rad_s"]) / MOTOR_RAD_S
    ]


def load(bench: Bench) -> Shapes:
    """Of the load's acceleration: by its place, motion, memory, and by what pulls at it where."""
    s, speed, _ = bench.place()
    acceleration = np.empty(len(s))
    forces = [bench.modelled_force(i) for i in (0, 1)]
    load_link.load_acceleration(
        bench.params, s, speed, *forces, bench.prepared.period_s, acceleration
    )
    v, pulling = (
        speed / PLACE_RAD_S,
        [
            f / FORCE_N
            for f, there in zip(forces, bench.params["muscle"]["present"][0], strict=True)
            if there > 0.5
        ],
    )
    return [
        np.ones(len(s)),
        s,
        s * s,
        s**3,
        v,
        way(v),
        v * np.abs(v),
        acceleration / PLACE_RAD_S,
        *memories(s, WIDTHS_RAD),
        *(f * x for f in pulling for x in (1.0, s, s * s)),
    ]
