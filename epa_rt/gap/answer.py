"""The answer in words and numbers, from what was found: names, confidence, intervals, places,
verdict.
"""

from collections.abc import Sequence
from dataclasses import replace

from epa_rt.gap.attribution import Attribution, Progress
from epa_rt.gap.blocks_alone import doubted_by, nothing_shows, without_names
from epa_rt.gap.coverage import above_noise, unforeseen
from epa_rt.gap.diagnosis import SILENT, Diagnosis, FreeRun, Named, Origin, Shrinkage, Verdict
from epa_rt.gap.held_out import (
    not_carried_over,
    not_closed,
    said_of_held_out,
    said_of_not_closed,
    said_of_unforeseen,
    times_floor,
)
from epa_rt.gap.localise import localise
from epa_rt.gap.named import furthest, moved, named, numbers
from epa_rt.gap.origin import origin_first, origins
from epa_rt.gap.plausible import absorbed, beyond_belief, within_belief
from epa_rt.gap.recording import Recording
from epa_rt.gap.remainder import remainders
from epa_rt.gap.run_freely import localise_freely
from epa_rt.gap.shrink import label
from epa_rt.gap.subject import Subject
from epa_rt.gap.unshown import could_sit, with_unshown
from epa_rt.gap.weigh import Weighed, weighed
from epa_rt.gap.wording import said_of_moved

NAMELESS = (*SILENT, "not_in_catalogue")  # verdicts beside which no name stands


def composed(
    subject: Subject,
    recordings: Sequence[Recording],
    found: Attribution,
    rows: Sequence[Shrinkage] = (),
    unseen: bool = True,
    progress: Progress = lambda stage, share: None,
) -> Diagnosis:
    """The answer in the words of ``diagnosis.py``. ``rows``: how far the gap shrinks, on logs or
    trials that no fit has seen where ``unseen``.
    """
    if found.heard is None and found.selection.roles and nothing_shows(found.before):
        found = without_names(found)
    problem, selection, weights, held_out = (
        found.problem,
        found.selection,
        weighed(found),
        rows if unseen else (),
    )
    names, words = _names(weights, held_out)
    verdict, says = weights.verdict(names)
    nearest = tuple(one.name for one in names)
    names = () if verdict in NAMELESS else names
    apart = not_carried_over(held_out, times_floor(problem.subject.links, found.before))
    verdict, says, beyond = _last_word(found, verdict, says, names, held_out, apart)
    point, off = (selection.final, found.off) if names else (selection.base, None)
    went = moved(problem, point.normal, off)
    says = f"{says} {said_of_moved(went)}" if verdict == "no_gap" and went else says
    progress("how sure its numbers are", 0.96)
    names = tuple(
        replace(one, parameters=numbers(problem, selection.final, one.name, off, searched=True))
        for one in names
    )
    places = localise(subject, problem.prepared, _seen_at(weights), problem.floors)
    says = next(
        (
            said_of_unforeseen(place.channel, place.times_floor)
            for place in places
            if place.link == beyond
        ),
        says,
    )
    says = with_unshown(says, could_sit(problem, _links_of(weights, beyond, apart), weights.silent))
    whence: tuple[Origin, ...] = ()
    if verdict == "not_in_catalogue":
        progress("where it comes from", 0.96)
        whence = origins(problem, selection.base.values)
        progress("what is left", 0.99)
    heard = found.heard
    return Diagnosis(
        verdict=verdict,
        says=says,
        found_first=tuple(f"{r.name}: {what}" for r in recordings for what in r.found),
        location=origin_first(places, whence),
        origins=whence,
        effects=names,
        doubts=words if names else (),
        free_run_location=(
            localise_freely(subject, recordings, heard.bare, problem.prepared) if heard else ()
        ),
        free_run=heard and FreeRun(heard.gap, heard.left, heard.part, nearest, heard.told_apart),
        nominal_moved=went,
        not_tested=weights.silent,
        shrinkage=tuple(rows),
        fitted=dict(point.values),
        refitted=found.refitted if names else dict(selection.base.values),
        remainder=remainders(
            subject,
            problem.prepared,
            selection.base.values,
            point.values,
            problem.floors,
            problem.designs,
        ),
    )


def _names(
    weights: Weighed, held_out: Sequence[Shrinkage]
) -> tuple[tuple[Named, ...], tuple[str, ...]]:
    """What was found, as it would be named, and why that is doubted. Where no free run can speak,
    blocks, logs set aside and bounds do.
    """
    found = weights.found
    names, words = (
        tuple(named(found, k, weights.trusted) for k in range(len(found.selection.roles))),
        weights.doubts,
    )
    if found.heard is not None:
        return names, words
    against = [doubted_by(found.problem, one, not_closed(held_out)) for one in names]
    names = tuple(
        replace(one, confidence=one.confidence * counts)
        for one, (counts, _) in zip(names, against, strict=True)
    )
    return names, (*words, *(word for _, why in against for word in why))


def _last_word(
    found: Attribution,
    verdict: Verdict,
    says: str,
    names: Sequence[Named],
    held_out: Sequence[Shrinkage],
    apart: Shrinkage | None,
) -> tuple[Verdict, str, str | None]:
    """Verdict and sentences after the logs set aside and, without a model of the whole, the noise
    floor have spoken, and the link of which nothing measured foresees what it leaves. ``apart``:
    the channel that the refitted plant misses on the logs set aside.
    """
    if apart is not None and verdict in SILENT:
        verdict, says = (
            "not_in_catalogue",
            said_of_held_out(apart, furthest(found.problem, found.selection.base.normal)),
        )
    silence = found.heard is None and verdict in SILENT
    beyond = (
        unforeseen(
            found.before, {link: floor.source for link, floor in found.problem.floors.items()}
        )
        if silence
        else None
    )
    kept = not_closed(held_out) if names else None
    if kept is not None:
        verdict, says = (
            ("partly_explained" if verdict == "explained" else verdict),
            f"{says} {said_of_not_closed(kept)}",
        )
    return "not_in_catalogue" if beyond else verdict, says, beyond


def _links_of(weights: Weighed, beyond: str | None, apart: Shrinkage | None) -> tuple[str, ...]:
    """The links that the verdict's sentences speak of; none where only the whole plant shows a gap.
    ``apart`` as in ``_last_word``.
    """
    if beyond is not None:
        return (beyond,)
    if weights.where:
        return weights.where
    links = weights.found.problem.subject.links
    return tuple(
        link.name for link in links if apart is not None and label(links, link) == apart.channel
    )


def _seen_at(weights: Weighed) -> dict[str, float]:
    """The values at which it is judged where the gap is. Nominal parameters that nobody believes do
    not hide it: where no link shows any they are the plant file's, where links show less than what
    these hide they go no further than a plant file may be wrong (a second lag of a gauge, taken for
    17 times the sensor's own, left next to nothing in the gas and showed in a knee's
    acceleration).
    """
    found, base, problem = weights.found, weights.found.selection.base, weights.found.problem
    if not weights.where:
        return {key: value for key, value in base.values.items() if key not in weights.odd}
    hide = beyond_belief(base.normal)
    if absorbed(base.normal, hide) <= above_noise(found.before, problem.scale):
        return dict(base.values)
    return dict(within_belief(problem, base, hide).values)
