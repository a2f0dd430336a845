"""The posterior as an answer: which sets of effects it could be, and how probable each is."""

from collections.abc import Callable, Sequence

from epa_rt.gap.diagnosis import Could, Posterior
from epa_rt.gap.likelihood.start import Start
from epa_rt.gap.posterior.calibrated import CASES, RECORDINGS
from epa_rt.gap.posterior.decide import Decision
from epa_rt.gap.posterior.evidence import Formula, Numbers
from epa_rt.gap.posterior.prior import Prior
from epa_rt.gap.posterior.search import Model, Table, table_of
from epa_rt.gap.posterior.unknown import Found, inclusion
from epa_rt.gap.posterior.views import BLOCKS, FREE_RUN, HeldOut
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject

TOGETHER, SHOWN = 0.99, 0.01  # probability that the models shown hold, and from which families are


def as_told(found: Found, table: Table, answer: Decision) -> Posterior:
    """What a rig could have, as a diagnosis says it. ``answer``: what is decided on it."""
    none = table.models[0]
    named = next(model for model in table.models if model.effects == answer.effects)
    by = _shown_in(none, named)
    models, held = [], found.unknown
    for model, probability in found.models:
        models.append(Could(model.effects, probability, _share(model, none, by)))
        held += probability
        if held > TOGETHER:
            break
    families = {
        family: share
        for family, share in inclusion(found, table.families).items()
        if share >= SHOWN
    }
    names = dict(zip(answer.effects, answer.probability, strict=True))
    return Posterior(
        tuple(models),
        families,
        found.unknown,
        by,
        answer.kind,
        names,
        answer.instead,
        CASES,
        RECORDINGS,
    )


def table_for(
    start: Start,
    aside: Sequence[Recording],
    judge: Subject | None,
    numbers: Numbers,
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> Table:
    """All models that are worth their fit, with what each leaves in every view. Raises Stopped.

    ``aside``: logs or trials that no fit has seen, judged by ``judge`` (None: the subject of the
    fits).
    """
    problem = start.problem
    families = {name: effect.family for name, effect in problem.effects.items()}
    prior = Prior(families, problem.in_plant, measured=problem.subject.usual is not None)
    held_out = HeldOut(problem, start.ground, aside, start.base.values, judge) if aside else None
    return table_of(*start, held_out, Formula(prior, numbers), progress)


def left_in(model: Model, view: str) -> float:
    """Chi-square above noise that a model leaves in a view."""
    return model.views[view].excess


def _shown_in(none: Model, named: Model) -> str:
    """The view in which what is named explains most chi-square, or in which most is left where
    nothing is named.
    """

    def shown(view: str) -> tuple[float, str]:
        gap = left_in(none, view)
        return gap - left_in(named, view) if named.effects else gap, view

    return max((name for name in none.views if name in (BLOCKS, FREE_RUN)), key=shown)


def _share(model: Model, none: Model, view: str) -> float | None:
    gap = left_in(none, view)
    return left_in(model, view) / gap if gap > 0.0 else None
