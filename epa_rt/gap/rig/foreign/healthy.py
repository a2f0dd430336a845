"""What healthy runs of a rig say: its own numbers, what its plant leaves of them, and by how much
one run differs from the next.

The plant file's numbers are refitted to the runs. What it then leaves is split in three. A fixed
part returns in every run: levels, and a map over the measured states. Some directions wander from
run to run, such as a level of friction or a zero: principal components of the runs' levels. The
rest is noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from epa_rt.config.rig_rows import PLACES
from epa_rt.gap.likelihood.floor import Floor, fitted, floors
from epa_rt.gap.likelihood.generic import CLIP, RIDGES
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.likelihood.regressors import SPEEDS, terms
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.region_noise import RegionNoise, region_noise
from epa_rt.gap.rig.foreign.repeats import colourless
from epa_rt.gap.rig.foreign.subject import ForeignSubject
from epa_rt.gap.subject import FINITE_STEP
from epa_rt.models.effect import Effect, Knob

FEWEST = 3  # runs from which Student's t of the next one has a mean size: from two it has none
# runs that the plant's numbers are fitted to, evenly chosen; the levels come from all of them
MOST_FITTED = 6  # by scripts/baseline_numbers.py
LEVELS = ("coulomb", "offset")  # effects that any sliding part has some of
# of the mean variance, below which a direction of the levels is the differences' own error
FLAT = FINITE_STEP**2
RARE = 1e-3  # share of healthy runs that lie further off in one direction
BOUND = 4.0  # spreads at which that share is reached; the unit of a wander's spread
# both by scripts/baseline_numbers.py, between what has to pass and what has to fail
LIKE = 0.3  # part by which a run's places and speeds may differ from the others'
TOLD_APART = 50.0  # variance inflation up to which a quantity's change is its own


States = dict[tuple[str, str], tuple[np.ndarray, np.ndarray]]  # by link and state: its two ends


class NotHealthy(Exception):
    """Why runs are no baseline, as one sentence."""


@dataclass(frozen=True)
class LinkHealth:
    """Of one link. ``levels``: changes whose shapes span ``basis`` (m, j), which makes columns of
    them that, behind the floor's filter, are unit rms. ``mean`` (j,): on those, of all runs;
    ``apart`` (runs, j): of each less that. ``wander`` (j, k): directions; ``spread`` (k,): of one
    more run, in the link's unit. ``weights``, ``centre``, ``scale`` (p,): of the map's terms.
    ``noise`` (n,): what is left of the runs, NaN between; ``floor``: its size and colour.
    ``off``: by how much chi-square per sample differs from run to run, a deviation. All of it is
    of residuals weighed by ``regions``, so that their noise has one size.
    """

    levels: tuple["Level", ...]
    basis: np.ndarray
    mean: np.ndarray
    apart: np.ndarray
    wander: np.ndarray
    spread: np.ndarray
    weights: np.ndarray
    centre: np.ndarray
    scale: np.ndarray
    noise: np.ndarray
    floor: Floor
    off: float
    regions: RegionNoise


class Level(NamedTuple):
    """A change of a plant's numbers, that may differ from run to run. ``values``: of those that
    change; ``times``: of what it does, to be that of a typical one.
    """

    values: Mapping[str, float]
    times: float


@dataclass(frozen=True)
class Quantity:
    """A number of the plant as each healthy run has it: ``values`` (runs,)."""

    key: str
    unit: str
    link: str
    values: np.ndarray


@dataclass(frozen=True)
class Healthy:
    """``subject``: the rig with its numbers refitted to ``runs`` (their names). ``states``: by link
    and state the least and the largest of what the runs have of it: lower quantile, upper one.
    """

    subject: ForeignSubject
    runs: tuple[str, ...]
    links: Mapping[str, LinkHealth]
    quantities: tuple[Quantity, ...]
    states: Mapping[tuple[str, str], tuple[np.ndarray, np.ndarray]]
    experiments: frozenset[str]

    def known(self, prepared: object, link: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(n,) what every run has of a link, (n, k) the shapes by which runs differ, and (n,) by
        what the residual is weighed; the first two are not weighed.
        """
        own = self.links[link]
        shapes = shapes_of(self.subject, prepared, link, own.levels) @ own.basis
        table = standard(mapped(self.subject, prepared, link), own.centre, own.scale)
        weights = own.regions.weights(self.subject.features(prepared, link))
        return shapes @ own.mean + table @ own.weights, shapes @ own.wander, weights

    def impossible(self, link: str) -> tuple[Quantity, ...]:
        """Numbers of a link that in some run would be what they cannot be: the plant lacks so much
        of what every run has that straight lines from it lead nowhere.
        """
        return tuple(
            q
            for q in self.quantities
            if q.link == link and np.any(beyond(self.subject.knobs[q.key], q.values) > 0.0)
        )

    def check(self, recordings: Sequence[Recording]) -> None:
        """Raises NotHealthy where a recording is of another experiment than the runs."""
        for one in recordings:
            if one.experiment and self.experiments and one.experiment not in self.experiments:
                raise NotHealthy(
                    f"{one.name}: found a log of the experiment '{one.experiment}', expected that"
                    f" of the baseline, '{', '.join(sorted(self.experiments))}'"
                )
            prepared = self.subject.prepare(one)
            for link, own in self.links.items():
                _same_terms(one.name, mapped(self.subject, prepared, link), len(own.weights))
            for (link, name), ends in states_of(self.subject, [one]).items():
                _alike(one.name, name, ends, self.states[link, name])


