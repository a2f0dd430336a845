"""The posterior: what each model is worth, and what something that no law describes is.

Names compete with each other by their evidence. Whether the best of them is right at all is another
question: what the right law leaves of a gap and what the best of the wrong ones leaves differ, and
both are known from calibration. Their ratio has heavy tails, so that a real rig, which always has
more than its named effects, keeps its names.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.posterior.evidence import TAILS, Numbers, log_evidence, of_views, scale
from epa_rt.gap.posterior.search import Model, Table

# Of a gap of any cause, in logarithms of what a floor may be wrong by: from that to 400 times it.
SHOWN, SHOWN_SPREAD = 3.0, 3.0


@dataclass(frozen=True)
class Found:
    """The posterior. ``models``: with their probabilities, most probable first. ``unknown``: the
    probability of something that the catalogue lacks, with no name beside it.
    """

    models: tuple[tuple[Model, float], ...]
    unknown: float


def posterior(table: Table, numbers: Numbers) -> Found:
    """Over all models that were fitted in every view that the first one was; others were not worth
    it.

    Something that the catalogue lacks makes a gap that is not there without it, and the set that
    explains most leaves of it what wrong laws leave.
    """
    none = table.models[0]
    seen = [model for model in table.models if set(model.views) >= set(none.views)]
    scored = [(model, log_evidence(model, table.prior, numbers)) for model in seen]
    # a plant that ran away with its effects on has no evidence
    scored = [(model, log) for model, log in scored if not model.effects or np.isfinite(log)]
    models, logs = [model for model, _ in scored], [log for _, log in scored]
    named = [model for model in models if model.effects]
    unknown = [logs[models.index(none)] + nothing_wrong(none, numbers)]
    if named:
        best = explains_most(named, numbers)
        ratio, wrong = left_by_wrong(best, none, numbers)
        unknown[0] += wrong
        all_named = [logs[models.index(model)] for model in named]
        ratio += pushed_by_wrong(best, numbers)
        unknown.append(float(np.logaddexp.reduce(all_named)) + ratio)
    logs.append(numbers.unknown_odds + float(np.logaddexp.reduce(unknown)))
    weights = np.exp(np.array(logs) - max(logs))
    weights /= weights.sum()
    order = np.argsort(-weights[:-1], kind="stable")
    return Found(tuple((models[i], float(weights[i])) for i in order), float(weights[-1]))


def explains_most(models: Sequence[Model], numbers: Numbers) -> Model:
    """The one of the models under which what is left is most probable, its prior aside."""
    return max(models, key=lambda model: of_views(model.views, numbers))


def left_by_wrong(model: Model, none: Model, numbers: Numbers) -> tuple[float, float]:
    """Log of the ratio of how probable what a set leaves is of the best wrong laws and of the right
    ones, and of the former alone. Wrong laws show in one of the views, nobody knows in which: in
    the others they may leave as little as right ones. Or they imitate what is there, and leave as
    little in all (``imitated_odds``).
    """
    logs = []
    for name in _with_links(none):
        gap, floor = none.views[name].excess, _of_floors(none, name, numbers)
        left = np.log1p(model.views[name].excess / floor)
        logs.append(
            [
                _log_t((left - np.log1p(part * gap / floor)) / numbers.left_spread)
                for part in (numbers.right_left, numbers.wrong_left)
            ]
        )
    right, wrong = np.transpose(logs or [[0.0, 0.0]])
    shown = float(np.logaddexp.reduce(wrong - right) - np.log(len(right)))
    ratio = float(
        np.logaddexp(shown, numbers.imitated_odds) - np.logaddexp(0.0, numbers.imitated_odds)
    )
    return ratio, ratio + float(right.mean())


def pushed_by_wrong(model: Model, numbers: Numbers) -> float:
    """Log of the ratio of how probable it is that the nominal parameter that went farthest goes so
    far beside wrong laws and beside right ones; 0 where the plant file says of none how well it is
    known. What no law describes, nominal parameters make up for.
    """
    farthest = max(
        (
            float(np.abs(view.z[view.nominal]).max())
            for view in model.views.values()
            if view.nominal.any()
        ),
        default=None,
    )
    if farthest is None:
        return 0.0
    wide = numbers.wrong_push
    return _log_t(farthest / wide) - float(np.log(wide)) - _log_t(farthest)


def nothing_wrong(none: Model, numbers: Numbers) -> float:
    """Log of the ratio of what a gap of any cause would show so, and what none would; the mean over
    the views.
    """
    return float(np.mean(_of_something(none, none, numbers, 0.0) or [0.0]))


def _of_something(model: Model, none: Model, numbers: Numbers, part: float) -> list[float]:
    """By view the log of that ratio, of what a model leaves. ``part``: of the gap, that right laws
    leave as well.
    """
    ratios = []
    for name in _with_links(model):
        floor = _of_floors(model, name, numbers, True) + part * none.views[name].excess
        at, spread = np.log1p(model.views[name].excess / floor), numbers.left_spread
        something = _log_t((at - SHOWN) / SHOWN_SPREAD) - np.log(SHOWN_SPREAD)
        ratios.append(something - _log_t(at / spread) + np.log(spread))
    return ratios


def _with_links(model: Model) -> list[str]:
    """Views in which anything is judged."""
    return [name for name, view in model.views.items() if view.links]


def _of_floors(model: Model, view: str, numbers: Numbers, unexplained: bool = False) -> float:
    """Chi-square by which a view's floors may be wrong as a whole. ``unexplained``: where nothing
    explains any of it, a floor that no twin of the plant has measured may be wrong by more.
    """
    freedom = numbers.freedom_of(view)
    return sum(
        scale(
            seen,
            freedom,
            numbers.loose_share if unexplained and seen.loose else numbers.floor_share,
        )
        for seen in model.views[view].links.values()
    )


def _log_t(z: float) -> float:
    return -0.5 * (TAILS + 1.0) * float(np.log1p(z**2 / TAILS))


def inclusion(found: Found, families: Mapping[str, str]) -> dict[str, float]:
    """Family to the probability that the rig has one of its effects, most probable first.
    ``families``: of each effect of the catalogue.
    """
    total: dict[str, float] = {}
    for model, probability in found.models:
        for family in dict.fromkeys(families[name] for name in model.effects):
            total[family] = total.get(family, 0.0) + probability
    return dict(sorted(total.items(), key=lambda item: -item[1]))


def still_missing(model: Model, none: Model, numbers: Numbers) -> float:
    """Log odds that something is missing beside a model's effects: what one view shows is missing,
    whatever the others do not show. No law is the rig's own: what right laws leave of the gap that
    there is without them (``none``) shows nothing. Even odds beforehand: a rig has more than its
    named effects as often as not, and ``unknown_odds`` are those of having none that is named.
    """
    ratios = _of_something(model, none, numbers, numbers.right_left)
    return max(ratios, default=0.0)
