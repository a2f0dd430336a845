"""The whole rig as one block: commands in, all readings out, so that a fit in free run is a fit like any other."""

from collections.abc import Mapping, Sequence

import numpy as np

from epa_rt.gap.alongside import channels, misfit, trials
from epa_rt.gap.floor import Floor
from epa_rt.gap.point import Point, linearised, normal_of, solve, z_of
from epa_rt.gap.problem import Problem
from epa_rt.gap.recording import Recording
from epa_rt.gap.refit import searched
from epa_rt.gap.subject import Link, Subject, Values

LINK = "whole"
RATE_HZ = 20.0       # of what is compared, each channel averaged over that long
INDEPENDENT_HZ = 4.0  # readings a second that count as independent: what nominal parameters leave in free run is correlated over seconds
SEEDS = (1, 2)       # of the twins that say how noisy each channel is
NOISY = 10.0         # chi-square that noise alone may leave of a channel
ROUNDS = 5
AS_PROMISED, TRIFLE = 0.05, 3.0   # of a step's fall, and chi-square: a fit that falls as its derivatives promised has arrived
ABSURD = 1e6         # deviations that stand for a run that is no number


class AsOne:
    """A subject with one link from commands to all measured channels, in deviations of their noise, interleaved sample by sample.

    ``deviation``: by channel that of one reading, its steps included. Only trials are judged.
    """

    def __init__(self, subject: Subject, deviation: Mapping[str, float]) -> None:
        self._subject, self.deviation = subject, dict(deviation)
        self.name, self.rate_hz = subject.name, RATE_HZ * len(deviation)
        self.links = (Link(LINK, LINK, "all readings", "1", "commands to readings"),)
        self.nominal, self.catalogue, self.knobs = subject.nominal, subject.catalogue, subject.knobs
        self.free_run, self.patched = subject.free_run, subject.patched

    def touched(self, key: str) -> tuple[str, ...]:
        return (LINK,)

    def prepare(self, recording: Recording) -> Recording:
        return recording

    def residual(self, prepared: Recording, values: Values, link: str) -> np.ndarray:
        """(n,) measured minus free run; NaN outside of trials."""
        return apart(prepared, self._subject.free_run(prepared, values, None), self.deviation).ravel()

    def features(self, prepared: Recording, link: str) -> Mapping[str, np.ndarray]:
        return {}


def apart(real: Recording, run: Recording, deviation: Mapping[str, float]) -> np.ndarray:
    """(n, channels) difference in deviations, each counting as much as INDEPENDENT_HZ readings a second do; NaN outside of trials."""
    count = int(real.samples * real.period_s * RATE_HZ)
    found = np.full((count, len(deviation)), np.nan)
    for i, (name, size) in enumerate(deviation.items()):
        parts = misfit(real, run, name, RATE_HZ)
        missing = misfit(real, real, name, RATE_HZ) if any(np.isnan(part).any() for part in parts) else parts
        for span, part, lost in zip(trials(real), parts, missing, strict=True):
            first = round(span.start * real.period_s * RATE_HZ)
            part = np.where(np.isnan(lost), 0.0, part) * (np.sqrt(INDEPENDENT_HZ / RATE_HZ) / size)
            part = np.where(np.isfinite(part), np.clip(part, -ABSURD, ABSURD), ABSURD)[: count - first]
            found[first:first + len(part), i] = part
    return found


def twins_of(subject: Subject, recordings: Sequence[Recording], values: Values) -> list[tuple[Recording, list[Recording]]] | None:
    """Of every recording the run of the plant ``values`` without noise and those with it; None where the rig has no model of the whole."""
    found = []
    for recording in recordings:
        runs = [subject.free_run(recording, values, seed) for seed in (None, *SEEDS)]
        if any(run is None for run in runs):
            return None
        found.append((runs[0], runs[1:]))
    return found


def deviations(recordings: Sequence[Recording], twins: Sequence[tuple[Recording, list[Recording]]]) -> dict[str, float]:
    """Channel to the deviation of one reading; larger where steps that stand still for seconds would leave more than NOISY of noise alone."""
    names = [name for name in channels(recordings[0], twins[0][0]) if all(name in channels(r, clean) for r, (clean, _) in zip(recordings, twins, strict=True))]
    found = {}
    for name in names:
        parts = [part for r, (clean, noisy) in zip(recordings, twins, strict=True) for twin in noisy
                 for part in misfit(twin, clean, name, 1.0 / r.period_s)]
        size = float(np.sqrt(np.nanmean(np.concatenate(parts) ** 2)))
        if size > 0.0:
            alone = sum(float(np.nansum(apart(twin, clean, {name: size}) ** 2)) for clean, noisy in twins for twin in noisy) / len(SEEDS)
            found[name] = size * max(np.sqrt(alone / NOISY), 1.0)
    return found


def quiet(point: Point, deviation: Mapping[str, float], twins: Sequence[tuple[Recording, list[Recording]]]) -> float:
    """Chi-square that noise and steps alone leave once the nominal parameters have fitted what they can of them, linear at ``point``."""
    normal, (_, columns) = point.normal, point.columns[LINK]
    found = []
    for i in range(len(SEEDS)):
        noise = np.concatenate([apart(noisy[i], clean, deviation).ravel() for clean, noisy in twins])
        noise = noise[np.isfinite(noise)]
        step = solve(columns.T @ columns, columns.T @ noise, normal.prior, np.zeros(len(normal.z)), ~normal.frozen)
        left = noise + columns @ step
        found.append(float(left @ left + normal.prior @ step**2))
    return float(np.mean(found))


def floor() -> dict[str, Floor]:
    """Of the one link: its residuals are deviations already."""
    return {LINK: Floor(LINK, 1.0, np.zeros(0), 1.0)}


def fitted(whole: Problem, effects: tuple[str, ...], values: Mapping[str, float]) -> Point:
    """Everything free refitted. Derivatives are what costs here, so they are made anew only where the last step fell otherwise than they promised."""
    point = linearised(whole, effects, dict(values))
    for _ in range(ROUNDS):
        after = searched(whole, point)
        if after is None:
            break
        normal = point.normal
        step = z_of(whole, normal.keys, after) - normal.z
        promised, most = (normal.chi - float(normal.loss(by).sum() + normal.prior @ (normal.z + by) ** 2) for by in (step, normal.solved(np.ones(whole.blocks))))
        residual = {LINK: whole.residual(after, LINK)}
        moved = Point(effects, after, residual, point.columns, normal_of(whole, normal.keys, after, residual, point.columns))
        if abs(normal.chi - moved.normal.chi - promised) + most - promised < max(AS_PROMISED * promised, TRIFLE):
            return moved
        point = linearised(whole, effects, after)
    return point
