"""Periodic profiles about a mean, faded in and out: chirp, sine, multisine."""

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from epa_rt.experiments.profiles import Peaks

_AT_ONCE = 100_000  # points of a profile that are looked at together

Trigonometry = Callable[[Any], Any]


class Oscillation:
    """A wave of unit height times an amplitude, about a mean, at rest at both ends. A wave lies
    within [-1, 1].

    The fades are quintic, so that acceleration has no jump where they begin and end.
    """

    def __init__(
        self,
        mean: float,
        amplitude: float,
        duration_s: float,
        fade_s: float,
        frequency_max_hz: float,
    ):
        if not 0.0 < fade_s <= 0.5 * duration_s:
            raise ValueError(
                "found a fade that does not fit, expected one above zero and at most half of the"
                " duration"
            )
        self.mean, self.amplitude, self.duration_s, self.fade_s = (
            mean,
            amplitude,
            duration_s,
            fade_s,
        )
        self.end, self._frequency_max_hz = mean, frequency_max_hz
        self._fade_out_s = duration_s - fade_s

    def _wave(self, t_s: Any, sin: Trigonometry, cos: Trigonometry) -> tuple[Any, Any]:
        """Height and its rate; one formula for a float and for an array."""
        raise NotImplementedError

    def at(self, t_s: float) -> tuple[float, float]:
        """Position and speed at a time in s."""
        if t_s <= 0.0 or t_s >= self.duration_s:
            return self.mean, 0.0
        wave, rate = self._wave(t_s, math.sin, math.cos)
        amplitude = self.amplitude
        if self.fade_s <= t_s <= self._fade_out_s:
            return self.mean + amplitude * wave, amplitude * rate
        weight, slope = self._weight(min(t_s, self.duration_s - t_s))
        if t_s > self._fade_out_s:
            slope = -slope
        return self.mean + amplitude * weight * wave, amplitude * (weight * rate + slope * wave)

    def sample(self, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As ``at`` for an array of times in s."""
        t_s = np.clip(np.asarray(t_s, dtype=float), 0.0, self.duration_s)
        wave, rate = self._wave(t_s, np.sin, np.cos)
        weight, slope = self._weight(
            np.minimum(np.minimum(t_s, self.duration_s - t_s), self.fade_s)
        )
        slope = np.where(t_s > self._fade_out_s, -slope, slope)
        return self.mean + self.amplitude * weight * wave, self.amplitude * (
            weight * rate + slope * wave
        )

    def _weight(self, t_s: Any) -> tuple[Any, Any]:
        s = t_s / self.fade_s
        return s * s * s * (10.0 + s * (6.0 * s - 15.0)), 30.0 * (s * (1.0 - s)) ** 2 / self.fade_s

    @cached_property
    def peaks(self) -> Peaks:
        """Positions are bounded by the amplitude; speed and acceleration are read off 100 points
        per period and per fade, some at a time.
        """
        count = int(self.duration_s * 100 * (self._frequency_max_hz + 1.0 / self.fade_s)) + 2
        step_s = self.duration_s / (count - 1)
        speed = change = 0.0
        for first in range(0, count - 1, _AT_ONCE):
            t_s = np.arange(first, min(first + _AT_ONCE + 1, count)) * step_s
            speeds = self.sample(t_s)[1]
            speed = max(speed, float(np.max(np.abs(speeds))))
            change = max(change, float(np.max(np.abs(np.diff(speeds)))))
        reach = abs(self.amplitude)
        return Peaks(self.mean - reach, self.mean + reach, speed, change / step_s)


class Chirp(Oscillation):
    """A sine whose frequency goes linearly from one Hz to another over the whole duration in s."""

    def __init__(
        self,
        mean: float,
        amplitude: float,
        start_hz: float,
        end_hz: float,
        duration_s: float,
        fade_s: float,
    ):
        super().__init__(mean, amplitude, duration_s, fade_s, max(start_hz, end_hz))
        self._rate = 2.0 * math.pi * start_hz
        self._sweep = math.pi * (end_hz - start_hz) / duration_s

    def _wave(self, t_s: Any, sin: Trigonometry, cos: Trigonometry) -> tuple[Any, Any]:
        angle = t_s * (self._rate + self._sweep * t_s)
        return sin(angle), cos(angle) * (self._rate + 2.0 * self._sweep * t_s)


class Sine(Oscillation):
    """A sine of one frequency in Hz."""

    def __init__(
        self, mean: float, amplitude: float, frequency_hz: float, duration_s: float, fade_s: float
    ):
        super().__init__(mean, amplitude, duration_s, fade_s, frequency_hz)
        self._rate = 2.0 * math.pi * frequency_hz

    def _wave(self, t_s: Any, sin: Trigonometry, cos: Trigonometry) -> tuple[Any, Any]:
        angle = t_s * self._rate
        return sin(angle), cos(angle) * self._rate


class Multisine(Oscillation):
    """Equal sines at harmonics of ``1 / period_s``, phases drawn at random: of many draws the one
    that peaks least.

    Scaled so that the sum comes close to the amplitude and never exceeds it. Within a cycle a sum
    of sines would be slow: one period is laid out once in quintic pieces that meet it to 1e-10 of
    the amplitude.
    """

    _DRAWS, _OVERSAMPLING, _CELLS = 200, 16, 64

    def __init__(
        self,
        mean: float,
        amplitude: float,
        harmonics: tuple[int, ...],
        period_s: float,
        duration_s: float,
        fade_s: float,
        seed: int | tuple[int, ...],
    ):
        super().__init__(mean, amplitude, duration_s, fade_s, max(harmonics) / period_s)
        self.harmonics = harmonics
        phases, height = self._draw(seed)
        count = self._CELLS * max(harmonics)
        self.size = count  # cells of the table
        self._cells_per_s, self._count = count / period_s, count
        self._table = self._lay(phases, height, count)
        self._cells = [tuple(row) for row in self._table.tolist()]

    def _draw(self, seed: int | tuple[int, ...]) -> tuple[np.ndarray, float]:
        """Phases of the draw that peaks least, and the height of each line."""
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed)))
        count = 2 * self._OVERSAMPLING * max(self.harmonics)
        angles = 2.0 * np.pi * np.outer(np.arange(count) / count, self.harmonics)
        draws = [2.0 * np.pi * rng.random(len(self.harmonics)) for _ in range(self._DRAWS)]
        peaks = [float(np.max(np.abs(np.sin(angles + draw).sum(axis=1)))) for draw in draws]
        best = min(range(self._DRAWS), key=peaks.__getitem__)
        # between samples a band-limited signal can exceed them, by this factor at the most
        return draws[best], math.cos(0.5 * math.pi / self._OVERSAMPLING) / peaks[best]

    def _lay(self, phases: np.ndarray, height: float, count: int) -> np.ndarray:
        """Coefficients of each cell of one period, in cells: height, slope and curvature met at
        both of its ends.
        """
        per_cell = 2.0 * np.pi * np.array(self.harmonics) / count
        angles = np.outer(np.arange(count + 1), per_cell) + phases
        x, v = height * np.sin(angles).sum(axis=1), height * (np.cos(angles) @ per_cell)
        a = -height * (np.sin(angles) @ per_cell**2)
        rest = x[1:] - x[:-1] - v[:-1] - 0.5 * a[:-1]
        slope, curvature = v[1:] - v[:-1] - a[:-1], a[1:] - a[:-1]
        return np.array(
            [
                x[:-1],
                v[:-1],
                0.5 * a[:-1],
                10.0 * rest - 4.0 * slope + 0.5 * curvature,
                -15.0 * rest + 7.0 * slope - curvature,
                6.0 * rest - 3.0 * slope + 0.5 * curvature,
            ]
        ).T

    def _wave(self, t_s: Any, sin: Trigonometry, cos: Trigonometry) -> tuple[Any, Any]:
        cells = t_s * self._cells_per_s
        if sin is math.sin:
            index = int(cells)
            c0, c1, c2, c3, c4, c5 = self._cells[index % self._count]
        else:
            index = np.floor(cells)
            c0, c1, c2, c3, c4, c5 = self._table[index.astype(int) % self._count].T
        u = cells - index
        return (
            c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5)))),
            self._cells_per_s
            * (c1 + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * (5.0 * c5))))),
        )
