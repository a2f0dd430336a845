"""What logs say of a loop: the trials that ran in it, and why a log says nothing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.recording import Recording
from epa_rt.tune.controller import Loop, TuneError
from epa_rt.tune.design import Wanted
from epa_rt.tune.followed import trial_of
from epa_rt.tune.in_time import Situation
from epa_rt.tune.response import Excited

SHORTEST_S = 8.0  # of one trial: two periods of a quarter hertz, four segments of two seconds
AT_LIMIT = 0.05  # of the cycles: a plant cut more often is not the one behind small motions
HIGHEST_HZ_SHARE = 0.05  # of the sampling rate: beyond it a cycle of delay turns more than 18 deg
WANTED_BANDS = 60
OF_POWER = 0.999  # of the reference's power that counts as wanted; the rest is its corners
EXCITES = "tune_"  # how the name of an experiment begins that only excites


@dataclass(frozen=True)
class Evidence:
    """Trials of one loop; where it worked; what the reference wanted (None: it only excited).
    ``of_motion``: a trial of the motion that the loop is to follow.
    """

    trials: tuple[Excited, ...]
    situation: Situation
    wanted: Wanted | None
    seconds: float
    of_motion: Excited | None = None


def evidence_of(
    recordings: Sequence[Recording], rig: Rig, loop: Loop, motion: np.ndarray | None = None
) -> Evidence:
    """The trials of the logs. ``motion``: reference (n,) of what the loop is to follow; None: of
    the longest trial that is no mere excitation. Raises TuneError where there is nothing to go by.
    """
    trials: list[Excited] = []
    for recording in recordings:
        _refuse(recording, rig)
        found = _trials(recording, loop)
        if not found:
            raise TuneError(
                f"{recording.path}: found no trial in the loop {loop.name}, expected one at least"
            )
        _refuse_cut(recording, rig, loop, found)
        trials += found
    longest_s = max(len(trial.output) for trial in trials) * loop.period_s
    if longest_s < SHORTEST_S:
        raise TuneError(
            f"{recordings[0].path}: found trials of at most {longest_s:.3g} s without a gap,"
            f" expected {SHORTEST_S:g} s"
        )
    output = np.concatenate([trial.output for trial in trials])
    steps = np.abs(np.diff(output))
    if not np.any(steps > 0.0):
        raise TuneError(f"{recordings[0].path}: found {loop.output} that never moves")
    situation = Situation(
        float(np.mean(output)),
        float(np.mean(np.concatenate([trial.command for trial in trials]))),
        float(np.min(steps[steps > 0.0])),
    )
    only_excites = any(recording.experiment.startswith(EXCITES) for recording in recordings)
    wanted = None
    if not only_excites:
        wanted = wanted_of([trial.reference for trial in trials], loop.period_s)
        if motion is None:
            motion = max((trial.reference for trial in trials), key=len)
    return Evidence(
        tuple(trials),
        situation,
        wanted,
        sum(len(t.output) for t in trials) * loop.period_s,
        trial_of(trials, motion) if motion is not None else None,
    )


def _refuse(recording: Recording, rig: Rig) -> None:
    if recording.rig and recording.rig != rig.name:
        raise TuneError(
            f"{recording.path}: found a log of the rig '{recording.rig}', expected '{rig.name}'"
        )
    trip = next((sentence for sentence in recording.found if sentence.startswith("trip ")), None)
    if trip is not None:
        raise TuneError(f"{recording.path}: found a {trip}, expected a run that ended by itself")
    if abs(recording.period_s / rig.period_s - 1.0) > 1e-3:
        raise TuneError(
            f"{recording.path}: found a period of {1e3 * recording.period_s:g} ms, expected"
            f" {1e3 * rig.period_s:g} ms"
        )


def _trials(recording: Recording, loop: Loop) -> list[Excited]:
    """Trials in which the loop had a reference, cut where a reading or a cycle is missing."""
    missing = [
        name
        for name in (loop.reference, loop.command, loop.output)
        if name not in recording.columns
    ]
    if missing:
        raise TuneError(
            f"{recording.path}: found no {missing[0]}, expected a log of the loop {loop.name}"
        )
    columns = [recording.columns[n] for n in (loop.reference, loop.command, loop.output)]
    known = np.all(np.isfinite(columns), axis=0)
    whole = np.concatenate([[True], np.diff(recording.cycle) == 1])
    found = []
    for span in recording.spans:
        if not span.trial:
            continue
        good = known[span.start : span.stop]
        breaks = ~good | ~whole[span.start : span.stop]
        cuts = [-1, *np.flatnonzero(breaks).tolist(), len(good)]
        for a, b in zip(cuts, cuts[1:], strict=False):
            first = span.start + max(a + (0 if a >= 0 and good[a] else 1), 0)
            if span.start + b - first > 1 and np.ptp(columns[0][first : span.start + b]) > 0.0:
                found.append(Excited(*(column[first : span.start + b] for column in columns)))
    return found


def _refuse_cut(recording: Recording, rig: Rig, loop: Loop, trials: Sequence[Excited]) -> None:
    limits = rig.row(loop.command).limits
    if limits is None:
        return
    command = np.concatenate([trial.command for trial in trials])
    slack = 1e-3 * (limits[1] - limits[0])
    share = float(np.mean((command <= limits[0] + slack) | (command >= limits[1] - slack)))
    if share > AT_LIMIT:
        raise TuneError(
            f"{recording.path}: found {loop.command} at its limit in {100.0 * share:.0f} % of the"
            f" cycles, expected {100.0 * AT_LIMIT:g} % at most"
        )


def wanted_of(references: Sequence[np.ndarray], period_s: float) -> Wanted:
    """Power of references (k,) over frequency, in WANTED_BANDS bands; it sums to their variance."""
    rows = []
    for reference in references:
        # a trial ends elsewhere than it began: without a window that step would pass for motion
        window = np.hanning(len(reference))
        spectrum = np.abs(np.fft.rfft(window * (reference - np.mean(reference)))[1:]) ** 2
        power = 2.0 * spectrum / len(reference) ** 2 / len(references)
        power *= np.var(reference) / np.sum(power) / len(references)
        rows.append((np.fft.rfftfreq(len(reference), period_s)[1:], power))
    frequency = np.concatenate([row[0] for row in rows])
    power = np.concatenate([row[1] for row in rows])
    order = np.argsort(frequency)
    frequency, power = frequency[order], power[order]
    top = frequency[int(np.searchsorted(np.cumsum(power), OF_POWER * np.sum(power)))]
    edges = np.geomspace(frequency[0], top * 1.001, WANTED_BANDS + 1)
    band = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, WANTED_BANDS - 1)
    inside = frequency <= top * 1.001
    sums = np.bincount(band[inside], power[inside], WANTED_BANDS)
    means = np.bincount(band[inside], (power * frequency)[inside], WANTED_BANDS)
    full = sums > 0.0
    return Wanted(means[full] / sums[full], sums[full])


def usual_wanted(loop: Loop, bandwidth_hz: float) -> Wanted:
    """Where nothing says what the loop is to follow: steps of one unit (deg or mm) RMS, up to a
    frequency.
    """
    size = {"rad": np.pi / 180.0, "m": 1e-3}[loop.si_unit]
    frequency = np.geomspace(bandwidth_hz / 20.0, bandwidth_hz, WANTED_BANDS)
    power = 1.0 / frequency  # 1 / f^2 over bands that widen with f
    return Wanted(frequency, size**2 * power / np.sum(power))
