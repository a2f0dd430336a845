"""The whole rig as one block: commands in, all readings out, so that a fit in free run is a fit
like any other.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from epa_rt.gap.likelihood.alongside import channels, misfit, step_of, trials
from epa_rt.gap.likelihood.floor import Floor
from epa_rt.gap.likelihood.point import Normal, Point, carried, costs, linearised, solve
from epa_rt.gap.likelihood.problem import ABSURD, Problem
from epa_rt.gap.likelihood.refit import searched
from epa_rt.gap.recording import Recording
from epa_rt.gap.side_by_side import each
from epa_rt.gap.subject import Link, Plain, Subject, Values

LINK = "whole"
RATE_HZ = 20.0  # of what is compared, each channel averaged over that long
# readings a second that count as independent: what nominal parameters leave in free run is
# correlated over seconds
INDEPENDENT_HZ = 4.0
SEEDS = (1, 2)  # of the twins that say how noisy each channel is
NOISY = 10.0  # chi-square that noise alone may leave of a channel
ROUNDS, SLOW = (
    15,
    0.01,
    # fresh derivatives at most so often, and no more where they took off less than that part: a
    # knee's valleys bend
)
AS_PROMISED, TRIFLE = (
    0.05,
    3.0,
    # of a step's fall and of what is left, and chi-square: a fit that falls as its derivatives
    # promised has arrived
)
NEARBY, STILL_FALLS = (
    1.5,
    0.6,
    # times what its derivatives promise, and of what was left before the last step: a fit below the
    # one and above the other has come near to what it can reach
)
KEPT = 64  # runs, among them those that changes are counted from
# of a step: a reading that stands still says that the value lies within it, and the rest may lie on
# its edge
WITHIN = 0.55


class AsOne(Plain):
    """A subject with one link from commands to all measured channels, in deviations of their noise,
    interleaved sample by sample. Only trials are judged.
    """

    # a knee's run bends: with a hundred times that a payload and the mass that hides it look 6 %
    # unlike, and no fit finds the way
    finite_step = 1e-4
    has_change = True

    def __init__(self, subject: Subject, meters: Mapping[str, "Meter"]) -> None:
        self._subject, self.meters = subject, dict(meters)
        self.name, self.rate_hz = subject.name, RATE_HZ * len(meters)
        self.links = (Link(LINK, LINK, "all readings", "1", "commands to readings"),)
        self.nominal, self.catalogue, self.knobs = subject.nominal, subject.catalogue, subject.knobs
        self.free_run, self.patched, self.without_stop = (
            subject.free_run,
            subject.patched,
            subject.without_stop,
        )
        rougher = subject.rougher
        self._rough = {far: made.free_run for far in (False, True) if (made := rougher(far))}
        self._bases: dict[tuple, tuple[Held, np.ndarray]] = {}

    def touched(self, key: str) -> tuple[str, ...]:
        """The one link, whatever the knob."""
        return (LINK,)

    def prepare(self, recording: Recording) -> "Held":
        """What ``apart`` holds a run against, of the recording up to its last trial's end where the
        subject has ``upto``.
        """
        end = _judged_to(recording)
        cut = self._subject.upto(recording, end) if end < recording.samples else None
        return held(cut or recording, self.meters)

    def residual(self, prepared: "Held", values: Values, link: str) -> np.ndarray:
        """(n,) measured minus free run; NaN outside of trials."""
        return self._kept(None, prepared, values)

    def change(
        self, prepared: "Held", values: Values, at: Values, far: bool = False
    ) -> np.ndarray | None:
        """(n,) residual at ``values`` less that at ``at`` by the rougher model, the roughest where
        they are ``far`` apart; None without one, or where one is no number.
        """
        if not self._rough:
            return None
        made, base = self._by(self._rough[far], prepared, values), self._kept(far, prepared, at)
        return (
            made - base
            if max(np.nanmax(np.abs(one), initial=0.0) for one in (made, base)) < ABSURD
            else None
        )

    def _kept(self, far: bool | None, prepared: "Held", values: Values) -> np.ndarray:
        """Residual of the whole run (None) or of a rougher one, kept and to be read only: all of a
        point's derivatives ask for theirs, of several fits at once, and fits for where others were.
        """
        key = (far, id(prepared), tuple(values.items()))
        made = self._bases.get(key)
        if made is None:
            if len(self._bases) >= KEPT:
                self._bases = {}
            run = self._subject.free_run if far is None else self._rough[far]
            # with what it is of, so that an id stays its own
            made = self._bases[key] = prepared, self._by(run, prepared, values)
        return made[1]

    def _by(self, run, prepared: "Held", values: Values) -> np.ndarray:
        return apart(prepared, run(prepared.recording, values, None), self.meters).ravel()

    def features(self, prepared: "Held", link: str) -> Mapping[str, np.ndarray]:
        """{}: a whole rig has no inputs but its commands."""
        return {}


def _judged_to(recording: Recording) -> int:
    """Samples of a recording from which ``apart`` has all averages of its trials: an average is a
    whole number of samples, which may be less than 1 / RATE_HZ.
    """
    rate = recording.period_s * RATE_HZ
    averaged = max(round(1.0 / rate), 1)
    return max(
        int(np.ceil((round(span.start * rate) + (span.stop - span.start) // averaged + 1) / rate))
        for span in trials(recording)
    )


class Meter(NamedTuple):
    """How well a channel shows what it measures: ``deviation`` of one reading, its steps included,
    and one ``step`` (0: none is seen).
    """

    deviation: float
    step: float


class Held(NamedTuple):
    """A recording and by channel, trial by trial, (n,) how far each average may be off unnoticed:
    by WITHIN of its step where it stands still, or no noise carries it over an edge.
    """

    recording: Recording
    within: Mapping[str, list[np.ndarray]]


def held(recording: Recording, meters: Mapping[str, Meter]) -> Held:
    """What ``apart`` holds a run against."""
    averaged = max(round(1.0 / (RATE_HZ * recording.period_s)), 1)
    found: dict[str, list[np.ndarray]] = {}
    for name, meter in meters.items():
        size = WITHIN * meter.step
        spans = [recording.columns[name][span.start : span.stop] for span in trials(recording)]
        parts = [
            values[: len(values) // averaged * averaged].reshape(-1, averaged) for values in spans
        ]
        found[name] = [
            np.where(np.count_nonzero(np.diff(part, axis=1), axis=1) <= 1, size, 0.0)
            for part in parts
        ]
    return Held(recording, found)


def apart(real: Held, run: Recording, meters: Mapping[str, Meter]) -> np.ndarray:
    """(n, channels) difference in deviations, each counting as much as INDEPENDENT_HZ readings a
    second do; NaN outside of trials.
    """
    recording = real.recording
    count = int(recording.samples * recording.period_s * RATE_HZ)
    found = np.full((count, len(meters)), np.nan)
    for i, (name, meter) in enumerate(meters.items()):
        parts = misfit(recording, run, name, RATE_HZ)
        missing = (
            misfit(recording, recording, name, RATE_HZ)
            if any(np.isnan(part).any() for part in parts)
            else parts
        )
        for span, part, lost, within in zip(
            trials(recording), parts, missing, real.within[name], strict=True
        ):
            first = round(span.start * recording.period_s * RATE_HZ)
            part = np.sign(part) * np.maximum(np.abs(part) - within[: len(part)], 0.0)
            part = np.where(np.isnan(lost), 0.0, part) * (
                np.sqrt(INDEPENDENT_HZ / RATE_HZ) / meter.deviation
            )
            part = np.where(np.isfinite(part), np.clip(part, -ABSURD, ABSURD), ABSURD)[
                : count - first
            ]
            found[first : first + len(part), i] = part
    return found


def twins_of(
    subject: Subject, recordings: Sequence[Recording], values: Values, seeds: Sequence[int] = SEEDS
) -> list[tuple[Recording, list[Recording]]] | None:
    """Of every recording the run of the plant ``values`` without noise and those with it; None
    where the rig has no model of the whole.
    """
    made = [
        each(lambda seed, of=recording: subject.free_run(of, values, seed), (None, *seeds))
        for recording in recordings
    ]
    return (
        None
        if any(run is None for runs in made for run in runs)
        else [(runs[0], runs[1:]) for runs in made]
    )


def meters_of(
    recordings: Sequence[Recording], twins: Sequence[tuple[Recording, list[Recording]]]
) -> dict[str, Meter]:
    """By channel; the deviation is larger where noise and steps that hang together for seconds
    would leave more than NOISY.
    """
    names = [
        name
        for name in channels(recordings[0], twins[0][0])
        if all(name in channels(r, clean) for r, (clean, _) in zip(recordings, twins, strict=True))
    ]
    found = {}
    for name in names:
        parts = [
            part
            for r, (clean, noisy) in zip(recordings, twins, strict=True)
            for twin in noisy
            for part in misfit(twin, clean, name, 1.0 / r.period_s)
        ]
        steps = filter(None, (step_of(r, name, everywhere=True) for r in recordings))
        meter = Meter(
            float(np.sqrt(np.nanmean(np.concatenate(parts) ** 2))), min(steps, default=0.0)
        )
        if meter.deviation > 0.0:
            alone = sum(
                float(np.nansum(apart(held(twin, {name: meter}), clean, {name: meter}) ** 2))
                for clean, noisy in twins
                for twin in noisy
            ) / len(SEEDS)
            found[name] = meter._replace(
                deviation=meter.deviation * max(np.sqrt(alone / NOISY), 1.0)
            )
    return found


def quiet(
    point: Point, meters: Mapping[str, Meter], twins: Sequence[tuple[Recording, list[Recording]]]
) -> float:
    """Chi-square that noise and steps alone leave once the nominal parameters have fitted what they
    can of them, linear at ``point``.
    """
    normal, (_, columns) = point.normal, point.columns[LINK]
    found = []
    for i in range(len(SEEDS)):
        noise = np.concatenate(
            [apart(held(noisy[i], meters), clean, meters).ravel() for clean, noisy in twins]
        )
        noise = noise[np.isfinite(noise)]
        step = solve(
            columns.T @ columns,
            columns.T @ noise,
            normal.prior,
            np.zeros(len(normal.z)),
            ~normal.frozen,
        )
        left = noise + columns @ step
        found.append(float(left @ left + normal.prior @ step**2))
    return float(np.mean(found))


def floor() -> dict[str, Floor]:
    """Of the one link: its residuals are deviations already."""
    return {LINK: Floor(LINK, 1.0, np.zeros(0), 1.0)}


def fitted(
    whole: Problem,
    effects: tuple[str, ...],
    values: Mapping[str, float],
    worth: float = np.inf,
    near: Point | None = None,
) -> Point:
    """Everything free refitted. Derivatives are what costs here, so they are made anew only where
    the last step fell otherwise than they promised.

    ``worth``: chi-square above which the fit is of no use to who asks; it ends where it has come
    near to what its derivatives promise, and that is more. ``near``: where the same was fitted with
    fewer effects; the fit begins there where that is better, with the derivatives from there.
    """
    point, before = _begun(whole, effects, dict(values), near)
    for _ in range(ROUNDS):
        normal = point.normal
        if _in_vain(normal, before, worth):
            break
        before = normal.chi
        after = searched(whole, point, light=True)
        if after is None:
            break
        moved = carried(whole, point, after)
        if normal.missed(moved.normal) < max(
            AS_PROMISED * min(normal.chi - moved.normal.chi, moved.normal.chi), TRIFLE
        ) or _in_vain(moved.normal, before, worth):
            return moved
        point = linearised(whole, effects, after, residual=moved.residual)
        if normal.chi - point.normal.chi < SLOW * normal.chi:
            break
    return point


def _begun(
    whole: Problem, effects: tuple[str, ...], values: dict[str, float], near: Point | None
) -> tuple[Point, float]:
    """Where a fit begins, and the chi-square before that: infinite but where it goes on from
    another, for nothing is in vain before a step was tried.
    """
    if near is not None:
        there, keys = {**values, **near.values}, near.normal.keys
        if costs(whole, keys, there) <= costs(whole, keys, values):
            return linearised(whole, effects, there, near), near.normal.chi
    return linearised(whole, effects, values), np.inf


def _in_vain(normal: Normal, before: float, worth: float) -> bool:
    """Whether a fit whose last step began at ``before`` has come near to what its derivatives
    promise, and that is more than it may be worth.
    """
    reached = normal.reached()
    return reached > worth and normal.chi < NEARBY * reached and STILL_FALLS * before < normal.chi
