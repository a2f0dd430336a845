"""A rig small enough to know every answer: a force over a damper, with friction that its nominal
plant lacks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from epa_rt.gap.likelihood.floor import Floor, white
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Link, Plain
from epa_rt.models.effect import Effect, Knob

PERIOD_S, VISCOUS, NOISE_N = 1e-3, 5.0, 0.1


def white_floor(rms: float = NOISE_N, source: str = "twin") -> Floor:
    """Of the damper's link."""
    return white("damper", rms, source)


class Damper(Plain):
    """force = viscous * speed + coulomb * sign(speed), plus noise; two trials of ``seconds``
    each.
    """

    name, rate_hz = "damper", 100.0
    links = (Link("damper", "muscle", "force_n", "N", "speed to force"),)
    without_stop = False
    nominal = (Knob("muscle.viscous_n_s_m", "N*s/m", VISCOUS, 0.0, 100.0, 0.5),)
    catalogue = (
        Effect(
            "friction",
            "friction",
            "muscle",
            ("muscle.coulomb_n",),
            ((1.0,),),
            "dry friction",
            "F = c sign v",
            "a book",
        ),
    )
    knobs = {
        knob.key: knob
        for knob in (*nominal, Knob("muscle.coulomb_n", "N", 0.0, 0.0, 50.0, 1.0, "friction"))
    }

    def touched(self, key: str) -> tuple[str, ...]:
        return ("damper",)

    def prepare(self, recording: Recording) -> object:
        return recording

    def residual(self, prepared: Recording, values: Mapping[str, float], link: str) -> np.ndarray:
        difference = prepared.columns["force_n"] - force(prepared.columns["speed_m_s"], values)
        judged = np.zeros(prepared.samples, bool)
        for span in prepared.spans:
            judged[span.start : span.stop] |= span.trial
        return np.where(judged, difference, np.nan).reshape(-1, 10).mean(axis=1)

    def features(self, prepared: Recording, link: str) -> Mapping[str, np.ndarray]:
        return {"speed_m_s": prepared.columns["speed_m_s"].reshape(-1, 10).mean(axis=1)}

    def free_run(
        self, recording: Recording, values: Mapping[str, float], seed: int | None
    ) -> Recording | None:
        columns = dict(
            recording.columns,
            force_n=force(recording.columns["speed_m_s"], values) + noise(recording.samples, seed),
        )
        return replace(recording, columns=columns)

    def patched(self, values: Mapping[str, float], effects: Sequence[str]) -> str:
        return f"values: {dict(values)}\neffects: {list(effects)}\n"


def force(speed: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
    return values.get("muscle.viscous_n_s_m", VISCOUS) * speed + values.get(
        "muscle.coulomb_n", 0.0
    ) * np.sign(speed)


def noise(samples: int, seed: int | None) -> np.ndarray:
    # a tenth of the samples is averaged, so that the mean over 10 ms has NOISE_N
    return (
        np.zeros(samples)
        if seed is None
        else np.sqrt(10.0) * NOISE_N * np.random.default_rng(seed).normal(size=samples)
    )


def recorded(
    values: Mapping[str, float], name: str = "log", seed: int = 7, seconds: float = 20.0
) -> Recording:
    """A log of the rig with these true values."""
    t = np.arange(round(2.0 * seconds / PERIOD_S)) * PERIOD_S
    speed = 0.3 * np.sin(2.0 * np.pi * 0.7 * t) + 0.1 * np.sin(2.0 * np.pi * 1.9 * t + 0.4)
    half = len(t) // 2
    travel = np.cumsum(speed) * PERIOD_S
    columns = {
        "speed_m_s": speed,
        "force_n": force(speed, values) + noise(len(t), seed),
        "travel_m": travel,
        "ref_travel_m": travel + 1e-3,
        "motor_current_a": force(speed, values) / 10.0,
    }
    return Recording(
        name,
        f"{name}.mcap",
        "damper",
        "damper",
        "sine",
        PERIOD_S,
        np.arange(len(t)),
        columns,
        (
            Span("one", 100, half, True),
            Span("rest", half, half + 100, False),
            Span("two", half + 100, len(t), True),
        ),
    )
