"""The search for models: sets of effects, each fitted block by block and in free run.

Screening proposes, refits decide. A model that comes near block by block is fitted in free run, one
that free run proposes is fitted block by block, and beside the best singles a second effect is
looked for. Nothing is believed or refused here: the table goes to the posterior.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np
from scipy.optimize import brentq

from epa_rt.gap.likelihood.as_one import LINK, fitted
from epa_rt.gap.likelihood.ground import Ground
from epa_rt.gap.likelihood.point import Normal, Point, linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.promising import promising
from epa_rt.gap.likelihood.reading_noise import ReadingNoise
from epa_rt.gap.likelihood.refit import Fit, settled, settled_with
from epa_rt.gap.likelihood.role import played
from epa_rt.gap.likelihood.screen import Screening, scaled, screen
from epa_rt.gap.likelihood.start import rescaled
from epa_rt.gap.likelihood.waves import look
from epa_rt.gap.likelihood.yardstick import Left
from epa_rt.gap.posterior.prior import Prior
from epa_rt.gap.posterior.views import (
    BLOCKS,
    FREE_RUN,
    HELD_OUT,
    HELD_OUT_FREE_RUN,
    HeldOut,
    Lowest,
    View,
    blocks,
    free_run,
    on_ground,
)
from epa_rt.gap.subject import Values

# How wide is searched: more of each takes time and finds models that these may miss.
SINGLES = 5  # families that are fitted alone in free run
BEAM = (2, 1, 1)  # best models of one, two, three effects beside which one more is looked for
FURTHER = 3  # models with one more that are fitted in free run
MOST_EFFECTS = 4  # in a model
FAMILIES = 3  # that free run proposes beside a model
BEYOND_PROMISE = 3.0  # times what its signature or first fit promises an effect may explain
AGAIN = 3  # rounds of a fit that is made anew

# Log odds to the best model below which another is not gone on with: it has no place in a set that
# holds 95 %.
HOPELESS = np.log(0.05)

ONE_STEP = (BLOCKS, HELD_OUT)  # views that ask for effects block by block
WHOLE = (FREE_RUN, HELD_OUT_FREE_RUN)  # and as a whole


class Scores(Protocol):
    """The posterior's formula, as far as the search asks for it."""

    @property
    def prior(self) -> Prior:
        """Odds of sets of effects before any data."""

    def evidence(self, model: "Model") -> float:
        """Log evidence of a model over the views that it has."""

    def with_one_more(
        self,
        model: "Model",
        best: "Model",
        views: Sequence[str],
        links: Sequence[str] = (),
        left: float = 0.0,
    ) -> float:
        """Log evidence that it would have if one effect more left so much of its excess in these
        views, or in these links of them, and of what nominal parameters have made up for: of their
        distance from where the ``best`` model has them, or from where they usually are.
        """

    def without(self, model: "Model", name: str) -> float:
        """Log evidence that it has more before any data without one of its effects."""

    def most(self, view: str, noise: float, loss: float) -> float:
        """Chi-square of a link of a view, of so much noise, that costs a loss of log evidence."""


@dataclass(frozen=True)
class Model:
    """A set of effects and what it leaves in each view. ``values``: as fitted block by block;
    ``whole``: in free run, None where it was not.
    """

    effects: tuple[str, ...]
    views: Mapping[str, View]
    values: Values
    whole: Values | None = None


@dataclass(frozen=True)
class Table:
    """All models that were fitted; the first has no effect. ``typical``: chi-square that each
    effect of the catalogue would add at a typical strength.
    """

    models: tuple[Model, ...]
    prior: Prior
    typical: Mapping[str, float] = field(default_factory=dict)

    @property
    def families(self) -> Mapping[str, str]:
        """Of each effect of the catalogue."""
        return self.prior.families


