"""The diagnosis from recordings to answer: names with their numbers, places, how far, in words.

Nothing here decides what is named: that is read off the probabilities (posterior/decide.py).
"""

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.answer.named import by_log, moved, nominal, numbers
from epa_rt.gap.answer.since_when import onset
from epa_rt.gap.answer.whose import who_has
from epa_rt.gap.answer.wording import said_of_moved, said_of_onset
from epa_rt.gap.diagnosis import (
    DECIDES,
    SILENT,
    Diagnosis,
    FreeRun,
    Named,
    Onset,
    Origin,
    Place,
    Posterior,
    Shrinkage,
    Verdict,
    likely,
)
from epa_rt.gap.held_out.aside import unseen
from epa_rt.gap.held_out.share import NO_GAP
from epa_rt.gap.held_out.shrink import how_far_of
from epa_rt.gap.likelihood.astray import astray
from epa_rt.gap.likelihood.floor import floors as floors_of
from epa_rt.gap.likelihood.point import Point, costs, linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.likelihood.remainder import remainders
from epa_rt.gap.likelihood.start import Progress, Start, rescaled
from epa_rt.gap.likelihood.together import ROUNDS, Together
from epa_rt.gap.posterior.answer import as_told, left_in
from epa_rt.gap.posterior.calibrated import CALIBRATED
from epa_rt.gap.posterior.decide import HOLDS, Decision, decided
from epa_rt.gap.posterior.search import Model, Table, chi_left
from epa_rt.gap.posterior.searched import searched
from epa_rt.gap.posterior.unknown import Found, explains_most, posterior
from epa_rt.gap.posterior.views import BLOCKS, FREE_RUN, HELD_OUT, HELD_OUT_FREE_RUN
from epa_rt.gap.posterior.words import all_of, plain, set_words, told_of_names, told_of_sets
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject, Values
from epa_rt.gap.where.localise import localise
from epa_rt.gap.where.origin import SURE, origin_first, origins
from epa_rt.gap.where.run_freely import localise_freely

FITTED = ((BLOCKS, "block by block"), (FREE_RUN, "in free run"))
UNSEEN = (
    (HELD_OUT, "on logs or trials that no fit has seen"),
    (HELD_OUT_FREE_RUN, "on these in free run"),
)
WORTH_A_WORD = 0.2  # probability from which a law that is not named is said all the same
MOSTLY = 0.5  # of the catalogue: where the logs could not show as much, no gap says nothing
LITTLE_PERCENT = 0.01  # of a gap, below which nobody needs the figure


@dataclass(frozen=True)
class Fitted:
    """The plant without and with what is named, fitted to the same: ``before``, ``after``.
    ``final``: the latter as a point of ``problem``, block by block.
    """

    problem: Problem
    final: Point
    before: Values
    after: Values


