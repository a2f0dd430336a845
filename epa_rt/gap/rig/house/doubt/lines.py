"""Errors of lines, muscles and gas, and what they may hang on: no law among them."""

import numpy as np

from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.doubt.states import (
    PRESSURE_PA,
    TRAVEL_M,
    Shapes,
    calm_force,
    fading,
    line_of,
    memories,
    modelled_gauge,
    spool_force,
    spool_turn,
    waves,
    way,
)
from epa_rt.gap.rig.house.evaluate import Bench
from epa_rt.gap.rig.house.states import since

WIDTHS_M = (5e-5, 2e-4, 8e-4, 3e-3, 1e-2)  # of memories of a length
RELAXING_S, COOLING_S = (0.3, 3.0, 30.0), (0.1, 0.5, 2.0)
TURNS = (1, 2)  # waves to a turn of the spool


def travel(bench: Bench) -> Shapes:
    """Of the way that the spool gives the lines: by its turn, and by where it came from."""
    turn = spool_turn(bench)
    way_m = turn * float(bench.params["transmission"]["spool_radius_m"][0])
    z, stuck = way_m / TRAVEL_M, memories(way_m, WIDTHS_M)
    return [z, z * z, *waves(turn, TURNS), *stuck, *(m * z for m in stuck)]


def radius(bench: Bench) -> Shapes:
    """Of the current that pulls at the spool take, where its radius is another one: the force times
    anything over the spool's turn.
    """
    turn, f = spool_turn(bench), spool_force(bench)
    z = turn * float(bench.params["transmission"]["spool_radius_m"][0]) / TRAVEL_M
    return [f * x for x in (z, z * z, *waves(turn, TURNS))]


def pull(bench: Bench, i: int) -> Shapes:
    """Of a muscle's force: at rest, in motion, by where it came from, by how long ago."""
    (e, v), q, f = line_of(bench, i), modelled_gauge(bench, i), calm_force(bench, i)
    to, stuck = way(v), memories(e * TRAVEL_M, WIDTHS_M)
    static = [np.ones(len(e)), e, e**2, e**3, q, q * q, q * e, q * e**2, q * e**3]
    moving = [to, to * q, to * f, v, v * q, v * np.abs(v)]
    return [
        *static,
        *moving,
        *stuck,
        *(m * q for m in stuck),
        *(m * q * e for m in stuck),
        *fading(e, bench.prepared.period_s, RELAXING_S),
    ]


def stretch(bench: Bench, i: int) -> Shapes:
    """Of a line's length by what pulls at it."""
    f = calm_force(bench, i)
    return [f, f * f]


def volume(bench: Bench, i: int) -> Shapes:
    """Of a muscle's volume over its length."""
    e = line_of(bench, i)[0]
    return [e, e * e]


def swell(bench: Bench, i: int) -> Shapes:
    """Of a muscle's and its tube's volume by the pressure there."""
    q = modelled_gauge(bench, i)
    return [q, q * q]


def gas(bench: Bench, i: int) -> Shapes:
    """Flows while the valves are shut and open, heat, valves that are late."""
    period_s, commands, q = (
        bench.prepared.period_s,
        bench.prepared.commands,
        modelled_gauge(bench, i),
    )
    held, p = (
        since(bench.prepared.shut[i], len(q)) > 0,
        q + float(bench.params["gas"]["atmosphere_pa"][0, i]) / PRESSURE_PA,
    )
    rates = [
        held * 1.0,
        held * q,
        held * q * q,
        *(commands[name][:, i] * by for name in ("inlet", "exhaust") for by in (1.0, q)),
    ]
    volume = bench.volume(i)
    heat = [
        p * x
        for warmed in (np.log(volume), np.log(p * volume))
        for x in fading(warmed, period_s, COOLING_S)
    ]  # compressed, and filled
    return [
        *(np.cumsum(rate) * period_s for rate in rates),
        *heat,
        np.where(held, 0.0, smooth.slope(q, period_s)),
    ]
