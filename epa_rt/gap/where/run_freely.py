"""Where the gap shows in free run: the whole plant run from its commands alone, reading by reading,
in state, band and time.

Every reading is a link of its own here, measured minus run, and its floor is what the plant's twins
differ by.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from epa_rt.gap.diagnosis import Place
from epa_rt.gap.likelihood.alongside import channels, step_of, trials, unit_of
from epa_rt.gap.likelihood.as_one import twins_of
from epa_rt.gap.likelihood.floor import FLOOR_SEEDS, Floor, fitted, white
from epa_rt.gap.likelihood.ground import judged
from epa_rt.gap.likelihood.significance import scatter
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Link, Plain, Subject, Values
from epa_rt.gap.where.localise import localise

BLOCK = "whole plant"


def localise_freely(
    subject: Subject,
    recordings: Sequence[Recording],
    values: Values,
    prepared: Mapping[str, object] | None = None,
) -> tuple[Place, ...]:
    """Every reading with its excess over what twins differ by, the most significant first; none
    where the rig has no model of the whole.

    Of what free run is heard on (``ground.judged``). The block is ``BLOCK``: a reading that is off
    in free run says nothing of which one. ``prepared``: recording name to ``Subject.prepare``,
    where it is at hand.
    """
    recordings = judged(subject, recordings)
    made = twins_of(subject, recordings, values, FLOOR_SEEDS)
    if not made:
        return ()
    runs = {one.name: clean for one, (clean, _) in zip(recordings, made, strict=True)}
    twins = {one.name: noisy for one, (_, noisy) in zip(recordings, made, strict=True)}
    names = [
        name
        for name in channels(recordings[0], runs[recordings[0].name])
        if all(name in one.columns for one in recordings)
    ]
    whole = _Whole(
        subject, runs, names, prepared or {one.name: subject.prepare(one) for one in recordings}
    )
    floors = {name: _floor(subject, name, recordings, runs, twins) for name in names}
    return localise(whole, {one.name: one for one in recordings}, values, floors)


class _Whole(Plain):
    """The rig with one link to a reading, whose residual is what free run leaves of it; as much of
    a Subject as ``localise`` asks for.
    """

    def __init__(
        self,
        subject: Subject,
        runs: Mapping[str, Recording],
        names: Sequence[str],
        prepared: Mapping[str, object],
    ) -> None:
        self._subject, self._runs, self._prepared = subject, runs, prepared
        self._own = {link.channel: link.name for link in reversed(subject.links)}
        self.rate_hz = subject.rate_hz
        self.links = tuple(
            Link(name, BLOCK, name, unit_of(subject, name), "commands to reading") for name in names
        )

    def residual(self, prepared: Recording, values: Values, link: str) -> np.ndarray:
        return apart(self._subject, prepared, prepared, self._runs[prepared.name], link)

    def features(self, prepared: Recording, link: str) -> Mapping[str, np.ndarray]:
        """Of the block that the reading ends, or else of the first one."""
        own = self._own.get(link, self._subject.links[0].name)
        count = len(self.residual(prepared, {}, link))
        made = self._subject.features(self._prepared[prepared.name], own)
        return {
            name: np.pad(values[:count], (0, max(count - len(values), 0)), "edge")
            for name, values in made.items()
        }


def apart(
    subject: Subject, of: Recording, one: Recording, other: Recording, channel: str
) -> np.ndarray:
    """One run's reading less another's at ``rate_hz``, (n,), averaged over samples; NaN outside of
    ``of``'s trials.
    """
    step = max(round(1.0 / (subject.rate_hz * of.period_s)), 1)
    count = min(one.samples, other.samples)
    difference = np.full(count, np.nan)
    for span in trials(of):
        inside = slice(span.start, min(span.stop, count))
        difference[inside] = one.columns[channel][inside] - other.columns[channel][inside]
    whole = count // step * step
    return difference[:whole].reshape(-1, step).mean(axis=1)


def _floor(
    subject: Subject,
    name: str,
    recordings: Sequence[Recording],
    runs: Mapping[str, Recording],
    twins: Mapping[str, Sequence[Recording]],
) -> Floor:
    """What twins differ by; half the reading's step where they differ by less: one that stands
    still says only that the value lies within its step.
    """
    noise = {
        one.name: [apart(subject, one, twin, runs[one.name], name) for twin in twins[one.name]]
        for one in recordings
    }
    half_step = max(step_of(one, name) for one in recordings) / 2.0
    found = fitted(name, [twin for made in noise.values() for twin in made], "twin")
    if found.rms <= half_step:
        return white(name, half_step, "sensors")
    return Floor(
        name, found.rms, found.ar, found.innovation, {}, "twin", scatter(found.whiten, {}, noise)
    )
