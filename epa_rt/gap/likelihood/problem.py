"""All links of all recordings as one vector: whitened, so that it is unit white noise where there
is no gap.

Cut into blocks of a second or two that all links share, for what resamples or leaves out, and into
folds of whole trials for what is judged on other data.
"""

import copy
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from epa_rt.gap.likelihood.chunks import chunks_of
from epa_rt.gap.likelihood.floor import Floor, left_over, weight
from epa_rt.gap.likelihood.generic import Design
from epa_rt.gap.recording import Recording
from epa_rt.gap.side_by_side import each
from epa_rt.gap.subject import Subject, Values
from epa_rt.models.effect import Effect, Knob

if TYPE_CHECKING:
    from epa_rt.gap.likelihood.point import Point

BLOCK_S = 1.5  # longer than what the residuals remember; the unit of every resampling
MOST_BLOCKS = 240  # long logs get longer blocks, so that a fit's normal equations stay small
FOLDS = 4
ABSURD = 1e6  # deviations that stand for a plant that runs away, and for what is no number


class Stopped(Exception):
    """The caller asked for a stop between two evaluations."""


class Problem:
    """A subject held against recordings.

    ``links``: names of those that have a floor. ``effects``: the catalogue by name. ``misfit``:
    link to s^2 (at least 1), the chi-square per sample that even a data-driven model leaves;
    residuals are divided by its root. ``prepared``: recording name to ``Subject.prepare``.
    ``fold_of_block``: (B,) fold of every block; ``blocks_of``: recording name to its
    blocks, each ``block_s`` long. ``waves``: by effect that swings over an angle
    where fits begin besides its own starts (waves.py).
    """

    def __init__(
        self,
        subject: Subject,
        recordings: Sequence[Recording],
        floors: Mapping[str, Floor],
        misfit: Mapping[str, float] | None = None,
        without: Iterable[str] = (),
        prepared: Mapping[str, object] | None = None,
        stop: Callable[[], bool] | None = None,
    ) -> None:
        self.subject, self.floors, self.recordings = subject, floors, tuple(recordings)
        self.links = tuple(link.name for link in subject.links if link.name in floors)
        left_out = set(without)
        self.knobs: Mapping[str, Knob] = subject.knobs
        self.effects: dict[str, Effect] = {
            e.name: _with_other_starts(e, self.knobs)
            for e in subject.catalogue
            if not {e.name, e.family} & left_out
        }
        self.nominal = tuple(knob.key for knob in subject.nominal)
        self.prepared = (
            dict(prepared)
            if prepared
            else dict(
                zip((r.name for r in recordings), each(subject.prepare, recordings), strict=True)
            )
        )
        self.scale = {link: float(np.sqrt((misfit or {}).get(link, 1.0))) for link in self.links}
        self._stop = stop
        self._lock = threading.Lock()
        self.evaluations = 0
        self._strength: dict[str, tuple[str, ...]] = {}
        self._weights: dict[tuple[str, str], np.ndarray | float] = {}
        self._first: Problem | None = None  # whose links tell strengths at less cost
        self.waves: dict[str, tuple[dict[str, float], ...]] = {}
        self.designs: dict[
            str, Design
        ] = {}  # of the generic model, by link: they hang on recordings and floors alone
        self._lay_out()

    def _lay_out(self) -> None:
        """Which samples count, and which block each belongs to."""
        rate = self.subject.rate_hz
        seconds = {r.name: r.samples * r.period_s for r in self.recordings}
        self.block_s = max(BLOCK_S, sum(seconds.values()) / MOST_BLOCKS)
        self._keep: dict[tuple[str, str], np.ndarray] = {}
        ids: dict[str, list[np.ndarray]] = {link: [] for link in self.links}
        chunks, first = [], 0
        self.blocks_of: dict[str, range] = {}
        for r in self.recordings:
            count = max(int(np.ceil(seconds[r.name] / self.block_s)), 1)
            for link in self.links:
                white = self._whitened(r.name, link, {})
                keep = np.isfinite(white)
                self._keep[r.name, link] = keep
                ids[link].append(
                    first
                    + np.minimum(
                        (np.flatnonzero(keep) / rate / self.block_s).astype(int), count - 1
                    )
                )
            chunks += [(r.name, chunk) for chunk in chunks_of(r, count, self.block_s)]
            self.blocks_of[r.name] = range(first, first + count)
            first += count
        self.blocks = first
        order = {chunk: i for i, chunk in enumerate(dict.fromkeys(chunks))}
        self.fold_of_block = np.array([order[chunk] % FOLDS for chunk in chunks])
        self.edges = {
            link: np.searchsorted(np.concatenate(ids[link]), np.arange(first + 1))
            for link in self.links
        }
        self.links = tuple(link for link in self.links if self.edges[link][-1] > 0)

    def rescaled(self, misfit: Mapping[str, float]) -> "Problem":
        """The same problem with residuals divided by the root of another s^2, link by link."""
        made = copy.copy(self)
        made.scale = {link: float(np.sqrt(misfit[link])) for link in self.links}
        return made

    def on(
        self,
        recordings: Sequence[Recording],
        subject: Subject | None = None,
        floors: Mapping[str, Floor] | None = None,
    ) -> "Problem":
        """The same effects and scale held against other recordings; by ``subject`` with its
        ``floors``, where another one of the same rig judges them.
        """
        made = Problem(
            subject or self.subject,
            recordings,
            floors or self.floors,
            {link: scale**2 for link, scale in self.scale.items()},
            prepared=self._prepared_of(recordings) if subject is None else None,
            stop=self._stop,
        )
        made.effects, made.waves, made._first = self.effects, self.waves, self
        return made

    def _prepared_of(self, recordings: Sequence[Recording]) -> dict[str, object] | None:
        """What is prepared of these, where all of them are the problem's own."""
        own = all(any(one is known for known in self.recordings) for one in recordings)
        return {one.name: self.prepared[one.name] for one in recordings} if own else None

    def asking(self, subject: Subject) -> "Problem":
        """The same rig, recordings, floors and scale, asked for another catalogue."""
        made = copy.copy(self)
        made.subject, made.knobs, made.effects = (
            subject,
            subject.knobs,
            {effect.name: effect for effect in subject.catalogue},
        )
        made.waves, made._strength, made._weights, made._first = {}, {}, {}, None
        return made

    def bounded(self, bounds: Mapping[str, tuple[float, float]]) -> "Problem":
        """The same problem in which some knobs have other bounds; one between equal ones stands
        where it is put.
        """
        made = copy.copy(self)
        made.knobs = {
            **self.knobs,
            **{
                key: self.knobs[key]._replace(low=low, high=high, spread=self.spread(key))
                for key, (low, high) in bounds.items()
            },
        }
        return made

    def only(self, links: Iterable[str]) -> "Problem":
        """The same problem with some of its links."""
        made = copy.copy(self)
        made.links = tuple(links)
        return made

    def samples(self, link: str) -> int:
        """How many samples of a link's residual count, over all recordings. Raises KeyError for an
        unknown link.
        """
        return int(self.edges[link][-1])

    def judged(self, recording: str, link: str) -> np.ndarray:
        """(n,) bool: which samples of a link's residual count in a recording; none of one that is
        set aside.
        """
        return self._keep[recording, link]

    def _whitened(self, recording: str, link: str, values: Values) -> np.ndarray:
        floor = self.floors[link]
        with np.errstate(over="ignore", invalid="ignore"):  # a plant that runs away
            counts, ready = self._weight(recording, link), self.prepared[recording]
            left = left_over(self.subject, ready, values, floor, recording, counts)
            white = floor.whiten(left) / self.scale[link]
        return np.where(np.isfinite(white), np.clip(white, -ABSURD, ABSURD), white)

    def _weight(self, recording: str, link: str) -> np.ndarray | float:
        """As ``floor.weight``, made once."""
        key = recording, link
        if key not in self._weights:
            made = weight(self.subject, self.prepared[recording], self.floors[link])
            self._weights[key] = made
        return self._weights[key]

    def residual(self, values: Values, link: str) -> np.ndarray:
        """(samples(link),) whitened residual over all recordings. Raises Stopped when the caller
        asked for it.
        """
        self._asked()
        return np.concatenate(
            each(
                lambda r: self._whitened(r.name, link, values)[self._keep[r.name, link]],
                self.recordings,
            )
        )

    def _asked(self) -> None:
        if self._stop is not None and self._stop():
            raise Stopped
        with self._lock:
            self.evaluations += 1

    def touched(self, keys: Iterable[str]) -> tuple[str, ...]:
        """Links that any of the knobs may change, in the order of the rig."""
        found = {link for key in keys for link in self.subject.touched(key)}
        return tuple(link for link in self.links if link in found)

    def spread(self, key: str) -> float:
        """Distance by which a knob is scaled."""
        knob = self.knobs[key]
        return (
            knob.spread
            if knob.spread > 0.0
            else max(0.1 * abs(knob.value), 0.05 * (knob.high - knob.low), 1e-12)
        )

    def kept(self, values: Values, effects: Iterable[str]) -> dict[str, float]:
        """What remains of values where these effects alone stay on: theirs and the nominal
        parameters'.
        """
        keys = {*self.nominal, *(key for name in effects for key in self.effects[name].knobs)}
        return {key: value for key, value in values.items() if key in keys}

    def step(self, key: str, at: float) -> float:
        """Signed step for a derivative that stays within the knob's bounds."""
        size = self.subject.finite_step * self.spread(key)
        return size if at + size <= self.knobs[key].high else -size

    def derivative(self, values: Values, key: str, link: str, here: np.ndarray) -> np.ndarray:
        """(n,) change of a link's residual per spread of a knob; nothing of one that cannot move,
        or beside which its law has no finite value. Raises Stopped, and KeyError for an unknown
        knob.
        """
        if self.knobs[key].low == self.knobs[key].high:
            return np.zeros_like(here)
        at = values.get(key, self.knobs[key].value)
        step = self.step(key, at)
        moved = self.change({**values, key: at + step}, values, link, here)
        if not np.isfinite(moved).all():
            return np.zeros_like(here)
        return moved * (self.spread(key) / step)

    def change(
        self, values: Values, at: Values, link: str, here: np.ndarray, far: bool = False
    ) -> np.ndarray:
        """(n,) a link's residual at ``values`` less that at ``at``, which is ``here``. ``far``: as
        far apart as an effect of typical strength takes them. Raises Stopped.
        """
        if not self.subject.has_change:
            return self.residual(values, link) - here
        self._asked()
        cheaper = self.subject.change
        made = each(lambda r: cheaper(self.prepared[r.name], values, at, far), self.recordings)
        if any(one is None for one in made):
            return self.residual(values, link) - here
        floor = self.floors[link]
        return (
            np.concatenate(
                [
                    floor.whiten(one * self._weight(r.name, link))[self._keep[r.name, link]]
                    for r, one in zip(self.recordings, made, strict=True)
                ]
            )
            / self.scale[link]
        )

    def near(self, point: "Point", values: Values, link: str) -> np.ndarray:
        """(n,) a link's residual at ``values``, from what the rougher model changes of a point's
        where the subject has one. Raises Stopped.
        """
        if not self.subject.has_change:
            return self.residual(values, link)
        here = point.residual[link]
        return here + self.change(values, point.values, link, here, far=True)

    @property
    def in_plant(self) -> frozenset[str]:
        """Effects that the plant file has."""
        return frozenset(
            name
            for name, effect in self.effects.items()
            for knob in (self.knobs[key] for key in effect.knobs)
            if knob.absent is not None and knob.value != knob.absent
        )

    def strength(self, effect: str) -> tuple[str, ...]:
        """Knobs that switch an effect off, each on its own or, where none does, the fewest
        together; the others shape it.
        """
        if len(self.effects[effect].knobs) == 1:
            return self.effects[effect].knobs
        if effect not in self._strength:
            one = self.effects[effect]
            if self._first is not None and self._first.touched(one.knobs):
                self._strength[effect] = self._first.strength(effect)
                return self._strength[effect]
            starts, links = (
                [dict(zip(one.knobs, start, strict=True)) for start in one.starts],
                self.touched(one.knobs),
            )
            bare = {link: self.residual({}, link) for link in links}
            moved = [
                k for k in one.knobs if any(start[k] != self.knobs[k].value for start in starts)
            ]
            zero = [
                k for k in moved if self.knobs[k].value == 0.0
            ]  # a place where something begins is no strength, unless nothing else is

            def off(keys: tuple[str, ...]) -> bool:
                return all(
                    np.array_equal(
                        self.residual({**start, **{k: self.knobs[k].value for k in keys}}, link),
                        bare[link],
                    )
                    for start in starts
                    for link in links
                )

            def fewest(keys: Sequence[str]) -> tuple[str, ...] | None:
                alone = tuple(k for k in keys if off((k,)))
                return alone or next(
                    (
                        some
                        for size in range(2, len(keys) + 1)
                        for some in combinations(keys, size)
                        if off(some)
                    ),
                    None,
                )

            self._strength[effect] = fewest(zero) or (zero != moved and fewest(moved)) or one.knobs
        return self._strength[effect]

    def typical(self, effect: str) -> dict[str, float]:
        """Of each of its strengths how large a typical one is: that of its first start, or what the
        plant file has of it where that is more.
        """
        one = self.effects[effect]
        first = dict(zip(one.knobs, one.starts[0], strict=True))

        def size(key: str) -> float:
            knob = self.knobs[key]
            absent = knob.value if knob.absent is None else knob.absent
            return max(abs(first[key] - absent), abs(knob.value - absent)) or self.spread(key)

        return {key: size(key) for key in self.strength(effect)}

    def each(self, function, items: Sequence) -> list:
        """``function`` of every item, in order, on both processors."""
        return each(function, items)


def _with_other_starts(effect: Effect, knobs: Mapping[str, Knob]) -> Effect:
    """The effect, where one of its starts is what the plant file has of it, from its absence in
    place of that: else nothing would ask whether the rig has it.
    """
    here = tuple(knobs[key].value for key in effect.knobs)
    gone = tuple(
        knob.value if knob.absent is None else knob.absent
        for knob in (knobs[key] for key in effect.knobs)
    )
    return effect._replace(starts=tuple(gone if one == here else one for one in effect.starts))
