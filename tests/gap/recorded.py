"""Short logs of the four rigs, each recorded once by the simulated backend, and ways to damage what
was read from them.
"""

import atexit
import dataclasses
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from epa_rt.config.rig import Rig, load_rig
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.rig.read import read_recording
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT, epa_here

PLANTS = ROOT / "config/plants"
EFFECTS = """
effects:
  force_gain: {force_gain: 1.01}
  force_offset: {force_offset: 2 N}
  muscle0_gauge_gain: {muscle0_gauge_gain: 1.01}
  muscle0_gauge_offset: {muscle0_gauge_offset: 3 kPa}
  transport_delay: {command_delay: 4 ms}
  backlash: {backlash: 0.01 rad}
  braid_maxwell_slip: {slip: 0.05}
"""
MASS = (
    ("[580 kPa gauge, 620 kPa gauge, 660 kPa gauge]", "[620 kPa gauge]"),
    ("for: 30 s", "for: 6 s"),
)
STEPS = (("times: 5", "times: 2"),)


@cache
def folder() -> Path:
    made = TemporaryDirectory(prefix="epa_hygiene_")
    atexit.register(made.cleanup)
    return Path(made.name)


def log_of(rig: str, experiment: str, kind: str = "") -> Path:
    """The log of a short run; ``kind``: '' as the plant file is, 'effects' with mild effects,
    'noisy' with five times the noise.
    """
    return _log_of(rig, experiment, kind)


@cache
def _log_of(rig: str, experiment: str, kind: str) -> Path:
    log = folder() / f"{rig}-{experiment}-{kind or 'plain'}.mcap"
    text = (EXPERIMENTS / f"{experiment}.yaml").read_text()
    for old, new in {"mass_sine": MASS, "step": STEPS}.get(experiment, ()):
        assert old in text
        text = text.replace(old, new)
    file = folder() / f"{experiment}.yaml"
    file.write_text(text)
    done = epa_here(
        "run",
        file,
        "--rig",
        RIGS / f"{rig}.yaml",
        "--plant",
        _plant(rig, kind),
        "-o",
        log,
        "--quiet",
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return log


def _plant(rig: str, kind: str) -> Path:
    plant = PLANTS / f"{rig.removesuffix('_analog')}.yaml"
    if not kind:
        return plant
    lines = plant.read_text().split("\n")
    if kind == "noisy":
        lines = [_five_times(line) if "_noise:" in line else line for line in lines]
    path = folder() / f"{plant.stem}_{kind}.yaml"
    path.write_text("\n".join(lines) + (EFFECTS if kind == "effects" else ""))
    return path


def _five_times(line: str) -> str:
    head, _, tail = line.partition(": ")
    number, _, unit = tail.partition(" ")
    return f"{head}: {5 * float(number):g} {unit}"


def recording_of(rig: str, experiment: str, kind: str = "") -> Recording:
    return _recording_of(rig, experiment, kind)


@cache
def _recording_of(rig: str, experiment: str, kind: str) -> Recording:
    return read_recording(log_of(rig, experiment, kind))


@cache
def rig_of_name(name: str) -> Rig:
    return load_rig(RIGS / f"{name}.yaml")


Damage = Callable[[Recording], Recording]


def column(recording: Recording, name: str, values: np.ndarray) -> Recording:
    return dataclasses.replace(recording, columns={**recording.columns, name: values})


def scaled(name: str, factor: float, offset: float = 0.0) -> Damage:
    return lambda r: column(r, name, r.columns[name] * factor + offset)


def written_over(name: str, value: float, start: int = 0, stop: int | None = None) -> Damage:
    """Rows of a channel set to a value; to that of its row ``start`` where the value is None."""

    def damage(recording: Recording) -> Recording:
        values = recording.columns[name].copy()
        values[start:stop] = values[start] if value is None else value
        return column(recording, name, values)

    return damage


def late(name: str, rows: int) -> Damage:
    return lambda r: column(r, name, np.roll(r.columns[name], rows))


def cut_at(name: str, quantile: float) -> Damage:
    def damage(recording: Recording) -> Recording:
        values = recording.columns[name]
        in_trials = np.concatenate([values[s.start : s.stop] for s in recording.spans if s.trial])
        top = values[np.argmin(np.abs(values - np.quantile(in_trials, quantile)))]
        return column(recording, name, np.minimum(values, top))

    return damage


def swapped(first: str, second: str) -> Damage:
    return lambda r: dataclasses.replace(
        r, columns={**r.columns, first: r.columns[second], second: r.columns[first]}
    )


def rows_left(recording: Recording, kept: np.ndarray) -> Recording:
    before = np.concatenate([[0], np.cumsum(kept)]).astype(int)
    spans = tuple(
        Span(s.name, int(before[s.start]), int(before[s.stop]), s.trial) for s in recording.spans
    )
    return dataclasses.replace(
        recording,
        cycle=recording.cycle[kept],
        t_ns=recording.t_ns[kept],
        spans=spans,
        columns={name: values[kept] for name, values in recording.columns.items()},
    )


def lost(share: float) -> Damage:
    return lambda r: rows_left(r, np.random.default_rng(1).random(r.samples) >= share)


def stamps(change: Callable[[np.ndarray], np.ndarray]) -> Damage:
    return lambda r: dataclasses.replace(r, t_ns=change(r.t_ns.copy()))


def gone(name: str, start: int, stop: int) -> Damage:
    """Rows of a channel at its zero, with the noise that an input without a sensor has."""

    def damage(recording: Recording) -> Recording:
        values = recording.columns[name].copy()
        step = np.min(np.diff(np.unique(values)))
        low = np.nanmin(values) if name.endswith("_pa") else 0.0
        values[start:stop] = low + step * np.random.default_rng(7).integers(-1, 2, stop - start)
        return column(recording, name, values)

    return damage
