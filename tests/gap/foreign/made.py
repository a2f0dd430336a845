"""Clean recordings of component rigs: a motion or a hold, and the output that a subject with known
numbers predicts.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.rig.foreign import open_foreign

RIGS = Path(__file__).resolve().parents[3] / "config/rigs_foreign"
FILES = {
    "carriage": "emps",
    "chamber": "sealed_chamber",
    "piston": "seal_piston",
    "servo": "so101_wrist_roll",
    "shaft": "shaft",
}
# numbers without which some effects act on nothing: a leak to cool, stretch or misread
HOSTS = {"chamber": {"chamber.stand_leak_per_s": 0.02}}


def subject_of(kind: str):
    return open_foreign(RIGS / f"{FILES[kind]}.yaml")


def one_trial(name: str, rig: str, period_s: float, columns: dict[str, np.ndarray]) -> Recording:
    """A recording that is one trial from end to end."""
    count = len(next(iter(columns.values())))
    return Recording(
        name, "", rig, "", "", period_s, np.arange(count), columns, (Span("trial", 0, count, True),)
    )


def _made(subject, period_s: float, columns: dict[str, np.ndarray]) -> Recording:
    return one_trial("made", subject.name, period_s, columns)


def blank(kind: str) -> Recording:
    """A recording with the inputs of a kind; the measured output is zero, or a plain fall for the
    chamber.
    """
    subject = subject_of(kind)
    names = subject.rig.channels
    if kind == "carriage":
        t = np.arange(0.0, 12.0, 2e-3)
        return _made(
            subject,
            2e-3,
            {
                names["position"]: (
                    0.123
                    + 0.08 * np.sin(2 * np.pi * 0.25 * t)
                    + 0.03 * np.sin(2 * np.pi * 0.63 * t + 0.4)
                ),
                names["force"]: np.zeros(len(t)),
            },
        )
    if kind == "shaft":
        t = np.arange(0.0, 12.0, 2e-3)
        return _made(
            subject,
            2e-3,
            {
                names["angle"]: (
                    0.7 * np.sin(2 * np.pi * 0.25 * t) + 0.25 * np.sin(2 * np.pi * 0.63 * t + 0.4)
                ),
                names["torque"]: np.zeros(len(t)),
            },
        )
    if kind == "piston":
        t = np.arange(0.0, 40.0, 0.01)
        return _made(
            subject,
            0.01,
            {
                names["position"]: (
                    0.017
                    - 0.015 * np.cos(2 * np.pi * 0.11 * t)
                    + 0.002 * np.sin(2 * np.pi * 0.43 * t)
                ),
                names["pressure"]: 6e5 + 3e4 * np.sin(2 * np.pi * 0.3 * t),
                names["force"]: np.zeros(len(t)),
            },
        )
    if kind == "chamber":
        t = np.arange(0.0, 90.0, 0.1)
        return _made(
            subject,
            0.1,
            {
                names["pressure"]: np.where(
                    t < 5.0, 8e5, 101_325.0 + 7e5 * np.exp(-0.02 * np.maximum(t - 5.0, 0.0))
                )
            },
        )
    t = np.arange(0.0, 16.0, 0.02)
    steps = 0.6 * np.sign(np.sin(2 * np.pi * t / 4.0)) * np.where(t > 8.0, 0.4, 1.0)
    return _made(
        subject,
        0.02,
        {
            names["command"]: steps + 0.1 * np.sin(2 * np.pi * 0.3 * t),
            names["position"]: np.zeros(len(t)),
        },
    )


def with_output(kind: str, values: dict[str, float]) -> Recording:
    """The clean recording of a rig with these numbers: its residual at them is zero."""
    subject, recording = subject_of(kind), blank(kind)
    link, role = subject.rig.component.links[0]
    name = subject.rig.channels[role]
    component = subject.rig.component
    numbers = {**subject.rig.settings, **subject.plant.numbers, **HOSTS.get(kind, {}), **values}
    for _ in range(
        1 if kind != "chamber" else 15
    ):  # laws of a chamber take the measured pressure: until it is its own answer
        left = component.residual(subject.prepare(recording).work, numbers, link.name)
        recording = replace(
            recording, columns={**recording.columns, name: recording.columns[name] - left}
        )
    return recording
