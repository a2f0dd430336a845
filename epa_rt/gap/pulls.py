"""Whether a motor that seems wrong is pulled at wrongly: by a spool whose radius is not what it should be, or by a force that is not read as it is.

The motor's links are fed with the measured force. No law is asked: what they show is explained by the force times anything over the spool's turn
(its radius), by anything that the force's reading may hang on (force, pressure, time, their slopes), or by anything that a motor has itself (its
speed, direction, angle, current). Nominal parameters are free in all three. Of strong faults with known places on benches a spool's radius
explains 1.00 of both links where it is the spool and the motor's own at most 0.82 (0.98 and 0.72 for a bent force cell, whose reading then explains
as much); what a motor does itself its own explains as well as any other (a current's zero: as well as the reading does), or the others explain at most 0.54.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from epa_rt.gap.diagnosis import Place
from epa_rt.gap.floor import Floor
from epa_rt.gap.lengths import solved
from epa_rt.gap.localise import unbiased
from epa_rt.gap.subject import Subject, Values

SURE = 20.0            # deviations from which a link is off
WHOLE, MUCH = 0.97, 0.9  # explained by a radius, by the force's reading
OWN, OWN_MUCH = 0.85, 0.75  # more than that explained by the motor itself: it may be the motor
APART = 0.3            # what a radius leaves over what the reading leaves
SLIDE_RAD_S, STRIBECK_RAD_S = 3.0, 20.0
TINY = 1e-9


class Pulled(NamedTuple):
    """Links fed with the motor's motion and the measured force, link and name of the pressure beside that force, motor turns per spool turn."""

    links: tuple[str, ...]
    gauge: tuple[str, str]
    turns: float


def pull_first(subject: Subject, prepared: Mapping[str, object], values: Values, floors: Mapping[str, Floor], places: Sequence[Place]) -> tuple[Place, ...]:
    """``places`` with the transmission or the force cell first where what the motor's links show is their doing. ``subject.pulled``, where it has one."""
    pulled = getattr(subject, "pulled", None)
    off = {place.link: place for place in places if place.significance > SURE}
    if pulled is None or not places or not set(pulled.links) <= off.keys():
        return tuple(places)
    shares = [_shares(subject, prepared, values, floors[link], link, pulled) for link in pulled.links]
    radius, reading, own = (np.array(share) for share in zip(*shares, strict=True))
    worst = max((off[link] for link in pulled.links), key=lambda place: place.significance)
    if radius.min() > WHOLE and own.max() < OWN and (1.0 - radius < APART * (1.0 - reading)).all():
        return (replace(worst, block="transmission"), *places)
    if places[0].link in pulled.links and reading.min() > MUCH and own.max() < OWN_MUCH:
        return (replace(worst, block="sensors"), *places)
    return tuple(places)


def _shares(subject: Subject, prepared: Mapping[str, object], values: Values, floor: Floor, link: str, pulled: Pulled) -> tuple[float, float, float]:
    """Of a link's excess over noise, what a radius, the force's reading and the motor itself explain."""
    seen = [(unbiased(subject.residual(one, values, link), floor, name),
             dict(subject.features(one, link)) | {"gauge_pa": subject.features(one, pulled.gauge[0])[pulled.gauge[1]]}) for name, one in prepared.items()]

    def share(shape: Callable[[Mapping[str, np.ndarray], float], list[np.ndarray]]) -> float:
        matrix, right, square, samples = 0.0, 0.0, 0.0, 0
        for here, states in seen:
            white = floor.whiten(np.column_stack([here, *_nominal(states), *shape(states, pulled.turns)]))
            white = white[np.isfinite(white).all(axis=1)]
            matrix, right = matrix + white[:, 1:].T @ white[:, 1:], right + white[:, 1:].T @ white[:, 0]
            square, samples = square + float(white[:, 0] @ white[:, 0]), samples + len(white)
        return float(right @ solved(matrix, right, samples)) / max(square - samples, TINY)

    return share(_radius), share(_reading), share(_own)


def _unit(x: np.ndarray) -> np.ndarray:
    return (x - np.nanmean(x)) / max(float(np.nanstd(x)), TINY)


def _nominal(states: Mapping[str, np.ndarray]) -> list[np.ndarray]:
    """What torque constant, inertia, drag and dry friction may take."""
    speed = states["motor_speed_rad_s"]
    return [states["force_n"], states["motor_acceleration_rad_s2"], speed, np.tanh(speed / SLIDE_RAD_S)]


def _radius(states: Mapping[str, np.ndarray], turns: float) -> list[np.ndarray]:
    spool, force = states["motor_angle_rad"] / turns, states["force_n"]
    z = _unit(spool)
    return [force * z, force * z**2, *(force * f(k * spool) for k in (1, 2, 3) for f in (np.sin, np.cos))]


def _reading(states: Mapping[str, np.ndarray], turns: float) -> list[np.ndarray]:
    force, gauge = _unit(states["force_n"]), _unit(states["gauge_pa"])
    return [np.ones(len(force)), force**2, force**3, gauge, gauge**2, force * gauge, states["time_s"], np.gradient(force), np.gradient(gauge)]


def _own(states: Mapping[str, np.ndarray], turns: float) -> list[np.ndarray]:
    angle, speed, current = (states[name] for name in ("motor_angle_rad", "motor_speed_rad_s", "current_a"))
    way = np.tanh(speed / SLIDE_RAD_S)
    wave = [way * f(k * angle / turns) for k in (1, 2) for f in (np.sin, np.cos)]
    cogs = [f(k * angle) for k in (1, 2, 4, 6, 8, 12) for f in (np.sin, np.cos)]
    return [np.ones(len(speed)), way * np.exp(-((speed / STRIBECK_RAD_S) ** 2)), speed * np.abs(speed), current, current * np.abs(current),
            states["current_squared_a2"], way * np.abs(states["force_n"]), *wave, *cogs]