def diagnose(
    subject: Subject,
    recordings: Sequence[Recording],
    holdout: Sequence[Recording] = (),
    without: Sequence[str] = (),
    seed: int = 0,
    floors=floors_of,
    how_far: bool = True,
    progress: Progress = lambda stage, share: None,
    stop: Callable[[], bool] | None = None,
) -> Diagnosis:
    """Where the gap lies, which effect makes it, how far it shrinks.

    The order of recordings changes nothing. ``holdout``: those for the shrinkage; without any, the
    last trial of every log is set aside. ``without``: effects left out of the catalogue.
    ``progress(stage, share)`` is called from this thread. Raises Stopped when ``stop()`` says so,
    KeyError where a recording lacks a column.
    """
    begun, as_given = time.monotonic(), [one.name for one in recordings]
    recordings, holdout = (  # the order in which they come says nothing
        sorted(logs, key=_in_order) for logs in (recordings, holdout)
    )
    fitted, seen, aside, apart_logs = unseen(subject, recordings, holdout)
    start, table = searched(
        fitted,
        seen,
        apart_logs,
        aside,
        CALIBRATED,
        tuple(without),
        seed,
        floors,
        lambda stage, share: progress(stage, 0.7 * share),
        stop,
    )
    found = posterior(table, CALIBRATED)
    answer = decided(found, table.families, CALIBRATED)
    progress("its numbers", 0.7)
    model = _model_of(table, answer.effects)
    fit = fitted_for(start, model, table.models[0])
    off = astray(fit.problem, fit.final, seed) if model.effects else None
    progress("how far", 0.75)
    rows: tuple[Shrinkage, ...] = ()
    if how_far:
        rows = how_far_of(
            aside or subject,
            apart_logs or recordings,
            start.problem,
            fit.before,
            fit.after,
            floors,
            seed,
            lambda stage, share: progress(stage, 0.75 + 0.15 * share),
        )
    progress("what is left", 0.9)
    silent = not_shown(table)
    verdict: Verdict = answer.kind
    if verdict == "no_gap" and len(silent) > MOSTLY * len(start.problem.effects):
        verdict = "not_excited"
    places = _places(fitted, start, verdict)
    whence: tuple[Origin, ...] = ()
    if verdict == "not_in_catalogue":
        progress("where it comes from", 0.95)
        whence = origins(start.problem, start.base.values)
    own = nominal(fit.problem, fit.final.normal, off)
    went = moved(fit.problem, fit.final.normal, own)
    could = as_told(found, table, answer)
    begins = _begins(fit, table, answer)
    names = tuple(
        _named(fit, name, could.names[name], found, table, model, answer, off)
        for name in _most_first(table, answer.effects)
    )
    leads = _leads(begins, names, whence)
    left = _left(model, table.models[0]) if model.effects else _described(model)
    says = _says(verdict, could, names, left, () if leads else whence, silent, start, went)
    if begins is not None:
        since = said_of_onset(begins)
        says = f"{since} {says}" if leads else f"{says} {since}"
    told = Diagnosis(
        verdict=verdict,
        says=says,
        found_first=tuple(f"{r.name}: {what}" for r in recordings for what in r.found),
        location=origin_first(places, whence),
        origins=whence,
        effects=names,
        free_run=_in_free_run(table, model),
        free_run_location=(
            localise_freely(fitted, seen, start.ground.none.values, start.problem.prepared)
            if start.ground
            else ()
        ),
        onset=begins,
        nominal_moved=went,
        nominal=own,
        not_tested=silent,
        shrinkage=rows,
        fitted=dict(fit.after),
        refitted=dict(fit.before),
        remainder=remainders(
            fitted,
            start.problem.prepared,
            start.base.values,
            fit.final.values,
            start.problem.floors,
            start.problem.designs,
        ),
        posterior=could,
        seconds=time.monotonic() - begun,
        inputs={
            "subject": subject.name,
            "logs": as_given,
            "holdout": [one.name for one in holdout],
            "without": list(without),
        },
    )
    progress("done", 1.0)
    return told


def _in_order(recording: Recording) -> tuple[list[str | int], str]:
    """By name, in which numbers count as such: run_2 before run_10."""
    parts = re.split(r"(\d+)", recording.name)
    return [int(one) if i % 2 else one for i, one in enumerate(parts)], recording.name


def fitted_for(start: Start, model: Model, none: Model) -> Fitted:
    """The numbers that a plant file with these effects gets, and those without any: fitted to
    blocks and free run at once, where the rig has a model of the whole.
    """
    problem, point = start.problem, start.base
    if model.effects:
        point = settled(problem, model.effects, model.values)
        problem, point = rescaled(problem, point, start.left(point))
    if start.ground is None or model.whole is None or none.whole is None:
        return Fitted(problem, point, start.base.values, point.values)
    both = Together(problem, start.ground.whole)
    own = {
        key: point.values[key]
        for name in model.effects
        for key in problem.effects[name].knobs
        if key in point.values
    }
    starts = (dict(model.whole), {**model.whole, **own}, dict(point.values))
    begun = min(starts, key=lambda values: costs(both, point.normal.keys, values))
    before = settled(both, (), dict(none.whole), rounds=ROUNDS).values
    after = settled(both, model.effects, begun, rounds=ROUNDS).values if model.effects else before
    return Fitted(problem, linearised(problem, model.effects, dict(after)), before, after)


