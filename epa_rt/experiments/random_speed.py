"""A randomised speed that never leaves its range: straight speed ramps between random speeds, held
for random times.
"""

from collections.abc import Iterator

import numpy as np

from epa_rt.experiments.profiles import (
    NO_DISTANCE,
    Coefficients,
    Move,
    Peaks,
    Piece,
    Pieces,
    quintic,
)


class RandomSpeed(Pieces):
    """Random speeds, uniform up to ``speed_max`` and of both signs, each held for a random dwell,
    within [low, high].

    Starts and ends at rest, lasts exactly ``duration_s``; a start outside the range is left by a
    move to its nearer end. Same seed, same profile on every machine. Accelerates at
    ``acceleration`` (SI).
    """

    def __init__(
        self,
        start: float,
        low: float,
        high: float,
        speed_max: float,
        acceleration: float,
        dwell_s: tuple[float, float],
        duration_s: float,
        seed: int | tuple[int, ...],
    ):
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed)))
        pieces: list[Piece] = []
        entry = min(max(start, low), high)
        lead_s = 0.0
        if abs(entry - start) >= NO_DISTANCE:
            lead_s = Move(start, entry, speed_max, acceleration).duration_s
            pieces.append((lead_s, quintic(start, entry, lead_s)))
        if lead_s > duration_s:
            raise ValueError(
                "found a start too far outside the range, expected one that is reached within the"
                " duration"
            )
        walk = _Walk(entry, low, high, acceleration, duration_s - lead_s)
        draws = _draws(rng, speed_max, dwell_s)
        while walk.go(*next(draws), dwell_s[0]):
            pass
        super().__init__(
            pieces + walk.pieces,
            walk.position,
            Peaks(min(start, low), max(start, high), speed_max, acceleration),
        )
        self.duration_s = duration_s  # the sum of the pieces is the same but for rounding


def _draws(
    rng: np.random.Generator, speed_max: float, dwell_s: tuple[float, float]
) -> Iterator[tuple[float, float]]:
    # random() alone: its stream is fixed by PCG64, those of the shaped distributions may change
    # with numpy
    shortest, longest = dwell_s
    while True:
        yield (2.0 * rng.random() - 1.0) * speed_max, shortest + (longest - shortest) * rng.random()


class _Walk:
    """Position and speed so far. It can always brake to rest within the range and within the time
    that is left.
    """

    def __init__(
        self, position: float, low: float, high: float, acceleration: float, remaining_s: float
    ):
        margin = 1e-9 * (high - low)  # so that rounding stays inside too
        self.low, self.high = low + margin, high - margin
        self.position, self.speed, self.remaining_s = position, 0.0, remaining_s
        self.acceleration = acceleration
        self.pieces: list[Piece] = []

    def go(self, speed: float, dwell_s: float, shortest_s: float) -> bool:
        """Ramps to a speed (mirrored and reduced until it fits) and holds it; False once it rests
        at the end.
        """
        while abs(speed) > 1e-6 * self.acceleration:
            for candidate in (speed, -speed):
                ramp_s = abs(candidate - self.speed) / self.acceleration
                spare_s = self.remaining_s - ramp_s - abs(candidate) / self.acceleration
                room_s = min(self._room_s(candidate), spare_s)
                if room_s >= shortest_s:
                    self._ramp(candidate)
                    self._add(min(dwell_s, room_s), (self.position, candidate, 0.0, 0.0, 0.0, 0.0))
                    return True
            speed *= 0.5
        self._ramp(0.0)
        self._add(self.remaining_s, (self.position, 0.0, 0.0, 0.0, 0.0, 0.0))
        return False

    def _room_s(self, speed: float) -> float:
        """Seconds a speed can be held after ramping to it, so that braking afterwards still ends in
        the range.
        """
        after_ramp = (
            self.position + 0.5 * (self.speed + speed) * abs(speed - self.speed) / self.acceleration
        )
        stop = after_ramp + 0.5 * speed * abs(speed) / self.acceleration
        return ((self.high if speed > 0.0 else self.low) - stop) / speed

    def _ramp(self, speed: float) -> None:
        slope = self.acceleration if speed > self.speed else -self.acceleration
        self._add(
            abs(speed - self.speed) / self.acceleration,
            (self.position, self.speed, 0.5 * slope, 0.0, 0.0, 0.0),
        )
        self.speed = speed

    def _add(self, length_s: float, coefficients: Coefficients) -> None:
        if length_s <= 0.0:
            return
        self.pieces.append((length_s, coefficients))
        c0, c1, c2 = coefficients[:3]
        self.position = c0 + length_s * (c1 + length_s * c2)
        self.remaining_s -= length_s
