"""A rig of others held against its own healthy runs: what changed since.

What every healthy run has is taken off. What healthy runs differ by is a nuisance of each run,
bounded by what one more healthy run may differ by. Every number of the plant that the plant file
states is an effect of its own: it may have changed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.config.units import suffix_of
from epa_rt.gap.diagnosis import Change
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.component import Experiment
from epa_rt.gap.rig.foreign.healthy import (
    BOUND,
    Healthy,
    LinkHealth,
    beyond,
    levels_in,
    measured,
    of_few,
    quantity_keys,
    shapes_of,
)
from epa_rt.gap.subject import CHANGED, OF_RUN, Plain, Usual, Values
from epa_rt.models.effect import Effect, Knob

TYPICAL = 0.1  # part of a stated number by which it changes, from which fits begin
CLOCK = "clock."  # begins the key of how rows were logged, which no wear changes


@dataclass(frozen=True)
class Ready:
    """A recording: the rig's own preparation, and by link what is known (n,), what wanders (n, k)
    and by what the residual is weighed (n,).
    """

    own: object
    run: str
    known: Mapping[str, np.ndarray]
    wander: Mapping[str, np.ndarray]
    weights: Mapping[str, np.ndarray]


class SinceBaseline(Plain):
    """See ``gap/subject.py``. ``runs``: names of the recordings whose levels are fitted; of others
    the levels that suit best are taken off, within the same bounds.
    """

    def __init__(self, healthy: Healthy, runs: Sequence[str] = ()) -> None:
        own = healthy.subject
        self.healthy, self.own, self._runs = healthy, own, tuple(runs)
        self._bound = BOUND * of_few(len(healthy.runs))
        self.usual = Usual(
            len(healthy.runs), {name: one.off for name, one in healthy.links.items()}
        )
        self.name, self.rate_hz, self.lowpass_hz = own.name, own.rate_hz, own.lowpass_hz
        self.links = tuple(link for link in own.links if link.name in healthy.links)
        self.rig, self.plant, self.without_stop = own.rig, own.plant, own.without_stop
        stated = [k for k in own.nominal if k.value != 0.0 and not k.key.startswith(CLOCK)]
        changed = [_changed(knob) for knob in stated]
        self.catalogue: tuple[Effect, ...] = (*own.catalogue, *changed)
        self._link_of: dict[str, str] = {}
        wandering: dict[str, Knob] = {}
        for name in self._runs:
            for link, one in healthy.links.items():
                for i, spread in enumerate(one.spread):
                    key, bound = self._key(name, link, i), self._bound * float(spread)
                    wandering[key] = Knob(key, "1", 0.0, -bound, bound, float(spread))
                    self._link_of[key] = link
        renamed = {
            knob.key: knob._replace(effect=effect.name)
            for knob, effect in zip(stated, changed, strict=True)
        }
        # a clock that stands apart is one and the same in all runs: it stays where they put it
        self.knobs: dict[str, Knob] = {
            **{key: knob for key, knob in own.knobs.items() if knob.effect is not None},
            **renamed,
            **wandering,
        }
        self.nominal: tuple[Knob, ...] = tuple(wandering.values())

    @staticmethod
    def _key(run: str, link: str, i: int) -> str:
        return f"{OF_RUN}{run}.{link}_{i + 1}"

    def of_any_run(self) -> "SinceBaseline":
        """As Subject.of_any_run: of all of them the levels that suit best are taken off."""
        return SinceBaseline(self.healthy)

    def touched(self, key: str) -> tuple[str, ...]:
        """As Subject.touched; KeyError for an unknown number."""
        return (self._link_of[key],) if key in self._link_of else self.own.touched(key)

    def prepare(self, recording: Recording) -> Ready:
        """As ForeignSubject.prepare, with what the healthy runs say of this one."""
        own = self.own.prepare(recording)
        found = {link.name: self.healthy.known(own, link.name) for link in self.links}
        return Ready(
            own,
            recording.name,
            {name: known for name, (known, _, _) in found.items()},
            {name: wander for name, (_, wander, _) in found.items()},
            {name: weights for name, (_, _, weights) in found.items()},
        )

    def residual(self, prepared: Ready, values: Values, link: str) -> np.ndarray:
        """As Subject.residual, weighed so that the healthy runs' noise has one size wherever the
        rig is; NaN also where a term of their map has no value.
        """
        plain = {key: value for key, value in values.items() if not key.startswith(OF_RUN)}
        weights = prepared.weights[link]
        left = weights * (self.own.residual(prepared.own, plain, link) - prepared.known[link])
        spread = self.healthy.links[link].spread
        shapes = weights[:, None] * prepared.wander[link]
        if not len(spread):
            return left
        if prepared.run in self._runs:
            keys = [self._key(prepared.run, link, i) for i in range(len(spread))]
            level = np.array([values.get(key, 0.0) for key in keys])
        else:
            level = _within(left, shapes, spread, self.healthy.links[link].noise, self._bound)
        return left - shapes @ level

    def features(self, prepared: Ready, link: str) -> Mapping[str, np.ndarray]:
        """As Subject.features."""
        return self.own.features(prepared.own, link)

    def free_run(self, recording: Recording, values: Values, seed: int | None) -> Recording | None:
        """None: what healthy runs leave has no model of the whole."""
        return None

    def repeats(
        self, recording: Recording, values: Values | None = None
    ) -> dict[str, np.ndarray] | None:
        """By link what the healthy runs leave beside their levels, NaN between runs."""
        return {name: one.noise for name, one in self.healthy.links.items()}

    def patched(self, values: Values, effects: Sequence[str]) -> str:
        """As ForeignSubject.patched, of the plant as the healthy runs have it."""
        known = {effect.name for effect in self.own.catalogue}
        plain = {key: value for key, value in values.items() if not key.startswith(OF_RUN)}
        return self.own.patched(plain, [name for name in effects if name in known])

    def menu(self) -> tuple[Experiment, ...]:
        """None: what a baseline says holds for its own experiment."""
        return ()

    def role_of(self, link: str) -> str:
        """As ForeignSubject.role_of."""
        return self.own.role_of(link)

    def changes(self, recordings: Sequence[Recording]) -> tuple[Change, ...]:
        """What the plant's numbers are in these recordings, in spreads of the healthy runs, the
        furthest first, and how far each link's levels are off as a whole. A spread is that of the
        mean of as many more healthy runs.
        """
        found = []
        made = [self.own.prepare(one) for one in recordings]
        for link, health in self.healthy.links.items():
            unit = next(one.unit for one in self.links if one.name == link)
            shapes = [self._shapes(one, link) for one in made]
            each = [self._levels(*one, link) for one in zip(made, shapes, strict=True)]
            found.append(_as_a_whole(health, link, unit, np.mean(each, axis=0), shapes))
            told = not self.healthy.impossible(link)
            rows = [q for q in self.healthy.quantities if told and q.link == link]
            # fitted beside the same others as those of the healthy runs were
            keys = [key for key in quantity_keys(self.own) if link in self.own.touched(key)]
            own = [measured(self.own, one, health, link, keys) for one in made] if rows else []
            for q in rows:
                now = np.array([values[keys.index(q.key)] for values in own])
                if np.all(beyond(self.own.knobs[q.key], now) <= 0.0):  # a NaN is not
                    found.append(_change(q.key, q.unit, q.values, now))
        return tuple(sorted(found, key=lambda one: -abs(one.spreads)))

    def not_told_apart(self) -> tuple[str, ...]:
        """Effects of the plant's numbers that the motion of the healthy runs cannot tell from each
        other: at one speed dry friction and drag.
        """
        told = {q.key for q in self.healthy.quantities}
        keys = [key for key in quantity_keys(self.own) if key not in told]
        names = [self.knobs[key].effect for key in keys if key in self.knobs]
        return tuple(name for name in names if name is not None)

    def _shapes(self, prepared: object, link: str) -> np.ndarray:
        """(n, j) what a run's levels make of a link's residual, in its unit and weighed."""
        health, (_, _, weights) = self.healthy.links[link], self.healthy.known(prepared, link)
        shapes = shapes_of(self.own, prepared, link, health.levels) @ health.basis
        return np.asarray(weights[:, None] * shapes)

    def _levels(self, prepared: object, shapes: np.ndarray, link: str) -> np.ndarray:
        """(j,) a run's levels less the mean of the healthy runs'."""
        known, _, weights = self.healthy.known(prepared, link)
        left = weights * (self.own.residual(prepared, {}, link) - known)
        return levels_in(left, shapes, self.healthy.links[link].floor)


def _as_a_whole(
    health: LinkHealth, link: str, unit: str, apart: np.ndarray, shapes: Sequence[np.ndarray]
) -> Change:
    """The rms over the logs that levels ``apart`` (j,) make by their ``shapes`` (n, j), against
    what the levels of the healthy runs make there.
    """
    rows, runs = np.concatenate(shapes), len(health.apart)

    def made(levels: np.ndarray) -> float:
        return float(np.sqrt(np.nanmean((rows @ levels) ** 2)))

    off, usual = made(apart), float(np.sqrt(np.mean([made(one) ** 2 for one in health.apart])))
    spread = usual * float(np.sqrt(runs / (runs - 1.0) * (1.0 / len(shapes) + 1.0 / runs)))
    spread = max(spread * of_few(runs), 1e-300)
    return Change(f"{link} as a whole", unit, 0.0, spread, off, off / spread)


def _changed(knob: Knob) -> Effect:
    """A stated number of the plant that is another one now."""
    block, _, name = knob.key.partition(".")
    plain = name.removesuffix(suffix_of(knob.unit))
    starts = tuple(
        (float(np.clip(knob.value * (1.0 + part), knob.low, knob.high)),)
        for part in (TYPICAL, -TYPICAL)
    )
    return Effect(
        f"{plain}{CHANGED}",
        plain,
        block,
        (knob.key,),
        starts,
        f"another {plain} than in the healthy runs",
        f"{knob.key} is not that of the baseline",
        "the baseline of healthy runs",
    )


def _change(key: str, unit: str, before: np.ndarray, now: np.ndarray) -> Change:
    spread = float(np.std(before, ddof=1) * np.sqrt(1.0 / len(now) + 1.0 / len(before)))
    spread *= of_few(len(before))
    mean, here = float(before.mean()), float(now.mean())
    return Change(key, unit, mean, spread, here, (here - mean) / max(spread, 1e-300))


def _within(
    left: np.ndarray,
    shapes: np.ndarray,
    spread: np.ndarray,
    noise: np.ndarray,
    bound: float = BOUND,
) -> np.ndarray:
    """(k,) levels of one run that suit its residual best, each within ``bound`` spreads, its spread
    believed.
    """
    from scipy.optimize import lsq_linear

    rows = np.isfinite(left) & np.isfinite(shapes).all(axis=1)
    if not rows.any():
        return np.zeros(len(spread))
    scaled = shapes[rows] * spread
    variance = max(float(np.nanvar(noise)), 1e-300)
    root = np.linalg.cholesky(scaled.T @ scaled / variance + np.eye(len(spread)))
    right = np.linalg.solve(root, scaled.T @ left[rows] / variance)
    return np.asarray(lsq_linear(root.T, right, (-bound, bound), method="bvls").x) * spread
