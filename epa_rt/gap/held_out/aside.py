"""Trials set aside: a subject that judges only some samples of its recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from epa_rt.gap.likelihood.alongside import trials
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Plain, Subject, Values


class Part(Plain):
    """A subject whose residuals are NaN outside ``windows``: recording name to (start, stop) pairs
    in samples.
    """

    def __init__(self, subject: Subject, windows: Mapping[str, Sequence[tuple[int, int]]]) -> None:
        self._subject, self._windows = subject, windows
        self._outside = cache(self._windowless)
        self.name, self.rate_hz, self.links = subject.name, subject.rate_hz, subject.links
        self.nominal, self.catalogue, self.knobs = subject.nominal, subject.catalogue, subject.knobs
        self.touched, self.patched, self.without_stop = (
            subject.touched,
            subject.patched,
            subject.without_stop,
        )
        self.lowpass_hz, self.told = subject.lowpass_hz, subject.told
        # of the whole recording too: asked for runs alone, or for laps
        self.rougher, self.upto = subject.rougher, subject.upto
        self.read_again, self.repeats = subject.read_again, subject.repeats
        self.usual = subject.usual

    def doubted(self, prepared: Mapping[str, tuple[object, Recording]]) -> "Part | None":
        """As Subject.doubted, within the windows."""
        found = self._subject.doubted({name: one for name, (one, _) in prepared.items()})
        return found and Part(found, self._windows)

    def prepare(self, recording: Recording) -> tuple[object, Recording]:
        """What the subject prepares, and the recording, whose name finds its windows."""
        return self._subject.prepare(recording), recording

    def residual(self, prepared: tuple[object, Recording], values: Values, link: str) -> np.ndarray:
        """As Subject.residual, NaN outside the recording's windows besides; everywhere where it has
        none.
        """
        inner, recording = prepared
        found = self._subject.residual(inner, values, link)
        return np.where(self._outside(recording.name, recording.samples, len(found)), np.nan, found)

    def _windowless(self, name: str, samples: int, count: int) -> np.ndarray:
        """(count,) bool: rows of a residual outside the windows of a recording."""
        outside = np.ones(count, bool)
        for start, stop in self._windows.get(name, ()):
            a, b = (
                round(edge * count / samples) for edge in (start, stop)
            )  # not by time: a log's rate may be a little off the rig's
            outside[a:b] = False
        return outside

    def row_variance(self, prepared: tuple[object, Recording], link: str) -> np.ndarray | None:
        """As Subject.row_variance, inside the windows and outside."""
        return self._subject.row_variance(prepared[0], link)

    def free_run(self, recording: Recording, values: Values, seed: int | None) -> Recording | None:
        """As Subject.free_run, under the recording's own name."""
        found = self._subject.free_run(recording, values, seed)
        return found and replace(
            found, name=recording.name
        )  # so that its windows are those of the recording

    def only(self, recordings: Sequence[Recording]) -> tuple[Recording, ...]:
        """The recordings that have a window, with those trials alone that lie in one: what is to be
        judged in free run.
        """
        return tuple(
            replace(
                one,
                spans=tuple(
                    replace(span, trial=span.trial and self._inside(one.name, span))
                    for span in one.spans
                ),
            )
            for one in recordings
            if self._windows.get(one.name)
        )

    def seen(self, recordings: Sequence[Recording]) -> Sequence[Recording]:
        """The recordings that have a window, up to its end where a run knows nothing of what comes
        after; all of them whole where it does.
        """
        ends = {name: windows[0][1] for name, windows in self._windows.items()}
        found = [self.upto(one, ends[one.name]) for one in recordings if one.name in ends]
        cut = [one for one in found if one is not None]
        return cut if len(cut) == len(found) else recordings

    def _inside(self, name: str, span: Span) -> bool:
        return any(start <= span.start and span.stop <= stop for start, stop in self._windows[name])

    def features(self, prepared: tuple[object, Recording], link: str) -> Mapping[str, np.ndarray]:
        """As Subject.features, inside the windows and outside."""
        return self._subject.features(prepared[0], link)


def split(subject: Subject, recordings: Sequence[Recording]) -> tuple[Part, Part] | None:
    """The subject on most trials, and on the last trial of every log that has several; where none
    has, on one log in whatever order they come (``_middling``).

    None where there is but one log with one trial: nothing can be set aside.
    """
    fit: dict[str, list[tuple[int, int]]] = {}
    aside: dict[str, list[tuple[int, int]]] = {}
    for recording in recordings:
        last = trials(recording)[-1]
        if len(trials(recording)) > 1:
            fit[recording.name] = [(0, last.start), (last.stop, recording.samples)]
            aside[recording.name] = [(last.start, last.stop)]
        else:
            fit[recording.name] = [(0, recording.samples)]
    if not aside and len(recordings) > 1:
        name = _middling(subject, recordings)
        aside[name] = fit.pop(name)
    return (Part(subject, fit), Part(subject, aside)) if aside else None


def _middling(subject: Subject, recordings: Sequence[Recording]) -> str:
    """Name of the log with the median sum of the squares that the plant file leaves (the lower of
    two); each link counts by its largest. The fits keep what shows most, and what is set aside
    shows some of it. Runs with numbers of their own are judged as those without.
    """
    subject = subject.of_any_run()
    ready = {one.name: subject.prepare(one) for one in recordings}
    left = dict.fromkeys(ready, 0.0)
    for link in subject.links:
        with np.errstate(over="ignore", invalid="ignore"):  # a plant that runs away
            squares = {
                name: float(np.nansum(subject.residual(one, {}, link.name) ** 2))
                for name, one in ready.items()
            }
        most = max(squares.values())
        for name, square in squares.items():
            if most > 0.0:
                left[name] += 1.0 if square == most else square / most
    return sorted(left, key=lambda name: (left[name], name))[(len(left) - 1) // 2]


class Unseen(NamedTuple):
    """``fitted``: the subject of the fits, which see ``recordings``; ``judged``: that of ``logs``,
    which no fit has seen; None where it is the same. ``logs`` is empty where nothing could be set
    aside.
    """

    fitted: Subject
    recordings: Sequence[Recording]
    judged: Subject | None
    logs: Sequence[Recording]


def unseen(
    subject: Subject, recordings: Sequence[Recording], holdout: Sequence[Recording]
) -> Unseen:
    """What is fitted and what judges it: the logs held out, else trials set aside. A plant that
    runs from rest is run as far as the fits see it, and no further.
    """
    halves = None if holdout else split(subject, recordings)
    if halves is None:
        return Unseen(subject, recordings, None, holdout)
    fitted, judged = halves
    return Unseen(fitted, fitted.seen(recordings), judged, judged.only(recordings))
