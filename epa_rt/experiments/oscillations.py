"""Periodic profiles about a mean, faded in and out: chirp, sine, multisine."""

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from epa_rt.experiments.profiles import Peaks

Trigonometry = Callable[[Any], Any]


class Oscillation:
    """A wave of unit height times an amplitude, about a mean, at rest at both ends. A wave lies within [-1, 1].

    The fades are quintic, so that acceleration has no jump where they begin and end.
    """

    def __init__(self, mean: float, amplitude: float, duration_s: float, fade_s: float, frequency_max_hz: float):
        if not 0.0 < fade_s <= 0.5 * duration_s:
            raise ValueError("found a fade that does not fit, expected one above zero and at most half of the duration")
        self.mean, self.amplitude, self.duration_s, self.fade_s = mean, amplitude, duration_s, fade_s
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
        weight, slope = self._weight(np.minimum(np.minimum(t_s, self.duration_s - t_s), self.fade_s))
        slope = np.where(t_s > self._fade_out_s, -slope, slope)
        return self.mean + self.amplitude * weight * wave, self.amplitude * (weight * rate + slope * wave)

    def _weight(self, t_s: Any) -> tuple[Any, Any]:
        s = t_s / self.fade_s
        return s * s * s * (10.0 + s * (6.0 * s - 15.0)), 30.0 * (s * (1.0 - s)) ** 2 / self.fade_s

    @cached_property
    def peaks(self) -> Peaks:
        """Positions are bounded by the amplitude; speed and acceleration are read off 100 points per period and per fade."""
        count = int(self.duration_s * 100 * (self._frequency_max_hz + 1.0 / self.fade_s)) + 2
        t_s = np.linspace(0.0, self.duration_s, count)
        speeds = self.sample(t_s)[1]
        reach = abs(self.amplitude)
        return Peaks(self.mean - reach, self.mean + reach, float(np.max(np.abs(speeds))),
                     float(np.max(np.abs(np.diff(speeds)))) / float(t_s[1]))


class Chirp(Oscillation):
    """A sine whose frequency goes linearly from one Hz to another over the whole duration in s."""

    def __init__(self, mean: float, amplitude: float, start_hz: float, end_hz: float, duration_s: float, fade_s: float):
        super().__init__(mean, amplitude, duration_s, fade_s, max(start_hz, end_hz))
        self._rate = 2.0 * math.pi * start_hz
        self._sweep = math.pi * (end_hz - start_hz) / duration_s

    def _wave(self, t_s: Any, sin: Trigonometry, cos: Trigonometry) -> tuple[Any, Any]:
        angle = t_s * (self._rate + self._sweep * t_s)
        return sin(angle), cos(angle) * (self._rate + 2.0 * self._sweep * t_s)


class Sine(Oscillation):
    """A sine of one frequency in Hz."""

    def __init__(self, mean: float, amplitude: float, frequency_hz: float, duration_s: float, fade_s: float):
        super().__init__(mean, amplitude, duration_s, fade_s, frequency_hz)
        self._rate = 2.0 * math.pi * frequency_hz

    def _wave(self, t_s: Any, sin: Trigonometry, cos: Trigonometry) -> tuple[Any, Any]:
        angle = t_s * self._rate
        return sin(angle), cos(angle) * self._rate


class Multisine(Oscillation):
    """Equal sines at harmonics of ``1 / period_s``, phases drawn at random: of many draws the one that peaks least.

    Scaled so that the sum reaches the amplitude and never exceeds it. ``at`` costs about 0.15 us per line.
    """

    _DRAWS, _OVERSAMPLING = 200, 16

    def __init__(self, mean: float, amplitude: float, harmonics: tuple[int, ...], period_s: float, duration_s: float,
                 fade_s: float, seed: int | tuple[int, ...]):
        super().__init__(mean, amplitude, duration_s, fade_s, max(harmonics) / period_s)
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed)))
        count = 2 * self._OVERSAMPLING * max(harmonics)
        angles = 2.0 * np.pi * np.outer(np.arange(count) / count, harmonics)
        best, phases = math.inf, ()
        for _ in range(self._DRAWS):
            draw = 2.0 * np.pi * rng.random(len(harmonics))
            peak = float(np.max(np.abs(np.sin(angles + draw).sum(axis=1))))
            if peak < best:
                best, phases = peak, draw
        # between samples a band-limited signal can exceed them, by this factor at the most
        height = math.cos(0.5 * math.pi / self._OVERSAMPLING) / best
        self.harmonics = harmonics
        self._lines = [(2.0 * math.pi * k / period_s, float(phase), height, height * 2.0 * math.pi * k / period_s)
                       for k, phase in zip(harmonics, phases, strict=True)]

    def _wave(self, t_s: Any, sin: Trigonometry, cos: Trigonometry) -> tuple[Any, Any]:
        wave = rate = 0.0
        for angular, phase, height, slope in self._lines:
            angle = t_s * angular + phase
            wave += height * sin(angle)
            rate += slope * cos(angle)
        return wave, rate