def beyond(knob: Knob, values: np.ndarray) -> np.ndarray:
    """(n,) by how much numbers are outside of what a knob can be; not above 0 within."""
    return np.maximum(knob.low - values, values - knob.high)


def healthy_from(subject: ForeignSubject, runs: Sequence[Recording]) -> Healthy:
    """What ``runs`` of one rig and experiment say. Raises NotHealthy where they are too few or
    differ in their motion.
    """
    if len(runs) < FEWEST:
        raise NotHealthy(
            f"found {len(runs)} healthy run{'' if len(runs) == 1 else 's'} as a baseline, expected"
            f" {FEWEST} or more: how much runs differ is not known from less (ten are better)"
        )
    states = states_of(subject, runs)
    experiments = {one.experiment for one in runs if one.experiment}
    if len(experiments) > 1:
        raise NotHealthy(
            f"found healthy runs of the experiments {', '.join(sorted(experiments))}, expected one"
        )
    for (_, name), ends in states.items():
        for i, one in enumerate(runs):
            _alike(one.name, name, tuple(end[i : i + 1] for end in ends), ends, "the other runs")
    own = refitted(subject, runs)
    made = [own.prepare(run) for run in runs]
    links = {
        link.name: found
        for link in own.links
        if (found := _of_link(own, made, [one.name for one in runs], link.name)) is not None
    }
    if not links:
        raise NotHealthy(
            "found nothing that can be judged in the healthy runs, expected longer ones"
        )
    return Healthy(
        own,
        tuple(one.name for one in runs),
        links,
        tuple(q for name in links for q in _quantities(own, made, name, links[name])),
        states,
        frozenset(experiments),
    )


def shapes_of(
    subject: ForeignSubject, prepared: object, link: str, levels: Sequence[Level]
) -> np.ndarray:
    """(n, m) what each level changes of a link's residual; 0 where it is not judged."""
    bare = subject.residual(prepared, {}, link)
    return np.column_stack(
        [
            np.nan_to_num((subject.residual(prepared, one.values, link) - bare) * one.times)
            for one in levels
        ]
    )


def level_of(subject: ForeignSubject, key: str) -> Level:
    """One number by its spread, linearised."""
    knob = subject.knobs[key]
    size = FINITE_STEP * (knob.spread or 1.0)
    step = size if knob.value + size <= knob.high else -size
    return Level({key: knob.value + step}, (knob.spread or 1.0) / step)


