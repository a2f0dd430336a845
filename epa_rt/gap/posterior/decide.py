"""The answer that a posterior calls for: of all answers the one with the least expected loss."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.diagnosis import PosteriorVerdict
from epa_rt.gap.posterior.evidence import Numbers
from epa_rt.gap.posterior.unknown import Found, inclusion, still_missing

# What an answer costs that is not the truth; 1 is a wrong name, on which somebody repairs the wrong
# part.
WRONG_NAME = 1.0
MISSED = 0.5  # an effect that is there and has a name, and is not named
CALM = 0.5  # "no gap" where there is one
ALARM = 0.5  # "something is missing" where nothing is
FURTHER_SET = 0.1  # each set more among which the next experiment is to choose
HOLDS = 0.95  # probability that a set of alternatives holds


@dataclass(frozen=True)
class Decision:
    """``effects``: the names, none with no_gap and not_in_catalogue; ``probability``: of the
    family of each to be there. ``instead``: sets of effects that are probable as well, most
    probable first; with not_separable these and ``effects`` hold ``HOLDS``. ``loss``: expected, of
    this answer.
    """

    kind: PosteriorVerdict
    effects: tuple[str, ...]
    probability: tuple[float, ...]
    instead: tuple[tuple[str, ...], ...]
    loss: float


def decided(found: Found, families: Mapping[str, str], numbers: Numbers) -> Decision:
    """The answer with the least expected loss. ``families``: of each effect of the catalogue."""
    sets = _sets(found, families)
    none = sets.pop(frozenset(), (0.0, ()))[0]
    answers = [
        Decision("no_gap", (), (), (), CALM * (1.0 - none)),
        Decision("not_in_catalogue", (), (), (), _unknown_costs(none, found.unknown)),
    ]
    ranked = sorted(sets.items(), key=lambda item: -item[1][0])
    for kinds, (_, effects) in ranked:  # what several probable sets share may be one of them
        answers.append(_names(found, families, sets, kinds, effects, none, numbers))
    if len(several := _alternatives(ranked)) > 1:
        answers.append(_not_told(several, ranked, families, found))
    return min(answers, key=lambda one: one.loss)


Sets = dict[frozenset[str], tuple[float, tuple[str, ...]]]


def _sets(found: Found, families: Mapping[str, str]) -> Sets:
    """Set of families to its probability and its most probable effects."""
    sets: Sets = {}
    for model, probability in found.models:
        kinds = frozenset(families[name] for name in model.effects)
        before, effects = sets.get(kinds, (0.0, model.effects))
        sets[kinds] = (before + probability, effects)
    return sets


def _unknown_costs(none: float, unknown: float) -> float:
    return ALARM * none + MISSED * (1.0 - none - unknown)


def _names(
    found: Found,
    families: Mapping[str, str],
    sets: Sets,
    kinds: frozenset[str],
    effects: tuple[str, ...],
    none: float,
    numbers: Numbers,
) -> Decision:
    """One set of names: what is not there costs as wrong, what is there besides as missed."""
    loss = WRONG_NAME * (found.unknown + none)
    for model, probability in found.models:
        if model.effects:
            there = {families[name] for name in model.effects}
            wrong = len(kinds - there) / len(kinds)
            missed = len(there - kinds) / len(there)
            loss += probability * max(WRONG_NAME * wrong, MISSED * missed)
    enough = _enough(found, sets, kinds, numbers)
    kind: PosteriorVerdict = "explained" if enough > 0.5 else "partly_explained"
    return Decision(kind, effects, _shares(effects, families, found), (), loss)


def _enough(found: Found, sets: Sets, kinds: frozenset[str], numbers: Numbers) -> float:
    """Probability that nothing is missing beside a set of names, given that these are right: of the
    catalogue, or of what it lacks.
    """
    exactly, effects = sets[kinds]
    with_more = sum(share for one, (share, _) in sets.items() if one > kinds)
    best = next(model for model, _ in found.models if model.effects == effects)
    bare = next((model for model, _ in found.models if not model.effects), best)
    lacked = 1.0 / (1.0 + np.exp(-still_missing(best, bare, numbers)))
    alone = exactly / (exactly + with_more) if exactly > 0.0 else 0.0
    return float(alone * (1.0 - lacked))


Ranked = Sequence[tuple[frozenset[str], tuple[float, tuple[str, ...]]]]


def _alternatives(ranked: Ranked) -> list[tuple[str, ...]]:
    """The fewest sets of names that hold ``HOLDS`` of what names can explain."""
    total, held, taken = sum(share for _, (share, _) in ranked), 0.0, []
    for _, (share, effects) in ranked:
        if held >= HOLDS * total:
            break
        taken.append(effects)
        held += share
    return taken


def _not_told(
    several: Sequence[tuple[str, ...]], ranked: Ranked, families: Mapping[str, str], found: Found
) -> Decision:
    """Several sets, of which the next experiment is to tell the right one. It begins with the most
    probable: it costs no more than to ask only of so many of them as cost least.
    """
    held = np.cumsum([share for _, (share, _) in ranked[: len(several)]])
    loss = float(min((WRONG_NAME * (1.0 - held) + FURTHER_SET * np.arange(len(several)))[1:]))
    shares = _shares(several[0], families, found)
    return Decision("not_separable", several[0], shares, tuple(several[1:]), loss)


def _shares(effects: Sequence[str], families: Mapping[str, str], found: Found) -> tuple[float, ...]:
    """Of each effect the probability that the rig has one of its family."""
    shares = inclusion(found, families)
    return tuple(shares[families[name]] for name in effects)
