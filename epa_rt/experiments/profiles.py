"""Motion profiles: pure functions of the time since a phase began, so that they can be drawn before
anything moves.

A position here is whatever a loop controls: m of motor travel, rad of a joint, N*m of motor torque;
a speed is its rate in 1/s. Profiles made of polynomial pieces are in this file, random ones in
random_speed, periodic ones in oscillations.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

Coefficients = tuple[
    float, float, float, float, float, float
]  # of 1, u, ... u^5; u: seconds since the piece began
Piece = tuple[float, Coefficients]  # how long it lasts in s, and its polynomial

# a quintic move of length d in T: speed peaks at 15/8 d/T, acceleration at 10/sqrt(3) d/T^2
QUINTIC_SPEED = 15.0 / 8.0
QUINTIC_ACCELERATION = 10.0 / math.sqrt(3.0)
NO_DISTANCE = 1e-12  # m or rad: rounding, not a motion


class Peaks(NamedTuple):
    """Bounds of a profile: positions within [low, high], |speed| and |acceleration| at most so much
    (SI).
    """

    low: float
    high: float
    speed: float
    acceleration: float


class Profile(Protocol):
    """``at`` and ``sample`` agree to rounding; from ``duration_s`` on the profile rests at
    ``end``.
    """

    duration_s: float
    end: float

    @property
    def peaks(self) -> Peaks: ...

    def at(self, t_s: float) -> tuple[float, float]: ...

    def sample(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...


class Pieces:
    """Polynomials in a row; the classes below differ only in how they lay them. ``size``: how
    many.
    """

    def __init__(self, pieces: Sequence[Piece], end: float, peaks: Peaks):
        self.end, self.peaks = end, peaks
        self.size = len(pieces)
        self._starts: list[float] = []
        self._pieces: list[tuple[float, ...]] = []
        begin = 0.0
        for length_s, coefficients in pieces:
            self._starts.append(begin)
            self._pieces.append((begin, *coefficients))
            begin += length_s
        self.duration_s = begin

    def at(self, t_s: float) -> tuple[float, float]:
        """Position and speed at a time in s; before the start as at the start."""
        if t_s < 0.0:
            t_s = 0.0
        if t_s >= self.duration_s:
            return self.end, 0.0
        begin, c0, c1, c2, c3, c4, c5 = self._pieces[bisect_right(self._starts, t_s) - 1]
        u = t_s - begin
        return (
            c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5)))),
            c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * (5.0 * c5)))),
        )

    def sample(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As ``at`` for an array of times in s."""
        t_s = np.maximum(np.asarray(t_s, dtype=float), 0.0)
        if not self._pieces:
            return np.full(t_s.shape, self.end), np.zeros(t_s.shape)
        index = np.searchsorted(self._starts, t_s, side="right") - 1
        begin, c0, c1, c2, c3, c4, c5 = np.array(self._pieces).T[:, index]
        u = t_s - begin
        over = t_s >= self.duration_s
        u[over] = 0.0
        positions = c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5))))
        speeds = c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * (5.0 * c5))))
        return np.where(over, self.end, positions), np.where(over, 0.0, speeds)


class Hold(Pieces):
    """Rests at a position; the duration in s says only how long a phase wants it."""

    def __init__(self, position: float, duration_s: float = 0.0):
        pieces = [(duration_s, constant(position))] if duration_s > 0.0 else []
        super().__init__(pieces, position, Peaks(position, position, 0.0, 0.0))


class Move(Pieces):
    """From rest to rest along a quintic, as fast as the limits on |speed| and |acceleration| (SI)
    let it.
    """

    def __init__(self, start: float, end: float, speed_max: float, acceleration_max: float):
        length_s = move_s(start, end, speed_max, acceleration_max)
        pieces = [(length_s, quintic(start, end, length_s))] if length_s > 0.0 else []
        super().__init__(pieces, end, path_peaks([start, end], length_s))


class Staircase(Pieces):
    """Goes from level to level by moves and rests ``dwell_s`` on each."""

    def __init__(
        self,
        start: float,
        levels: Sequence[float],
        dwell_s: float,
        speed_max: float,
        acceleration_max: float,
    ):
        lengths = [
            move_s(a, b, speed_max, acceleration_max)
            for a, b in zip([start, *levels], levels, strict=False)
        ]
        super().__init__(*_stairs(start, levels, lengths, dwell_s))


class Step(Pieces):
    """Rests ``dwell_s``, then jumps from level to level, each jump with a finite slope that takes
    ``rise_s``.
    """

    def __init__(self, start: float, levels: Sequence[float], dwell_s: float, rise_s: float):
        levels = [start, *levels]
        lengths = [
            rise_s if abs(a - b) >= NO_DISTANCE else 0.0
            for a, b in zip([start, *levels], levels, strict=False)
        ]
        super().__init__(*_stairs(start, levels, lengths, dwell_s))


