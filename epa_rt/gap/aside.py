"""Trials set aside: a subject that judges only some samples of its recordings."""

from collections.abc import Mapping, Sequence

import numpy as np

from epa_rt.gap.alongside import trials
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject, Values


class Part:
    """A subject whose residuals are NaN outside ``windows``: recording name to (start, stop) pairs in samples."""

    def __init__(self, subject: Subject, windows: Mapping[str, Sequence[tuple[int, int]]]) -> None:
        self._subject, self._windows = subject, windows
        self.name, self.rate_hz, self.links = subject.name, subject.rate_hz, subject.links
        self.nominal, self.catalogue, self.knobs = subject.nominal, subject.catalogue, subject.knobs
        self.touched, self.patched, self.free_run = subject.touched, subject.patched, subject.free_run
        self.repeats = getattr(subject, "repeats", None)   # of the whole recording: its laps

    def prepare(self, recording: Recording) -> tuple[object, Recording]:
        return self._subject.prepare(recording), recording

    def residual(self, prepared: tuple[object, Recording], values: Values, link: str) -> np.ndarray:
        inner, recording = prepared
        found = self._subject.residual(inner, values, link)
        outside = np.ones(len(found), bool)
        for start, stop in self._windows.get(recording.name, ()):
            a, b = (round(edge * recording.period_s * self.rate_hz) for edge in (start, stop))
            outside[a:b] = False
        return np.where(outside, np.nan, found)

    def features(self, prepared: tuple[object, Recording], link: str) -> Mapping[str, np.ndarray]:
        return self._subject.features(prepared[0], link)


def split(subject: Subject, recordings: Sequence[Recording]) -> tuple[Part, Part] | None:
    """The subject on most trials, and on the last trial of every log that has several; the last log where none has.

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
        name = recordings[-1].name
        aside[name] = fit.pop(name)
    return (Part(subject, fit), Part(subject, aside)) if aside else None
