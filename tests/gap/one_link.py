"""The least that a made-up rig of one link says of itself, and one log of it with white noise."""

from collections.abc import Mapping

import numpy as np

from epa_rt.gap.likelihood.floor import Floor
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Plain


class OneLink(Plain):
    """A subject says the rest: name, links, nominal, catalogue, knobs, residual."""

    rate_hz, without_stop = 100.0, False

    def touched(self, key: str) -> tuple[str, ...]:
        return (self.links[0].name,)

    def prepare(self, recording: Recording) -> Recording:
        return recording


def problem_of(
    subject: OneLink, true: Mapping[str, float], samples: int, noise: float, seed: int = 1
) -> Problem:
    """One trial of the subject with these values."""
    link = subject.links[0]

    def log(reading: np.ndarray) -> Recording:
        return Recording(
            "log",
            "log",
            "",
            "",
            "",
            1.0 / subject.rate_hz,
            np.arange(samples),
            {link.channel: reading},
            (Span("all", 0, samples, True),),
        )

    reading = -subject.residual(
        log(np.zeros(samples)), true, link.name
    ) + noise * np.random.default_rng(seed).standard_normal(samples)
    return Problem(
        subject, [log(reading)], {link.name: Floor(link.name, noise, np.zeros(0), noise)}
    )