class Braking(Pieces):
    """From a position, speed and acceleration to rest, without a step of the acceleration at either
    end (SI).

    ``deceleration`` (above zero) is what braking from the speed alone would reach. The speed falls
    as a cubic, so that a feedforward of the acceleration does not jump when the operator asks to
    stop.
    """

    SHORTEST_S = 0.1  # takes the acceleration away where there is hardly any speed left to brake

    def __init__(
        self, position: float, speed: float, deceleration: float, acceleration: float = 0.0
    ):
        length_s = 1.5 * abs(speed) / deceleration
        if acceleration != 0.0:
            length_s = max(length_s, self.SHORTEST_S)
        if length_s < 1e-9:
            super().__init__([], position, Peaks(position, position, 0.0, 0.0))
            return
        end = position + 0.5 * speed * length_s + acceleration * length_s**2 / 12.0
        piece = (
            position,
            speed,
            0.5 * acceleration,
            -speed / length_s**2 - 2.0 / 3.0 * acceleration / length_s,
            0.5 * speed / length_s**3 + 0.25 * acceleration / length_s**2,
            0.0,
        )
        fastest = abs(speed) + 4.0 / 27.0 * abs(acceleration) * length_s
        reach = fastest * length_s
        low, high = min(position, end), max(position, end)
        if speed * acceleration < 0.0:  # it may turn round on its way
            low, high = max(low - reach, position - reach), min(high + reach, position + reach)
        super().__init__(
            [(length_s, piece)],
            end,
            Peaks(low, high, fastest, 1.5 * abs(speed) / length_s + abs(acceleration)),
        )


class Blended:
    """A planned profile entered from ``offset`` beside its start; the offset fades within
    ``over_s``.
    """

    def __init__(self, planned: Profile, offset: float, over_s: float):
        self.duration_s, self.end = planned.duration_s, planned.end
        over_s = min(over_s, planned.duration_s)
        self._planned, self._fade = (
            planned,
            Pieces(
                [(over_s, quintic(offset, 0.0, over_s))], 0.0, path_peaks([offset, 0.0], over_s)
            ),
        )

    @property
    def peaks(self) -> Peaks:
        planned, fade = self._planned.peaks, self._fade.peaks
        return Peaks(
            planned.low + fade.low,
            planned.high + fade.high,
            planned.speed + fade.speed,
            planned.acceleration + fade.acceleration,
        )

    def at(self, t_s: float) -> tuple[float, float]:
        position, speed = self._planned.at(t_s)
        if t_s >= self._fade.duration_s:
            return position, speed
        offset, rate = self._fade.at(t_s)
        return position + offset, speed + rate

    def sample(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        positions, speeds = self._planned.sample(t_s)
        offsets, rates = self._fade.sample(t_s)
        return positions + offsets, speeds + rates


def constant(position: float) -> Coefficients:
    return position, 0.0, 0.0, 0.0, 0.0, 0.0


def quintic(start: float, end: float, length_s: float) -> Coefficients:
    """The polynomial from rest at ``start`` to rest at ``end``, without acceleration at both."""
    distance = end - start
    return (
        start,
        0.0,
        0.0,
        10.0 * distance / length_s**3,
        -15.0 * distance / length_s**4,
        6.0 * distance / length_s**5,
    )


def move_s(start: float, end: float, speed_max: float, acceleration_max: float) -> float:
    """Seconds that a quintic move takes within limits on speed and acceleration (SI)."""
    distance = abs(end - start)
    if distance < NO_DISTANCE:
        return 0.0
    return max(
        QUINTIC_SPEED * distance / speed_max,
        math.sqrt(QUINTIC_ACCELERATION * distance / acceleration_max),
    )


def path_peaks(levels: Sequence[float], *lengths_s: float) -> Peaks:
    """Bounds of quintic moves through levels, each of which takes so many s."""
    moves = [
        (abs(b - a), length)
        for a, b, length in zip(levels, levels[1:], lengths_s, strict=False)
        if length > 0.0
    ]
    return Peaks(
        min(levels),
        max(levels),
        max((QUINTIC_SPEED * d / t for d, t in moves), default=0.0),
        max((QUINTIC_ACCELERATION * d / t**2 for d, t in moves), default=0.0),
    )


def _stairs(
    start: float, levels: Sequence[float], lengths: Sequence[float], dwell_s: float
) -> tuple[list[Piece], float, Peaks]:
    pieces: list[Piece] = []
    before = start
    for level, length_s in zip(levels, lengths, strict=True):
        if length_s > 0.0:
            pieces.append((length_s, quintic(before, level, length_s)))
        pieces.append((dwell_s, constant(level)))
        before = level
    return pieces, before, path_peaks([start, *levels], *lengths)