def _begins(fit: Fitted, table: Table, answer: Decision) -> Onset | None:
    """What begins within a log beside what is named. Where nothing is, also beside the set that
    explains most: what begins may be all that hides that this is right.
    """
    found = onset(fit.problem, fit.final, CALIBRATED)
    named = [model for model in table.models if model.effects]
    if found is not None or answer.effects or not named:
        return found
    best = explains_most(named, CALIBRATED)
    point = settled(fit.problem, best.effects, best.values)
    return onset(fit.problem, point, CALIBRATED)


def not_shown(table: Table) -> tuple[str, ...]:
    """Effects that these logs would not show at a typical strength, whatever they say now: what one
    would add, nominal parameters projected out, does not decide.
    """
    return tuple(name for name in table.families if table.typical.get(name, 0.0) < DECIDES)


def _most_first(table: Table, effects: Sequence[str]) -> list[str]:
    """Named effects, that which leaves least by itself first."""
    alone = {one.effects[0]: chi_left(one) for one in table.models if len(one.effects) == 1}
    return sorted(effects, key=lambda name: alone.get(name, np.inf))


def _model_of(table: Table, effects: tuple[str, ...]) -> Model:
    return next(model for model in table.models if model.effects == effects)


def _named(
    fit: Fitted,
    name: str,
    share: float,
    found: Found,
    table: Table,
    model: Model,
    answer: Decision,
    off: np.ndarray | None,
) -> Named:
    """One name of ``model``. What it is not told from: what stands for it in the other sets, and
    laws of its family that are probable as well.
    """
    effect = fit.problem.effects[name]
    own = numbers(fit.problem, fit.final, name, off, searched=True)
    return Named(
        name,
        effect.family,
        effect.block,
        own,
        share,
        chi_left(table.models[0]) - chi_left(model),
        tuple(dict.fromkeys((*_instead(name, answer), *_same_family(name, found, table, model)))),
        who_has(fit.problem, name, own),
        in_more_numbers=_in_more_numbers(fit.problem, name, table, model),
        by_log=by_log(fit.problem, fit.final, name),
    )


def _instead(name: str, answer: Decision) -> tuple[str, ...]:
    """What other probable sets have where this one has a name that they do not all have."""
    if all(name in one for one in answer.instead):
        return ()
    return tuple(
        other
        for one in answer.instead
        if name not in one
        for other in one
        if other not in answer.effects
    )


def _kin(name: str, model: Model, other: Model, table: Table) -> str | None:
    """The law of a name's family, or the name itself, that ``other`` has where ``model`` has it and
    all else is the same; None where it is another set.
    """
    rest = set(model.effects) - {name}
    laws = set(other.effects) - rest
    if len(laws) != 1 or not rest <= set(other.effects):
        return None
    (law,) = laws
    return law if table.families[law] == table.families[name] else None


def _same_family(name: str, found: Found, table: Table, model: Model) -> tuple[str, ...]:
    """Laws of a name's family that hold, beside it, ``HOLDS`` of what the set has that is named."""
    laws = ((_kin(name, model, other, table), share) for other, share in found.models)
    shares = {law: share for law, share in laws if law is not None}
    total, held, taken = sum(shares.values()), 0.0, []
    for law, share in sorted(shares.items(), key=lambda item: -item[1]):
        if held >= HOLDS * total:
            break
        taken.append(law)
        held += share
    return tuple(law for law in taken if law != name)


def _in_more_numbers(problem: Problem, name: str, table: Table, model: Model) -> tuple[str, ...]:
    """Laws of a name's family that say the same block by block, with more numbers: beside what else
    is named, or alone where the name was fitted alone.
    """
    numbers_of = {law: len(effect.knobs) for law, effect in problem.effects.items()}
    alone = [one for one in table.models if one.effects == (name,)]
    return tuple(
        sorted(
            {
                law
                for own in (model, *alone)
                for other in table.models
                if (law := _kin(name, own, other, table)) is not None
                and numbers_of[law] > numbers_of[name]
                and left_in(other, BLOCKS) < left_in(own, BLOCKS) + DECIDES
            }
        )
    )


