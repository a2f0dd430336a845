"""What a fitted model leaves of the data, by view: block by block, in free run, on held-out logs.

A view is one way to hold a plant against recordings. Each has one or more links; a link has a
number of readings that count as independent, and the chi-square that a model leaves of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from epa_rt.gap.likelihood.as_one import LINK, AsOne, apart
from epa_rt.gap.likelihood.ground import Ground
from epa_rt.gap.likelihood.point import Normal, Point, linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.reading_noise import PerSample, ReadingNoise
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject, Values

BLOCKS, FREE_RUN = "blocks", "free_run"
HELD_OUT, HELD_OUT_FREE_RUN = "held_out", "held_out_free_run"


@dataclass(frozen=True)
class Seen:
    """One link under one model. ``noise``: chi-square that noise alone leaves on average;
    ``chi``: what the model leaves, and what it filters off of readings' noise besides. ``matrix``
    (k, k): information on the view's keys per squared spread; None of a link that nothing was
    fitted to. ``loose``: whether neither a twin of the
    plant nor healthy runs have measured its floor. ``off``: chi-square by which healthy runs
    differ, a deviation, or which readings of one motion are off by in one of twenty cases.
    ``lowered_from``: what ``noise`` was before it was set to what some model leaves.
    """

    noise: float
    chi: float
    matrix: np.ndarray | None = None
    loose: bool = False
    off: float = 0.0
    lowered_from: float | None = None

    @property
    def floor(self) -> float:
        """Chi-square that noise leaves as it was measured, whatever some model leaves."""
        return self.noise if self.lowered_from is None else self.lowered_from

    @property
    def excess(self) -> float:
        """Chi-square above that of noise; 0 where it is below."""
        return max(self.chi - self.noise, 0.0)


@dataclass(frozen=True)
class View:
    """``links``: link name to what is seen of it. ``keys``: of the fit's numbers; ``z`` (k,): their
    distance from the plant file, in spreads; ``nominal`` (k,): which are nominal parameters.
    ``runs``: from how many healthy runs their spreads are known; 0: the plant file says them.
    ``known`` (k,): of an effect's number, its spread over the standard deviation that is known of
    it, by healthy runs or a calibration; 0 where nothing is. ``sizes``: effect to its size in
    typical strengths, of those of which nothing is known.
    """

    links: Mapping[str, Seen]
    keys: tuple[str, ...] = ()
    z: np.ndarray = field(default_factory=lambda: np.zeros(0))
    nominal: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    runs: int = 0
    known: np.ndarray = field(default_factory=lambda: np.zeros(0))
    sizes: Mapping[str, float] = field(default_factory=dict)

    @property
    def excess(self) -> float:
        """Chi-square above that of noise, of all links."""
        return sum(seen.excess for seen in self.links.values())


Lowest = dict[tuple[str, str], Seen]  # view and link to what the model leaves that leaves least


def on_ground(
    views: Mapping[str, View], lowest: Lowest, none: Mapping[str, View]
) -> dict[str, View]:
    """Views whose noise is one for all models, which are compared by what they differ in: what the
    plant without effects (``none``) expects of noise, or the model that leaves least where that
    expects more; or what that one leaves where it is less, for nobody knows noise better than by a
    few percent.
    """
    found = {}
    for name, view in views.items():
        links = {}
        for link, seen in view.links.items():
            least = lowest.get((name, link), seen)
            bare = none[name].links.get(link, least) if name in none else least
            most = max(bare, least, key=lambda one: one.noise)
            noise = min(most.noise, least.chi)
            links[link] = replace(seen, noise=noise, off=most.off, lowered_from=most.noise)
        found[name] = replace(view, links=links)
    return found


def blocks(
    problem: Problem,
    noise: ReadingNoise,
    effects: tuple[str, ...],
    values: Values,
    normal: Normal | None = None,
) -> View:
    """Block by block at these values, in units of the floors alone. ``noise``: of the problem's
    readings; ``normal``: normal equations there, where a fit has left them.
    """
    bare, usual = problem.rescaled(dict.fromkeys(problem.links, 1.0)), problem.subject.usual
    if normal is None:
        normal = linearised(bare, effects, dict(values)).normal
    else:
        normal = normal.weighted(np.array([problem.scale[link] ** 2 for link in problem.links]))
    residuals = problem.each(lambda link: bare.residual(values, link), bare.links)
    per_sample = noise.per_sample(values)
    return View(
        {
            link: Seen(
                per_sample[link].mean * bare.samples(link),
                float(residual @ residual) + per_sample[link].filtered * bare.samples(link),
                matrix.sum(axis=0),
                _loose(problem, link),
                _off(bare, per_sample, link),
            )
            for link, residual, matrix in zip(bare.links, residuals, normal.matrix, strict=True)
        },
        *_numbers(normal),
        usual.runs if usual else 0,
        *_of_effects(problem, effects, normal),
    )


def free_run(ground: Ground, point: Point) -> View:
    """The whole plant at a point fitted to it."""
    normal = point.normal
    seen = Seen(ground.noise, float(normal.square.sum()), normal.matrix.sum(axis=(0, 1)))
    known, sizes = _of_effects(ground.whole, point.effects, normal)
    return View({LINK: seen}, *_numbers(normal), known=known, sizes=sizes)


def _loose(problem: Problem, link: str) -> bool:
    return problem.floors[link].source != "twin" and problem.subject.usual is None


def _known(problem: Problem, normal: Normal) -> np.ndarray:
    """(k,) as ``View.known``. Periods and phases of waves over an angle are known to nobody."""
    waves = {
        key for effect in problem.effects.values() if effect.swings_over for key in effect.knobs[1:]
    }

    def of(key: str) -> float:
        knob = problem.knobs[key]
        if knob.stated is not None:
            return knob.spread / knob.stated
        return float(problem.subject.usual is not None and key not in waves)

    return np.array([of(key) for key in normal.keys]) * (normal.prior == 0.0)


def _of_effects(
    problem: Problem, effects: Sequence[str], normal: Normal
) -> tuple[np.ndarray, dict[str, float]]:
    """What is known of the numbers of effects, and their sizes, as in ``View``."""
    known = _known(problem, normal)
    sizes: dict[str, float] = {}
    for name in effects:
        typical = problem.typical(name)
        at = [i for i, key in enumerate(normal.keys) if key in typical]
        if not known[at].any():
            scales = [problem.spread(normal.keys[i]) / typical[normal.keys[i]] for i in at]
            sizes[name] = float(np.linalg.norm(normal.z[at] * scales))
    return known, sizes


def _off(problem: Problem, per_sample: Mapping[str, PerSample], link: str) -> float:
    """As ``Seen.off``: by what its readings are off, or what healthy runs differ by."""
    usual = problem.subject.usual
    most = max(per_sample[link].off, usual.off[link] if usual else 0.0)
    return most * problem.samples(link)


def _numbers(normal: Normal) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    return normal.keys, normal.z, normal.prior > 0.0


class HeldOut:
    """Logs or trials that no model was fitted to, ready to be held against any: block by block, and
    in free run where the rig has a model of the whole. ``values``: of the plant without effects;
    ``subject``: the one that judges them.
    """

    def __init__(
        self,
        problem: Problem,
        ground: Ground | None,
        recordings: Sequence[Recording],
        values: Values,
        subject: Subject | None = None,
    ) -> None:
        self._problem = problem.rescaled(dict.fromkeys(problem.links, 1.0)).on(recordings, subject)
        self._reading_noise = ReadingNoise(self._problem, values)
        self._whole = ground.whole.subject if ground else None
        self._ready: list[tuple[object, float]] = []
        if isinstance(self._whole, AsOne) and ground is not None:
            told = [one for one in recordings if (subject or problem.subject).told(one)]
            self._ready = [self._noise(one, ground.none.values) for one in told]

    def _noise(self, recording: Recording, values: Values) -> tuple[object, float]:
        """What is prepared of a recording, and chi-square that noise alone leaves of it."""
        whole = self._whole
        assert isinstance(whole, AsOne)
        clean, noisy = (whole.free_run(recording, values, seed) for seed in (None, 1))
        assert clean is not None and noisy is not None
        found = apart(whole.prepare(noisy), clean, whole.meters)
        return whole.prepare(recording), float(np.nansum(found**2))

    def blocks(self, values: Values) -> View:
        """Block by block at values that were fitted elsewhere."""
        problem, per_sample = self._problem, self._reading_noise.per_sample(values)
        return View(
            {
                link: Seen(
                    per_sample[link].mean * problem.samples(link),
                    float(residual @ residual) + per_sample[link].filtered * problem.samples(link),
                    loose=_loose(problem, link),
                    off=_off(problem, per_sample, link),
                )
                for link in problem.links
                for residual in [problem.residual(values, link)]
            }
        )

    def free_run(self, values: Values) -> View | None:
        """In free run at values that were fitted elsewhere; None without a model of the whole."""
        if not self._ready or self._whole is None:
            return None
        chi = sum(
            float(np.nansum(self._whole.residual(ready, values, LINK) ** 2))
            for ready, _ in self._ready
        )
        return View({LINK: Seen(sum(noise for _, noise in self._ready), chi)})
