"""Curves of the worst channel on held-out data: what was measured, what the plant says before and
after, and the floor.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.likelihood.alongside import channels, trials, unit_of
from epa_rt.gap.likelihood.floor import FLOOR_SEEDS, Floor, left_over, unbiased, weight
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject, Values

EXCERPT_S = 6.0
# what the plant before is
BELIEVED, REFITTED = "as believed", "with nominal parameters refitted"
HEALTHY = "as in the healthy runs"


@dataclass(frozen=True)
class Trace:
    """One picture: ``lines`` are (words, kind, (n,) values) over ``t_s`` (n,); ``floor`` is the
    floor's rms, ``band`` (n,) that with each row's own variance.

    Kinds: "measured", "before", "after". ``is_error``: measured minus plant, so that zero is right
    and the floor a band.
    """

    title: str
    unit: str
    log: str
    t_s: np.ndarray
    lines: tuple[tuple[str, str, np.ndarray], ...]
    floor: float
    is_error: bool
    band: np.ndarray | None = None


def traces(
    subject: Subject,
    recordings: Sequence[Recording],
    before: Values,
    after: Values,
    floors: Mapping[str, Floor],
    channel: str | None = None,
) -> tuple[Trace, ...]:
    """A few seconds of one channel in free run, and what is left over the log with the largest gap
    of the worst link. ``before``: nominal parameters refitted without the effects.

    ``channel``: the one to draw in free run, if the plant has it; else the one in which the patch
    does most.
    """
    shown = _alongside(subject, recordings, before, after, channel)
    found = _left(subject, recordings, before, after, floors)
    return tuple(one for one in (shown, found) if one is not None)


def _left(
    subject: Subject,
    recordings: Sequence[Recording],
    before: Values,
    after: Values,
    floors: Mapping[str, Floor],
) -> Trace | None:
    worst = None
    for recording in recordings:
        one = subject.prepare(recording)
        for link in (link for link in subject.links if link.name in floors):
            floor = floors[link.name]
            size = _rms(left_over(subject, one, before, floor, recording.name)) / floor.rms
            if worst is None or size > worst[0]:
                worst = size, link, recording, one
    if worst is None:
        return None
    _, link, recording, one = worst
    floor = floors[link.name]
    residual, rest = (
        unbiased(subject.residual(one, values, link.name), floor, recording.name)
        for values in (before, after)
    )
    band = np.broadcast_to(floor.rms / weight(subject, one, floor), residual.shape)
    t_s = np.arange(len(residual)) / subject.rate_hz
    judged = np.flatnonzero(np.isfinite(residual))
    cut = slice(judged[0], judged[-1] + 1) if judged.size else slice(0, 0)
    return Trace(
        f"What is left of {link.channel} in {link.name}, measured minus plant",
        link.unit,
        recording.name,
        t_s[cut],
        (
            (f"before, {REFITTED if subject.usual is None else HEALTHY}", "before", residual[cut]),
            ("with the effects", "after", rest[cut]),
        ),
        floor.rms,
        True,
        band[cut],
    )


def _alongside(
    subject: Subject,
    recordings: Sequence[Recording],
    before: Values,
    after: Values,
    channel: str | None,
) -> Trace | None:
    """Of all recordings the seconds in which the patch does most in free run."""
    best: tuple[float, Trace] | None = None
    for recording in recordings:
        runs = [
            subject.free_run(recording, values, seed)
            for values, seed in ((before, None), (after, None), (after, FLOOR_SEEDS[0]))
        ]
        if any(run is None for run in runs):
            return None
        found = _best_seconds(subject, recording, runs, channel, REFITTED)
        if found is not None and (best is None or found[0] > best[0]):
            best = found
    return best[1] if best else None


def alongside_trace(
    subject: Subject,
    real: Recording,
    before: Recording,
    after: Recording,
    twin: Recording,
    channel: str | None = None,
) -> Trace | None:
    """The seconds in which the patch does most, in units of the floor; ``before``: the plant file
    as it stands, ``twin``: ``after`` with other noise.
    """
    found = _best_seconds(subject, real, (before, after, twin), channel, BELIEVED)
    return found[1] if found else None


def _best_seconds(
    subject: Subject, real: Recording, runs: Sequence[Recording], channel: str | None, before: str
) -> tuple[float, Trace] | None:
    """The gain and the trace; ``runs``: before, after and its twin. ``before``: what the first of
    them is, in words.
    """
    best, names = None, channels(real, runs[1])
    for name in (channel,) if channel in names else names:
        for trial in range(min(len(trials(one)) for one in (real, *runs))):
            measured, old, new, noisy = _curves(subject, (real, *runs), name, trial)
            floor, width = (
                _rms(noisy - new),
                min(max(round(EXCERPT_S * subject.rate_hz), 1), len(new)),
            )
            if not floor > 0.0 or width < 10:
                continue
            sums = np.concatenate(
                [[0.0], np.cumsum(np.nan_to_num((measured - old) ** 2 - (measured - new) ** 2))]
            )
            windows = (sums[width:] - sums[:-width]) / (width * floor**2)
            start = int(np.argmax(windows))
            if best is None or windows[start] > best[0]:
                cut = slice(start, start + width)
                lines = (
                    ("the rig", "measured", measured[cut]),
                    (f"the plant {before}", "before", old[cut]),
                    ("the plant with the effects", "after", new[cut]),
                )
                title = f"{name}: " + ", ".join(words for words, _, _ in lines)
                t_s = np.arange(start, start + width) / subject.rate_hz
                best = (
                    float(windows[start]),
                    Trace(
                        title,
                        unit_of(subject, name),
                        f"{real.name}, {trials(real)[trial].name} {trial + 1}",
                        t_s,
                        lines,
                        floor,
                        False,
                    ),
                )
    return best


def _curves(
    subject: Subject, recordings: Sequence[Recording], name: str, trial: int
) -> list[np.ndarray]:
    """One trial of a channel in each recording, cut to the shortest, averaged to the subject's
    rate.
    """
    step = max(round(1.0 / (subject.rate_hz * recordings[0].period_s)), 1)
    parts = [
        one.columns[name][trials(one)[trial].start : trials(one)[trial].stop] for one in recordings
    ]
    n = min(map(len, parts)) // step * step
    return [part[:n].reshape(-1, step).mean(axis=1) for part in parts]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2))) if np.isfinite(values).any() else 0.0