def _in_free_run(table: Table, model: Model) -> FreeRun | None:
    none = table.models[0]
    if FREE_RUN not in none.views:
        return None
    gap, left = (left_in(one, FREE_RUN) for one in (none, model))
    return FreeRun(gap, left, 1.0 - left / gap if gap > DECIDES else None, model.effects)


def _places(fitted: Subject, start: Start, verdict: Verdict) -> tuple[Place, ...]:
    """Where the gap shows with the nominal parameters refitted; as the plant file stands, where
    their refit hides a gap that there is.
    """
    problem = start.problem
    places = localise(fitted, problem.prepared, start.base.values, problem.floors)
    if verdict not in SILENT and not any(one.significance > SURE for one in places):
        return localise(fitted, problem.prepared, {}, problem.floors)
    return places


def _says(
    verdict: Verdict,
    could: Posterior,
    names: Sequence[Named],
    left: str,
    whence: Sequence[Origin],
    silent: Sequence[str],
    start: Start,
    went,
) -> str:
    """The answer in one or two sentences."""
    of = len(start.problem.effects)
    family = {name: effect.family for name, effect in start.problem.effects.items()}
    if verdict == "no_gap":
        shown = f"{of - len(silent)} of {of} effects would have shown at a typical strength."
        told, nearest = _without_gap(could, family, left)
        said = f"{told}; {shown}"
        said = f"{said} {said_of_moved(went, gap=False)}" if went else said
        return f"{said}{nearest}"
    if verdict == "not_excited":
        return (
            f"No gap shows, but these logs could not have shown {len(silent)} of {of} effects at a"
            " typical strength."
        )
    if verdict == "not_in_catalogue":
        said, nearest = _unnamed(could, family)
        places = all_of([_explains(one) for one in likely(whence)], "or")
        if places:
            said = f"{said} It may come from {places}: so much of it would an error there explain."
        said = f"{said} {said_of_moved(went, gap=True)}" if went else said
        return f"{said}{nearest}"
    who = {one.name: one.who for one in names}
    if verdict == "not_separable":
        told = told_of_sets((tuple(could.names), *could.instead), could.names, who)
    else:
        shares = {one.name: one.confidence for one in names}
        instead = {
            one.name: [law for law in one.not_separable_from if family[law] == one.family]
            for one in names
        }
        told = told_of_names(shares, who, verdict == "partly_explained", instead)
    besides = _besides(could, names, start) if verdict == "partly_explained" else ""
    return f"{told[:1].upper()}{told[1:]}.{left}{besides}"


def _leads(begins: Onset | None, names: Sequence[Named], whence: Sequence[Origin]) -> bool:
    """Whether nothing is named and what begins within a log explains more than any place does."""
    most = max((one.explained_share for one in whence), default=0.0)
    return begins is not None and not names and begins.explained_share > most


def _explains(one: Origin) -> str:
    return f"{one.says} ({100.0 * min(one.explained_share, 1.0):.0f} %)"


def _besides(could: Posterior, names: Sequence[Named], start: Start) -> str:
    """What may be missing beside the names, if it is worth a word."""
    family = {name: effect.family for name, effect in start.problem.effects.items()}
    named = {one.family for one in names}
    further = [(share, one) for one, share in could.families.items() if one not in named]
    share, other = max(further, default=(0.0, ""))
    if share < WORTH_A_WORD:
        return ""
    sets = (one.effects for one in could.models if other in {family[e] for e in one.effects})
    law = next(name for name in next(sets) if family[name] == other)
    return f" Perhaps also {plain(law)} ({other} {share:.2f})."


def _unnamed(could: Posterior, family: Mapping[str, str]) -> tuple[str, str]:
    """That nothing is named, and which law comes nearest, or that it is left open."""
    if could.leaves_open:
        law, _ = _best_law(could, family)
        return (
            f"Something is missing, and these logs leave open whether it is {law} or no law of the"
            f" catalogue ({could.unknown:.2f}).",
            "",
        )
    said = f"Something is missing that no law of the catalogue describes ({could.unknown:.2f})."
    return said, _nearest(could, family, "If a law describes it")


