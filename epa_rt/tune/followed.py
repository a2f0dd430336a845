"""A recorded trial of the motion that a loop is to follow: what other gains would have made of it,
and the feedforward that they need.

The plant is read off the trial itself, for one that rubs answers a large motion otherwise than a
small excitation. What neither command nor plant explains of the output stays as it was. Feedforward
from the inverse of a recorded motion: Lambrechts, Boerlage and Steinbuch, Control Engineering
Practice 13 (2005) 145.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from epa_rt.tune.controller import Controller, Gains, Loop, basis_of, controller_of
from epa_rt.tune.in_time import Trace
from epa_rt.tune.margins import plant_at
from epa_rt.tune.response import Excited, response_of

TERMS = ("feedforward", "feedforward_speed_s", "feedforward_acceleration_s2")
SAME_MOTION = 0.02  # of the reference's height: a sample earlier or later is the same motion
LEAST_SHARE = 1e-3  # of the largest effect of a term: what the motion shows less of, stays


@dataclass(frozen=True)
class Followed:
    """One trial at frequencies (k,) in Hz up to the highest that the response knows.

    ``plant``: at the size of the motion; ``reference`` and ``rest``: spectra of what was wanted and
    of the output that the plant does not explain; ``beyond``: spectrum (m,) of the error above;
    ``trial``: its samples.
    """

    loop: Loop
    frequency_hz: np.ndarray
    plant: np.ndarray
    reference: np.ndarray
    rest: np.ndarray
    beyond: np.ndarray
    trial: Excited

    def tracking(self, gains: Gains) -> float:
        """RMS of reference minus output with these gains, after its mean."""
        power = np.sum(np.abs(self._error(gains)) ** 2) + np.sum(np.abs(self.beyond) ** 2)
        return float(np.sqrt(2.0 * power)) / len(self.trial.output)

    def trace(self, gains: Gains) -> Trace:
        """The trial with these gains, as the response has it: no limit cuts the command, which is
        the recorded one and what these gains change of it.
        """
        reference, count = self.trial.reference, len(self.trial.output)
        after = np.concatenate([[0.0], self._error(gains), self.beyond])
        changed = self._command(gains) - self._command(self.loop.gains)
        return Trace(
            np.arange(count) * self.loop.period_s,
            reference,
            reference - np.fft.irfft(after, count),
            self.trial.command + np.fft.irfft(_padded(changed, count), count),
        )

    def with_feedforward(self, gains: Gains) -> Gains:
        """These gains with the feedforward that tracks best: least squares over its terms. What the
        motion does not tell apart stays as it is.
        """
        closed = self.plant / (1.0 + self.plant * self._controller(gains).feedback)
        base = basis_of(self.loop, gains, self.frequency_hz)
        shapes = np.stack([base.unit, base.speed, base.acceleration], axis=1)
        effects = (closed * self.reference)[:, None] * shapes
        size = np.sqrt(np.sum(np.abs(effects) ** 2, axis=0))
        size[size == 0.0] = np.inf
        columns, wanted = effects / size, self._error(gains)
        found = np.linalg.lstsq(
            np.concatenate([columns.real, columns.imag]),
            np.concatenate([wanted.real, wanted.imag]),
            rcond=LEAST_SHARE,
        )[0]
        more = dict(zip(TERMS, (found / size).tolist(), strict=True))
        return replace(gains, **{name: getattr(gains, name) + v for name, v in more.items()})

    def _controller(self, gains: Gains) -> Controller:
        return controller_of(self.loop, gains, self.frequency_hz)

    def _command(self, gains: Gains) -> np.ndarray:
        controller = self._controller(gains)
        forward, feedback = controller.forward, controller.feedback
        command: np.ndarray = forward * self.reference
        return command - feedback * (self.reference - self._error(gains))

    def _error(self, gains: Gains) -> np.ndarray:
        controller = self._controller(gains)
        answered = self.plant * controller.forward * self.reference + self.rest
        error: np.ndarray = self.reference - answered / (1.0 + self.plant * controller.feedback)
        return error


def _padded(spectrum: np.ndarray, count: int) -> np.ndarray:
    """A spectrum (k,) above its mean, zeros beyond it, for ``count`` samples."""
    whole = np.zeros(count // 2 + 1, complex)
    whole[1 : 1 + len(spectrum)] = spectrum
    return whole


def trial_of(trials: Sequence[Excited], motion: np.ndarray) -> Excited | None:
    """The last trial whose reference is the motion (n,); None where there is none."""
    for trial in reversed(trials):
        count = min(len(trial.reference), len(motion))
        if count < 2 or len(motion) - count > SAME_MOTION * len(motion):
            continue
        away = np.max(np.abs(trial.reference[:count] - motion[:count]))
        if away < SAME_MOTION * np.ptp(motion):
            return trial
    return None


def followed_from(
    loop: Loop, trial: Excited, shape: Callable[[np.ndarray], np.ndarray], highest_hz: float
) -> Followed | None:
    """A trial as data. Where it shows the plant it is believed; elsewhere the plant is ``shape``,
    times what that is off by at the nearest frequency shown. None where it shows nothing.
    """
    shown = response_of([trial], loop.period_s, highest_hz)
    shown = shown.only(shown.sound)
    if not len(shown.frequency_hz):
        return None
    count = len(trial.output)
    frequency = np.fft.rfftfreq(count, loop.period_s)
    inside = int(np.searchsorted(frequency, highest_hz, side="right"))
    reference, command, output = (
        np.fft.rfft(v - np.mean(v)) for v in (trial.reference, trial.command, trial.output)
    )
    hertz = frequency[1:inside]
    plant = plant_at(hertz, shown.frequency_hz, shown.plant, shape)
    return Followed(
        loop,
        hertz,
        plant,
        reference[1:inside],
        output[1:inside] - plant * command[1:inside],
        reference[inside:] - output[inside:],
        trial,
    )
