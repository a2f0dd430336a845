"""Curves of the worst channel on held-out data: what was measured, what the plant says before and after, and the floor."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.alongside import BLOCK_S, channels, paired, unit_of
from epa_rt.gap.floor import Floor
from epa_rt.gap.localise import unbiased
from epa_rt.gap.recording import Recording
from epa_rt.gap.shrink import FLOOR_SEEDS
from epa_rt.gap.subject import Subject, Values

EXCERPT_S = 6.0


@dataclass(frozen=True)
class Trace:
    """One picture: ``lines`` are (words, kind, (n,) values) over ``t_s`` (n,); ``floor`` is the floor's rms.

    Kinds: "measured", "before", "after". ``is_error``: measured minus plant, so that zero is right and the floor a band.
    """

    title: str
    unit: str
    log: str
    t_s: np.ndarray
    lines: tuple[tuple[str, str, np.ndarray], ...]
    floor: float
    is_error: bool


def traces(subject: Subject, recordings: Sequence[Recording], before: Values, after: Values, floors: Mapping[str, Floor],
           prepared: Mapping[str, object] | None = None) -> tuple[Trace, ...]:
    """What is left over the log with the largest gap of the worst link, and a few seconds of the worst channel in free run."""
    found = _left(subject, recordings, before, after, floors, prepared or {})
    shown = _alongside(subject, recordings, before, after)
    return tuple(one for one in (shown, found) if one is not None)


def _left(subject: Subject, recordings: Sequence[Recording], before: Values, after: Values, floors: Mapping[str, Floor],
          prepared: Mapping[str, object]) -> Trace | None:
    worst = None
    for recording in recordings:
        one = prepared.get(recording.name) or subject.prepare(recording)
        for link in (link for link in subject.links if link.name in floors):
            floor = floors[link.name]
            residual = unbiased(subject.residual(one, before, link.name), floor, recording.name)
            size = _rms(residual) / floor.rms
            if worst is None or size > worst[0]:
                worst = size, link, recording, one, residual
    if worst is None:
        return None
    _, link, recording, one, residual = worst
    rest = unbiased(subject.residual(one, after, link.name), floors[link.name], recording.name)
    t_s = np.arange(len(residual)) / subject.rate_hz
    judged = np.flatnonzero(np.isfinite(residual))
    cut = slice(judged[0], judged[-1] + 1) if judged.size else slice(0, 0)
    return Trace(f"What is left of {link.channel} in {link.name}, measured minus plant", link.unit, recording.name, t_s[cut],
                 (("before", "before", residual[cut]), ("with the effects", "after", rest[cut])), floors[link.name].rms, True)


def _alongside(subject: Subject, recordings: Sequence[Recording], before: Values, after: Values) -> Trace | None:
    """The channel and the seconds in which the patch does most, in units of the floor."""
    best = None
    for recording in recordings:
        believed, patched, twin = (subject.free_run(recording, values, seed)
                                   for values, seed in ((before, None), (after, None), (after, FLOOR_SEEDS[0])))
        if believed is None or patched is None or twin is None:
            return None
        for name in channels(recording, patched):
            real, old, new, noisy = (_trial(recording, one, name) for one in (recording, believed, patched, twin))
            floor, width = _rms(noisy - new), max(round(min(EXCERPT_S, 4 * BLOCK_S) / recording.period_s), 1)
            gain = np.nan_to_num((real - old) ** 2 - (real - new) ** 2)
            if not floor > 0.0 or len(gain) < 10:
                continue
            width = min(width, len(gain))
            sums = np.concatenate([[0.0], np.cumsum(gain)])
            windows = (sums[width:] - sums[:-width]) / (width * floor**2)
            start = int(np.argmax(windows))
            if best is None or windows[start] > best[0]:
                cut = slice(start, start + width)
                best = windows[start], name, recording, real[cut], old[cut], new[cut], start * recording.period_s, floor
    if best is None:
        return None
    _, name, recording, real, old, new, begin_s, floor = best
    t_s = begin_s + np.arange(len(real)) * recording.period_s
    lines = (("the rig", "measured", real), ("the plant as believed", "before", old), ("the plant with the effects", "after", new))
    return Trace(f"{name}: the rig, the plant as believed, the plant with the effects", unit_of(subject, name), recording.name, t_s, lines, floor, False)


def _trial(real: Recording, one: Recording, name: str) -> np.ndarray:
    """All trials of a channel, one after the other."""
    return np.concatenate([one.columns[name][b.start:b.stop] for _, b in paired(real, one)])


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(values**2))) if np.isfinite(values).any() else 0.0