def _without_gap(could: Posterior, family: Mapping[str, str], left: str) -> tuple[str, str]:
    """That there is no gap, and which law comes nearest, or that it is left open."""
    said, none = f"The plant file, refitted, describes these logs{left}", could.none
    if not could.leaves_open:
        return f"{said} ({none:.2f})", _nearest(could, family, "If there is a gap")
    law, share = _best_law(could, family)
    gaps = [law] if share >= WORTH_A_WORD else []
    if could.unknown >= WORTH_A_WORD or not gaps:
        gaps.append(f"one that no law of the catalogue describes ({could.unknown:.2f})")
    return (
        f"{said}. They leave open whether there is a gap: {', '.join(gaps)} or none ({none:.2f})",
        "",
    )


def _nearest(could: Posterior, family: Mapping[str, str], begins: str) -> str:
    """The law that comes nearest where none is named, if it is worth a word."""
    law, share = _best_law(could, family)
    return f" {begins}, it is {law}." if share >= WORTH_A_WORD else ""


def _best_law(could: Posterior, family: Mapping[str, str]) -> tuple[str, float]:
    """The set that comes nearest with the most probable of its families, in words, and that
    family's probability. ``family``: of each effect of the catalogue.
    """
    best = next((one for one in could.models if one.effects), None)
    if best is None:
        return "", 0.0
    kinds = [family[name] for name in best.effects]
    share, kind = max((could.families.get(kind, 0.0), kind) for kind in kinds)
    return f"{set_words(best.effects)} ({kind} {share:.2f})", share


def _described(none: Model) -> str:
    """How well the plant file describes logs that have no gap."""
    told = (_above(none, view, "their noise", words) for view, words in (*FITTED, *UNSEEN))
    above = [one for one in told if one]
    return f" to {', '.join(above)}" if above else " to their noise"


def _above(model: Model, view: str, floor: str, words: str) -> str:
    """How far above its floor a model is in a view; '' where it is not."""
    times = _times_floor(model, view) if view in model.views else 0.0
    return f"{times:.2g} times {floor} {words}".strip() if times >= NO_GAP else ""


def _left(model: Model, none: Model) -> str:
    """What a set of effects leaves, in each view that shows a gap: of the gap, and over the floor.
    A small part of a large gap may still be many times the noise; what no fit has seen may show
    that a set was fitted to chance.
    """
    parts = []
    for view, words in FITTED:
        gap = left_in(none, view) if view in none.views else 0.0
        if gap > DECIDES:
            little = "little" if left_in(model, view) > DECIDES else "no"
            floors = _above(model, view, "the floor", "") or f"{little} more than noise"
            parts.append((_percent(left_in(model, view) / gap), f"{words}, {floors}"))
    if not parts:
        return ""
    who = "It leaves"
    if len(model.effects) > 1:
        who = f"{set_words(model.effects).capitalize()} leave"
    (first, view), *more = parts
    rest = "".join(f"; {percent} {words}" for percent, words in more)
    told = (_above(model, view, "the floor", words) for view, words in UNSEEN)
    held = "".join(f"; {one}" for one in told if one)
    return f" {who} {first} of the gap {view}{rest}{held}."


def _percent(part: float) -> str:
    percent = 100.0 * part
    if percent < LITTLE_PERCENT:
        return f"less than {LITTLE_PERCENT} %"
    return f"{percent:.2g} %" if percent < 99.5 else f"{percent:.0f} %"


def _times_floor(model: Model, view: str) -> float:
    """What a model leaves in a view over what noise alone leaves, rms of all links; 0 where nothing
    is judged.
    """
    links = model.views[view].links.values()
    noise = sum(seen.floor for seen in links)
    return float(np.sqrt(sum(seen.chi for seen in links) / noise)) if noise > 0.0 else 0.0