def mapped(subject: ForeignSubject, prepared: object, link: str) -> np.ndarray:
    """(n, p) terms of the map: what a link's residual may depend on, of measured states."""
    groups = terms(subject.features(prepared, link), subject.rate_hz)
    return np.column_stack([groups[name] for name in sorted(groups)])


def standard(table: np.ndarray, centre: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """(n, p) terms of the map in deviations of the healthy runs, none beyond ``CLIP``."""
    return np.clip((table - centre) / scale, -CLIP, CLIP)


def refitted(
    subject: ForeignSubject, runs: Sequence[Recording], most: int = MOST_FITTED
) -> ForeignSubject:
    """The rig with nominal parameters, the plant file's effects and levels fitted to ``most`` of
    the runs. All rows count alike: the runs tell how much is left around reversals.
    """
    subject = subject.evenly()
    chosen = [runs[i] for i in np.unique(np.linspace(0, len(runs) - 1, most).astype(int))]
    there = {effect.name for effect in subject.catalogue}
    effects = tuple(
        dict.fromkeys(name for name in (*subject.plant.effects, *LEVELS) if name in there)
    )
    problem = Problem(subject, chosen, floors(subject, chosen[:1], {}))
    values = settled(problem, effects).values
    plant = replace(
        subject.plant, numbers={**subject.plant.numbers, **values}, effects=tuple(effects)
    )
    return ForeignSubject(subject.rig, plant, subject.leave_out, even=True)


def _levels(subject: ForeignSubject, link: str) -> tuple[Level, ...]:
    """What may differ from run to run: each nominal parameter, and each law at a typical strength,
    but for waves over an angle, whose periods nobody knows.
    """
    keys = [knob.key for knob in subject.nominal]
    keys += [effect.knobs[0] for effect in subject.catalogue if len(effect.knobs) == 1]
    laws = [
        Level(dict(zip(effect.knobs, effect.starts[0], strict=True)), 1.0)
        for effect in subject.catalogue
        if len(effect.knobs) > 1 and not effect.swings_over and link in _links(subject, effect)
    ]
    return (*(level_of(subject, key) for key in keys if link in subject.touched(key)), *laws)


def _links(subject: ForeignSubject, effect: Effect) -> set[str]:
    return {link for key in effect.knobs for link in subject.touched(key)}


@dataclass
class _Run:
    """Judged rows of one run, weighed: ``left`` (n,), ``shapes`` (n, j), ``table`` (n, p)."""

    left: np.ndarray
    shapes: np.ndarray
    table: np.ndarray

    def without_shapes(self) -> tuple[np.ndarray, np.ndarray]:
        """The residual and the terms less what the run's own levels explain of them."""
        q, _ = np.linalg.qr(self.shapes)
        return self.left - q @ (q.T @ self.left), self.table - q @ (q.T @ self.table)

    def levels(self, weights: np.ndarray) -> np.ndarray:
        """(j,) the run's levels beside the map."""
        return np.linalg.lstsq(self.shapes, self.left - self.table @ weights, rcond=None)[0]


def _same_terms(run: str, table: np.ndarray, width: int) -> None:
    """Raises NotHealthy where a run's map has other terms: one of its states does not move."""
    if table.shape[1] != width:
        raise NotHealthy(
            f"{run}: found a measured state that stands still, or moves where it did not in the"
            " baseline, expected runs of one experiment"
        )


def _of_link(
    subject: ForeignSubject, made: Sequence[object], names: Sequence[str], link: str
) -> LinkHealth | None:
    levels = _levels(subject, link)
    parts: list[_Part] = []
    for one in made:
        left, table = subject.residual(one, {}, link), mapped(subject, one, link)
        rows = np.isfinite(left) & np.isfinite(table).all(axis=1)
        if parts:
            _same_terms(names[len(parts)], table, parts[0].table.shape[1])
        shapes, features = shapes_of(subject, one, link, levels), subject.features(one, link)
        parts.append(_Part(left, shapes, table, rows, features))
    if min(part.rows.sum() for part in parts) < 4 * len(levels):
        return None
    even = [np.ones(len(part.left)) for part in parts]
    regions = region_noise(_split(parts, even).noise, [part.features for part in parts])
    weighed = [regions.weights(part.features) for part in parts]
    parts = [
        part._replace(rows=part.rows & np.isfinite(by))
        for part, by in zip(parts, weighed, strict=True)
    ]
    own = _split(parts, weighed)
    noise = np.concatenate([x for left in own.noise for x in (left, [np.nan])])
    if subject.rig.component.flat:
        noise = colourless(noise)
    floor = fitted(link, [noise], "repeats")
    white = [floor.whiten(left) for left in own.noise]
    basis, found = _levels_of(own, parts, weighed, floor)
    samples = float(np.mean([np.isfinite(one).sum() for one in white]))
    wander, spread = _wander(found, samples)
    return LinkHealth(
        levels,
        basis,
        found.mean(axis=0),
        found - found.mean(axis=0),
        wander,
        spread,
        own.weights,
        own.centre,
        own.scale,
        noise,
        floor,
        _off(white, own.basis.shape[1]),
        regions,
    )


def _off(white: Sequence[np.ndarray], levels: int) -> float:
    """By how much chi-square per sample differs from one run to the next, beyond what it does of
    white noise: a deviation. Each run has fitted so many levels of its own.
    """
    samples = np.array([np.isfinite(one).sum() for one in white]) - levels
    each = np.array([np.nansum(one**2) for one in white]) / samples
    return float(np.sqrt(max(np.var(each, ddof=1) - np.mean(2.0 / samples), 0.0)))


def levels_in(left: np.ndarray, shapes: np.ndarray, floor: Floor) -> np.ndarray:
    """(j,) levels that suit a run best, by generalised least squares: residual (n,) and shapes (n,
    j) behind the floor's filter, so that a level is known as well as the judging knows it.
    """
    left, shapes = floor.whiten(left), floor.whiten(shapes)
    rows = np.isfinite(left) & np.isfinite(shapes).all(axis=1)
    return np.linalg.lstsq(shapes[rows], left[rows], rcond=None)[0]


def _levels_of(
    own: "_Split", parts: Sequence["_Part"], weighed: Sequence[np.ndarray], floor: Floor
) -> tuple[np.ndarray, np.ndarray]:
    """(m, j) basis, columns of unit rms behind the floor's filter, and (runs, j) levels on it."""
    shapes, lefts, whites = [], [], []
    for part, by in zip(parts, weighed, strict=True):
        table = standard(part.table, own.centre, own.scale)
        judged = np.where(part.rows, by, np.nan)
        shapes.append(judged[:, None] * part.shapes)
        lefts.append(judged * (part.left - table @ own.weights))
        white = floor.whiten(shapes[-1])
        whites.append(white[np.isfinite(white).all(axis=1)])
    basis = _unit(np.concatenate(whites))
    made = [levels_in(left, one @ basis, floor) for left, one in zip(lefts, shapes, strict=True)]
    return basis, np.array(made)


class _Part(NamedTuple):
    """A run: ``left`` (n,), ``shapes`` (n, m), ``table`` (n, p), which ``rows`` (n,) are judged,
    and its features.
    """

    left: np.ndarray
    shapes: np.ndarray
    table: np.ndarray
    rows: np.ndarray
    features: Mapping[str, np.ndarray]


class _Split(NamedTuple):
    """Runs parted in what LinkHealth has. ``levels`` (runs, j); ``noise``: by run (n,), NaN where
    it is not judged.
    """

    basis: np.ndarray
    levels: np.ndarray
    weights: np.ndarray
    centre: np.ndarray
    scale: np.ndarray
    noise: list[np.ndarray]


def _split(parts: Sequence[_Part], weighed: Sequence[np.ndarray]) -> _Split:
    """Levels, map and noise of runs whose residuals are ``weighed`` by (n,) each."""
    basis = _unit(
        np.concatenate(
            [(w[:, None] * p.shapes)[p.rows] for p, w in zip(parts, weighed, strict=True)]
        )
    )
    whole = np.concatenate([part.table[part.rows] for part in parts])
    centre, scale = whole.mean(axis=0), whole.std(axis=0)
    scale[~(scale > 0.0)] = 1.0
    runs = []
    for part, by in zip(parts, weighed, strict=True):
        rows, w = part.rows, by[part.rows, None]
        table = standard(part.table[rows], centre, scale)
        runs.append(_Run(w[:, 0] * part.left[rows], w * part.shapes[rows] @ basis, w * table))
    weights, rest = _map(runs)
    noise = []
    for part, left in zip(parts, rest, strict=True):
        noise.append(np.full(len(part.rows), np.nan))
        fitted_too = len(left) / max(len(left) - basis.shape[1], 1)  # to its own levels
        noise[-1][part.rows] = np.sqrt(fitted_too) * left
    levels = np.array([one.levels(weights) for one in runs])
    return _Split(basis, levels, weights, centre, scale, noise)


def _unit(shapes: np.ndarray) -> np.ndarray:
    """(m, j) combinations of columns that are orthonormal in the mean over rows; those that are
    nearly another's are left out.
    """
    size = np.sqrt(np.mean(shapes**2, axis=0))
    size[~(size > 0.0)] = np.inf
    gram = (shapes / size).T @ (shapes / size) / len(shapes)
    variance, vectors = np.linalg.eigh(gram)
    kept = variance > FLAT * np.mean(variance)
    return (vectors[:, kept] / np.sqrt(variance[kept])) / size[:, None]


def _map(runs: Sequence[_Run]) -> tuple[np.ndarray, list[np.ndarray]]:
    """(p,) weights of the map, by the ridge that serves runs left out best, and what is left of
    each run by the map of the others.
    """
    clean = [one.without_shapes() for one in runs]
    grams = [table.T @ table for _, table in clean]
    rights = [table.T @ left for left, table in clean]
    samples, size = sum(len(left) for left, _ in clean), len(rights[0])
    gram, right = sum(grams), sum(rights)

    def solved(matrix: np.ndarray, vector: np.ndarray, ridge: float) -> np.ndarray:
        return np.linalg.solve(matrix + ridge * samples * np.eye(size), vector)

    def left_out(ridge: float) -> list[np.ndarray]:
        return [
            left - table @ solved(gram - own, right - b, ridge)
            for (left, table), own, b in zip(clean, grams, rights, strict=True)
        ]

    found = [(left_out(ridge), ridge) for ridge in RIDGES]
    rest, ridge = min(found, key=lambda one: sum(float(x @ x) for x in one[0]))
    nothing = sum(float(left @ left) for left, _ in clean)
    if sum(float(x @ x) for x in rest) > nothing:
        return np.zeros(size), [left for left, _ in clean]
    return solved(gram, right, ridge), rest


def _wander(own: np.ndarray, samples: float) -> tuple[np.ndarray, np.ndarray]:
    """(j, k) directions in which the runs' levels (runs, j) differ by more than noise makes of
    them, and (k,) the spread of one more run. The levels are in deviations of white noise.

    Of noise alone no direction has more than Marchenko and Pastur's edge.
    """
    count, width = own.shape
    _, sizes, vectors = np.linalg.svd(own - own.mean(axis=0), full_matrices=False)
    deviation = sizes / np.sqrt(count - 1)
    edge = (1.0 + np.sqrt(width / (count - 1.0))) ** 2
    kept = deviation**2 > edge / samples
    return vectors[kept].T, deviation[kept] * np.sqrt(1.0 + 1.0 / count)


def of_few(runs: int) -> float:
    """By what a deviation of so many runs is multiplied, so that ``RARE`` of the next ones lie
    beyond ``BOUND`` of it: Student's t.
    """
    from scipy.stats import t

    return float(t.ppf(1.0 - 0.5 * RARE, runs - 1)) / BOUND


def quantity_keys(subject: ForeignSubject) -> tuple[str, ...]:
    """What is said of a run: its nominal parameters, and its levels of friction and offset."""
    own = [knob.key for knob in subject.nominal if not knob.key.startswith("clock.")]
    levels = [e.knobs[0] for e in subject.catalogue if e.name in LEVELS and len(e.knobs) == 1]
    return (*own, *levels)


def measured(
    subject: ForeignSubject, prepared: object, own: LinkHealth, link: str, keys: Sequence[str]
) -> np.ndarray:
    """(keys,) numbers of the plant that suit a run best beside the map; NaN where its motion cannot
    tell one from the others.
    """
    left = subject.residual(prepared, {}, link)
    table = standard(mapped(subject, prepared, link), own.centre, own.scale)
    by = own.regions.weights(subject.features(prepared, link))
    rows = np.isfinite(left) & np.isfinite(table).all(axis=1) & np.isfinite(by)
    weights = by[rows]
    levels = [level_of(subject, key) for key in keys]
    shapes = weights[:, None] * shapes_of(subject, prepared, link, levels)[rows]
    target = weights * (left[rows] - table[rows] @ own.weights)
    size = np.sqrt(np.mean(shapes**2, axis=0))
    size[~(size > 0.0)] = np.inf
    gram = (shapes / size).T @ (shapes / size) / max(len(shapes), 1) + 1e-9 * np.eye(len(keys))
    inflated = inflation(gram)
    found = np.linalg.solve(gram, (shapes / size).T @ target / max(len(shapes), 1)) / size
    spread = np.array([subject.knobs[key].spread or 1.0 for key in keys])
    at = np.array([subject.knobs[key].value for key in keys])
    return np.where(inflated < TOLD_APART, at - found * spread, np.nan)


def inflation(gram: np.ndarray) -> np.ndarray:
    """(k,) by how much the variance of each number grows as the others are fitted beside it."""
    found: np.ndarray = np.diag(np.linalg.inv(gram)) * np.diag(gram)
    return found


def _quantities(
    subject: ForeignSubject, made: Sequence[object], link: str, own: LinkHealth
) -> list[Quantity]:
    keys = [key for key in quantity_keys(subject) if link in subject.touched(key)]
    if not keys:
        return []
    found = np.array([measured(subject, one, own, link, keys) for one in made])
    return [
        Quantity(key, subject.knobs[key].unit, link, found[:, i])
        for i, key in enumerate(keys)
        if np.isfinite(found[:, i]).all()
    ]


def states_of(subject: ForeignSubject, runs: Sequence[Recording]) -> States:
    """By link and place or speed: (runs,) of the lower and of the upper end, of a speed's size."""
    found: dict[tuple[str, str], list[np.ndarray]] = {}
    for run in runs:
        prepared = subject.prepare(run)
        for link in subject.links:
            for name, values in subject.features(prepared, link.name).items():
                if name.endswith(SPEEDS):
                    ends = np.nanpercentile(np.abs(values), (30.0, 95.0))
                elif name.endswith(PLACES) and not name.endswith("_turn_rad"):
                    ends = np.nanpercentile(values, (2.0, 98.0))
                else:
                    continue
                found.setdefault((link.name, name), []).append(ends)
    return {key: tuple(np.array(ends).T) for key, ends in found.items()}


def _alike(
    run: str,
    state: str,
    ends: tuple[np.ndarray, np.ndarray],
    others: tuple[np.ndarray, np.ndarray],
    whose: str = "the baseline",
) -> None:
    """Raises NotHealthy where a run's ends of a state are off the middle of the others' by more
    than LIKE of their range.
    """
    low, high = (float(np.median(end)) for end in others)
    room = LIKE * (high if state.endswith(SPEEDS) else high - low)
    own_low, own_high = float(ends[0][0]), float(ends[1][0])
    if abs(own_low - low) > room or abs(own_high - high) > room:
        raise NotHealthy(
            f"{run}: found {state} from {own_low:.3g} to {own_high:.3g}, expected about"
            f" {low:.3g} to {high:.3g}, as in {whose}: runs of one experiment are compared"
        )