class Search:
    """Fits models and keeps each once, whatever proposed it."""

    def __init__(
        self,
        problem: Problem,
        base: Point,
        left: Callable[[Point], Left],
        ground: Ground | None,
        held_out: HeldOut | None,
        scores: Scores,
    ) -> None:
        self._problem, self._base, self._left = problem, base, left
        self._ground, self._held_out, self._scores = ground, held_out, scores
        self._found: dict[frozenset[str], Model] = {}
        self._points: dict[frozenset[str], Point] = {}
        self._asked: set[frozenset[str]] = set()  # beside which one effect more was looked for
        self._arrived: set[frozenset[str]] = set()  # whose blocks were fitted to their optimum
        self._lowest: Lowest = {}
        self._weighed: dict[int, tuple[Model, float]] = {}  # log evidences on what is lowest
        self._noise = ReadingNoise(problem, base.values)
        self.typical: Mapping[str, float] = {}
        self.none = self._model((), base.values, ground.none if ground else None)
        self._waves = tuple(
            dict.fromkeys(
                link
                for effect in problem.effects.values()
                if effect.swings_over
                for link in problem.touched(effect.knobs)
            )
        )  # links in which a period over an angle would show

    def singles(self) -> None:
        """Every candidate alone; the best of several families in free run too. One that the blocks
        do not show is looked for there, where it may count.
        """
        look(self._problem, self._base)
        screening = screen(self._problem, self._base)
        self.typical = screening.typical()
        role = played(self._problem, self._base, screening=screening)
        fits = {fit.effect: fit for fit in (role.fits if role else ())}
        if self._ground is None:
            fits = self._as_believed(fits)
        for fit in fits.values():
            self._model((fit.effect,), fit.values, None, (self._problem, fit.normal))
        self._hidden_pair(self._problem, self._base, screening)
        if self._ground is None:
            return
        self._best(SINGLES, 1)
        if self._asks_for_more(self.none, WHOLE):
            for point in self._ground.one_by_one:
                self._model(point.effects, None, point)

    def _hidden_pair(
        self,
        problem: Problem,
        point: Point,
        screening: Screening,
        worth: Callable[[float], bool] = lambda gain: True,
    ) -> tuple[str, ...] | None:
        """Two effects more at once beside those of a point, where one hides what the other does:
        either alone explains little, and no way leads there one by one. None where there is no
        such pair that is ``worth`` its gain in screening.
        """
        if len(point.effects) + 2 > MOST_EFFECTS:
            return None
        families = self._scores.prior.families
        pair = screening.hidden_pair(families, {families[name] for name in point.effects})
        if pair is None or not worth(pair.gain):
            return None
        both, values = [], dict(point.values)
        for seen, amplitude in (pair.one, pair.other):
            both.append(seen.effect)
            values |= scaled(problem, seen.effect, seen.start, amplitude)
        effects = (*point.effects, *both)
        together = settled(problem, effects, values).values
        for without in both:  # one alone may have stopped short of where both lead it
            rest = tuple(name for name in effects if name != without)
            if frozenset(rest) in self._found:
                self._at_these(rest, problem.kept(together, rest))
        self._at_these(effects, together)
        return self._of(effects).effects

    def _as_believed(self, fits: dict[str, Fit]) -> dict[str, Fit]:
        """The better of each fit and of one that begins with the plant file as it stands. Where the
        refit without effects has bent its numbers to hide a gap, its derivatives lead nowhere; with
        a model of the whole free run looks from both.
        """
        role = played(self._problem, linearised(self._problem, (), {}))
        better = {
            fit.effect: fit
            for fit in (role.fits if role else ())
            if fit.effect not in fits or fit.chi < fits[fit.effect].chi
        }
        return {**fits, **better}

    def further(self, progress: Callable[[str, float], None]) -> None:
        """One effect more beside the best models of each size, while that may count. Beside the
        best singles, and block by block beside the best pair, in any case: together effects may be
        what fewer explain badly.
        """
        for size in range(1, MOST_EFFECTS):
            progress(f"sets of {size + 1} effects", 0.2 + 0.6 * size / MOST_EFFECTS)
            beside = self._best(BEAM[size - 1], size)
            for rank, effects in enumerate(beside + (self._plainer(beside) if size == 1 else [])):
                hopeful = size == 1 or self._hopeful(self._evidence(self._of(effects)))
                if hopeful or size == 2:
                    self._one_more(effects, WHOLE if rank == 0 and hopeful else ())
        self._doubted()
        best = self._leading()
        for model in list(self._found.values()):
            if self._kinds(model) == self._kinds(best):  # the same in other words
                self._in_free_run(model.effects)

    def _plainer(self, singles: Sequence[tuple[str, ...]]) -> list[tuple[str, ...]]:
        """The best law of those of the first one's family that have fewest numbers, unless it is
        one: a shape of its own may have been bent to what another effect does.
        """
        first = self._of(singles[0]) if singles else self.none
        fewer = [
            model
            for key, model in self._found.items()
            if len(key) == 1
            and self._kinds(model) == self._kinds(first)
            and self._numbers(model) < self._numbers(first)
        ]
        order = sorted(fewer, key=lambda one: (self._numbers(one), -self._evidence(one)))
        return [one.effects for one in order[:1]]

    def _numbers(self, model: Model) -> int:
        return sum(len(self._problem.effects[name].knobs) for name in model.effects)

    def _doubted(self) -> None:
        """The best set of each size, once more without each of its effects, and where it may count
        with another in its place, and with another law for it, until they stay the best.
        """
        done: set[frozenset[str]] = set()
        while True:
            best = next((one for one in self._sets() if frozenset(one.effects) not in done), None)
            if best is None:
                return
            done.add(frozenset(best.effects))
            counts = self._hopeful(self._evidence(best))
            for name in best.effects:  # the others may be enough without it
                self._without(best, name)
            for name in best.effects if counts else ():  # which may have stood for another
                self._exchanged(best, name)
            for name in best.effects if counts else ():  # what it says by another law
                self._in_other_laws(best, name)

    def _sets(self) -> list[Model]:
        """The best model of each size from two on that was fitted in all views and may count, or
        might with one effect less.
        """
        best: dict[int, Model] = {}
        for model in sorted(self._complete(), key=lambda one: -self._evidence(one)):
            best.setdefault(len(model.effects), model)
        return [one for size, one in best.items() if size > 1 and self._may_with_less(one)]

    def _may_with_less(self, model: Model) -> bool:
        """Whether a model may count that has one effect less and leaves no more."""
        saved = max(self._scores.without(model, name) for name in model.effects)
        return self._hopeful(self._evidence(model) + max(saved, 0.0))

    def _without(self, model: Model, name: str) -> None:
        """A set without one of its effects, at its own optimum: else the effect may have no merit
        but that of the better fit. From where the set stands, whose others may have found a better
        valley beside it; and from where it was fitted before.
        """
        rest = tuple(other for other in model.effects if other != name)
        known = self._found.get(frozenset(rest))
        points = [settled_with(self._problem, rest, model.values)]
        if known is not None and frozenset(rest) not in self._arrived:
            points.append(settled(self._problem, rest, known.values))
        self._taken(rest, min(points, key=lambda point: point.normal.chi).values)

    def _taken(self, effects: tuple[str, ...], values: Values) -> None:
        """A model block by block at these values, and then in free run."""
        self._at_these(effects, values)
        self._in_free_run(effects)

    def _at_these(self, effects: tuple[str, ...], values: Values) -> None:
        """A model block by block at these values, where it was at none or at worse ones."""
        known = self._found.get(frozenset(effects))
        if known is None:
            self._model(effects, values, None)
        else:
            self._kept_if_better(known, values)

    def _exchanged(self, model: Model, name: str) -> None:
        """Sets with another effect in the place of one, where the others stand: alone they may have
        come to another valley.
        """
        rest = tuple(other for other in model.effects if other != name)
        if frozenset(rest) not in self._asked:
            self._one_more(rest, (), self._problem.kept(model.values, rest))

    def _in_other_laws(self, model: Model, name: str) -> None:
        """Sets with a law of its family and no more numbers in the place of one, fitted from where
        the set stands: on its own way such a law may have come to another valley, and an effect
        more of the set may have stood for the difference.
        """
        one = self._problem.effects[name]
        rest = tuple(other for other in model.effects if other != name)
        kept = self._problem.kept(model.values, rest)
        for law in self._problem.effects.values():
            if law.family != one.family or len(law.knobs) > len(one.knobs) or law.name == name:
                continue
            effects = (*rest, law.name)
            fits = [
                settled(
                    self._problem, effects, {**kept, **dict(zip(law.knobs, start, strict=True))}
                )
                for start in law.starts
            ]
            self._taken(effects, min(fits, key=lambda fit: fit.normal.chi).values)

    def _one_more(
        self, effects: tuple[str, ...], whole: Sequence[str], values: Values | None = None
    ) -> None:
        """Beside a model: what its blocks ask for, and what the whole plant asks for in the views
        ``whole``, if any. ``values``: where its blocks are fitted from, if not where they stand.
        """
        self._asked.add(frozenset(effects))
        found: list[tuple[str, ...]] = []
        if self._asks_for_more(self._of(effects), ONE_STEP):
            found += self._proposed_by_blocks(effects, values)
        if whole and self._asks_for_more(self._of(effects), whole):
            found += self._proposed_by_free_run(effects)
        order = sorted(dict.fromkeys(found), key=lambda one: -self._evidence(self._of(one)))
        for more in order[:FURTHER]:
            self._in_free_run(more)

    def _asks_for_more(self, model: Model, views: Sequence[str], links: Sequence[str] = ()) -> bool:
        """Whether what a model leaves in these views may be worth an effect more. ``links``: those
        alone that it would show in; all where there are none.
        """
        return self._hopeful(self._with_one_more(model, views, links))

    def _with_one_more(
        self, model: Model, views: Sequence[str], links: Sequence[str] = (), left: float = 0.0
    ) -> float:
        """Log evidence of a model if an effect more left so much of its excess there."""
        model = self._on_ground(model)
        return self._scores.with_one_more(model, self._leading(), views, links, left)

    def _proposed_by_blocks(
        self, effects: tuple[str, ...], values: Values | None = None
    ) -> list[tuple[str, ...]]:
        """One effect more that the blocks ask for beside these, or two that hide each other."""
        point = settled(self._problem, effects, values or self._of(effects).values)
        problem, point = rescaled(self._problem, point, self._left(point))
        if self._asks_for_more(self._of(effects), (BLOCKS,), self._waves):
            look(problem, point)
        links = self._on_ground(self._of(effects)).views[BLOCKS].links
        left = sum(seen.excess / problem.scale[name] ** 2 for name, seen in links.items())
        left += float(point.normal.prior @ point.normal.z**2)

        least = self._least_share(effects, ONE_STEP) * left

        def worth(gain: float) -> bool:
            return gain >= least

        screening = screen(problem, point)
        role = played(problem, point, worth=worth, screening=screening)
        found = []
        for fit in role.fits if role else ():
            found.append((*effects, fit.effect))
            known, here = self._found.get(frozenset(found[-1])), (problem, fit.normal)
            if known is None:
                self._model(found[-1], fit.values, None, here)
            else:
                self._kept_if_better(known, fit.values, here)
            more = self._of(found[-1])
            if chi_left(more) > chi_left(
                self._of(effects)
            ):  # a refit that took flat directions too far
                own = {key: fit.values[key] for key in problem.effects[fit.effect].knobs}
                again = settled(problem, found[-1], {**point.values, **own}, rounds=AGAIN)
                self._kept_if_better(more, again.values)
        pair = self._hidden_pair(problem, point, screening, worth)
        return [*found, pair] if pair else found

    def _least_share(self, effects: tuple[str, ...], views: Sequence[str]) -> float:
        """Share of what a model leaves in these views, and of what its nominal parameters cost,
        that one effect more is expected to explain if it may count; infinite where none may.
        """

        def hope(share: float) -> float:
            return self._hope(self._with_one_more(self._of(effects), views, left=1.0 - share))

        if hope(0.0) > 0.0:
            return 0.0
        return float(brentq(hope, 0.0, 1.0)) / BEYOND_PROMISE if hope(1.0) > 0.0 else np.inf

    def _kept_if_better(
        self, known: Model, values: Values, fit: tuple[Problem, Normal] | None = None
    ) -> None:
        """A model block by block at other values, where it is more probable with these. ``fit``: as
        in ``_model``.
        """
        problem, normal = fit or (self._problem, None)
        views = {**known.views, BLOCKS: blocks(problem, self._noise, known.effects, values, normal)}
        if self._held_out is not None:
            views[HELD_OUT] = self._held_out.blocks(values)
        anew = replace(known, views=views, values=values)
        self._note_least(views)
        if self._evidence(anew) > self._evidence(known):
            self._found[frozenset(known.effects)] = anew

    @property
    def models(self) -> list[Model]:
        """None first, then the others in the order in which they were found."""
        return [self._on_ground(one) for one in self._found.values()]

    def _of(self, effects: Sequence[str]) -> Model:
        return self._found[frozenset(effects)]

    def _model(
        self,
        effects: tuple[str, ...],
        values: Values | None,
        point: Point | None,
        fit: tuple[Problem, Normal] | None = None,
    ) -> Model:
        """Keeps a model: fitted block by block at ``values`` (None: to be fitted from those of free
        run), in free run at ``point`` (None: not yet). ``fit``: a problem with its normal equations
        at these values, where there are any.
        """
        key, problem = frozenset(effects), self._problem
        known = self._found.get(key)
        if values is None:
            values = (
                known.values
                if known
                else settled(problem, effects, point.values if point else {}).values
            )
        views = dict(known.views) if known else {}
        if not known:
            on, normal = fit or (problem, None)
            views[BLOCKS] = blocks(on, self._noise, effects, values, normal)
            if self._held_out is not None:
                views[HELD_OUT] = self._held_out.blocks(values)
        before = self._points.get(key)
        better = before is None or (point is not None and point.normal.chi < before.normal.chi)
        if point is not None and self._ground is not None and better:
            self._points[key] = point
            views[FREE_RUN] = free_run(self._ground, point)
            run = self._held_out.free_run(point.values) if self._held_out else None
            if run is not None:
                views[HELD_OUT_FREE_RUN] = run
        run_at = self._points.get(key)
        whole = run_at.values if run_at else None
        self._found[key] = Model(effects, views, values, whole)
        self._note_least(views)
        return self._found[key]

    def _note_least(self, views: Mapping[str, View]) -> None:
        for name, view in views.items():
            for link, seen in view.links.items():
                least = self._lowest.get((name, link))
                if least is None or seen.chi < least.chi:
                    self._lowest[name, link] = seen
                    self._weighed.clear()

    def _evidence(self, model: Model) -> float:
        """Log evidence over the views that a model has, on what the others leave so far."""
        known = self._weighed.get(id(model))
        if known is None:
            known = model, self._scores.evidence(self._on_ground(model))
            self._weighed[id(model)] = known  # as long as it is there nothing else has its id
        return known[1]

    def _on_ground(self, model: Model) -> Model:
        return replace(model, views=on_ground(model.views, self._lowest, self.none.views))

    def _waits(self, effects: tuple[str, ...]) -> bool:
        """Whether a model was not fitted in free run yet, and is worth it."""
        return (
            self._ground is not None
            and frozenset(effects) not in self._points
            and self._hopeful(self._evidence(self._of(effects)))
        )

    def _at_optimum(self, effects: tuple[str, ...]) -> None:
        """A model that may count, block by block at its own optimum: what proposed it has fitted it
        with derivatives of another point.
        """
        known = self._of(effects)
        if frozenset(effects) in self._arrived or not self._hopeful(self._evidence(known)):
            return
        self._arrived.add(frozenset(effects))
        again = settled(self._problem, known.effects, known.values)
        self._kept_if_better(known, again.values)

    def _in_free_run(self, effects: tuple[str, ...]) -> None:
        self._at_optimum(effects)
        if self._waits(effects) and self._ground is not None:
            known = self._of(effects)
            noise = self._on_ground(self.none).views[FREE_RUN].links[LINK].noise
            worth = self._scores.most(FREE_RUN, noise, self._hope(self._evidence(known)))
            near = self._within(effects)
            point = fitted(self._ground.whole, effects, dict(known.values), worth, near)
            self._model(effects, known.values, point)

    def _within(self, effects: tuple[str, ...]) -> Point | None:
        """The best point in free run with some of these effects alone, if any was fitted."""
        fewer = [point for key, point in self._points.items() if key < frozenset(effects)]
        return min(fewer, key=lambda point: point.normal.chi, default=None)

    def _hopeful(self, evidence: float) -> bool:
        """Whether a model of this log evidence, which more views can only lower, may count beside
        the best one that was fitted in all views.
        """
        return self._hope(evidence) > 0.0

    def _hope(self, evidence: float) -> float:
        """Log evidence that a model may still lose and count."""
        return evidence - self._evidence(self._leading()) - HOPELESS

    def _proposed_by_free_run(self, effects: tuple[str, ...]) -> list[tuple[str, ...]]:
        """One effect more that the whole plant asks for beside these."""
        point = self._points.get(frozenset(effects))
        if point is None or self._ground is None:
            return []
        found = []
        chi = point.normal.chi
        excess = chi - self._on_ground(self._of(effects)).views[FREE_RUN].links[LINK].noise
        worth = chi - self._least_share(effects, WHOLE) * excess if excess > 0.0 else np.inf
        for one in promising(self._ground.whole, point, FAMILIES, worth)[:FAMILIES]:
            if one.chi > worth:
                continue
            found.append((*effects, one.effect))
            self._model(
                found[-1], None, one.point or fitted(self._ground.whole, found[-1], one.values)
            )
        return found

    def _complete(self) -> list[Model]:
        """Models that were fitted in every view."""
        return [one for one in self._found.values() if set(one.views) >= set(self.none.views)]

    def _leading(self) -> Model:
        """The most probable of them."""
        return max(self._complete(), key=self._evidence)

    def _kinds(self, model: Model) -> frozenset[str]:
        return frozenset(self._problem.effects[name].family for name in model.effects)

    def _best(self, count: int, size: int) -> list[tuple[str, ...]]:
        """Models of a size by log evidence, the best of each set of families. What a model is worth
        is known once it was fitted in free run, too: before that it may only be worth less.
        """
        while True:
            order = self._by_evidence(size)[:count]
            waiting = [effects for effects in order if self._waits(effects)]
            if not waiting:
                return order
            self._in_free_run(waiting[0])

    def _by_evidence(self, size: int) -> list[tuple[str, ...]]:
        order = sorted(
            (model for key, model in self._found.items() if len(key) == size),
            key=lambda model: -self._evidence(model),
        )
        families: dict[frozenset[str], tuple[str, ...]] = {}
        for model in order:
            families.setdefault(self._kinds(model), model.effects)
        return list(families.values())


def chi_left(model: Model) -> float:
    """Chi-square that a model leaves block by block."""
    return sum(seen.chi for seen in model.views[BLOCKS].links.values())


def table_of(
    problem: Problem,
    base: Point,
    left: Callable[[Point], Left],
    ground: Ground | None,
    held_out: HeldOut | None,
    scores: Scores,
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> Table:
    """All models of a rig that are worth their fit. Raises Stopped."""
    progress("each effect alone", 0.0)
    search = Search(problem, base, left, ground, held_out, scores)
    search.singles()
    search.further(progress)
    return Table(tuple(search.models), scores.prior, search.typical)
