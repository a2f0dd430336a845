"""The answer in words and numbers, from what was found: names, confidence, intervals, places, verdict."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from epa_rt.gap.attribution import Attribution, Progress
from epa_rt.gap.bars import BARS
from epa_rt.gap.blocks_alone import doubted_by, nothing_shows, without_names
from epa_rt.gap.coverage import above_noise, broken, coverage, gaps, passed_over, trust, unforeseen
from epa_rt.gap.diagnosis import Diagnosis, FreeRun, Named, Near, Number, Origin, Shrinkage
from epa_rt.gap.doubts import UNSUPPORTED, doubted, doubts
from epa_rt.gap.held_out import not_carried_over, not_closed, said_of_held_out, said_of_not_closed, said_of_unforeseen
from epa_rt.gap.localise import localise
from epa_rt.gap.origin import origin_first, origins
from epa_rt.gap.plausible import absorbed, beyond_belief, beyond_belief_together, strained, within_belief
from epa_rt.gap.point import Normal, Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.profile import profiled
from epa_rt.gap.recording import Recording
from epa_rt.gap.remainder import remainders
from epa_rt.gap.role import z_of_sum
from epa_rt.gap.run_freely import localise_freely
from epa_rt.gap.separate import intervals, shares
from epa_rt.gap.subject import Subject
from epa_rt.gap.verdict import Evidence, decided, informed, said, said_of_moved, untested
from epa_rt.gap.whose import spoken, who_has

FOLLOWED = 0.5     # of it where the whole plant follows its commands to the noise, though a block is not content; and where all that speaks for a name is faint
MOVED = 3.0        # spreads beyond which a nominal parameter is reported
NEAR = 0.5         # of what the named one explains, from which another family's law came near


def composed(subject: Subject, recordings: Sequence[Recording], found: Attribution, rows: Sequence[Shrinkage] = (), unseen: bool = True,
             progress: Progress = lambda stage, share: None) -> Diagnosis:
    """The answer in the words of ``diagnosis.py``. ``rows``: how far the gap shrinks, on logs or trials that no fit has seen where ``unseen``."""
    if found.heard is None and found.selection.roles and nothing_shows(found.before):
        found = without_names(found)
    problem, selection = found.problem, found.selection
    screening = selection.roles[0].screening if selection.roles else selection.refused.screening if selection.refused else None
    silent = untested(screening.typical() if screening else {}, tuple(problem.effects))
    judged = informed({link: [e.name for e in problem.effects.values() if link in problem.touched(e.knobs)] for link in problem.links}, silent)
    lost = found.heard.left if found.heard and not selection.roles else None
    where = () if lost is not None and lost <= BARS.unshown else tuple(link for link in gaps(found.before, found.after) if link in judged)
    covered = coverage(found.before, found.after)
    whole, counted = (found.heard.part, found.heard.counted) if found.heard else (None, None)
    trusted = trust(found.before, found.after, whole) * (UNSUPPORTED if doubted(found.heard) else 1.0)
    there = found.heard if selection.roles else None
    to_noise, helps, over = (there.to_noise, there.helps, there.too_much_left) if there else (False, False, False)
    shown = (there.gap, there.left) if there else None
    unplaced = not where and counted is not None and counted >= BARS.carried  # no block has a gap, and free run's is explained
    lifted = to_noise or unplaced or (helps and whole is None)
    trusted = max(trusted, FOLLOWED) if lifted else trusted
    breaks = broken(found.before, found.after) if selection.roles else ()
    elsewhere = passed_over(found.before, found.after) if selection.roles and not to_noise else ()
    trusted *= UNSUPPORTED if elsewhere else 1.0
    named = tuple(_named(found, k, trusted) for k in range(len(selection.roles)))
    held_out = rows if unseen else ()
    kept, words = not_closed(held_out) if named else None, doubts(None if lifted else there, elsewhere)
    if found.heard is None:
        against = [doubted_by(problem, one, kept) for one in named]
        named = tuple(replace(one, confidence=one.confidence * counts) for one, (counts, _) in zip(named, against, strict=True))
        words += tuple(word for _, why in against for word in why)
    groundless = there is not None and not there.supports and all(one.confidence < BARS.heard_of for one in named)
    odd = _odd(found)
    rivals = [[n for n in one.not_separable_from if problem.effects[n].family != one.family] for one in named]
    verdict = decided(Evidence(bool(where), [one.name for one in named], covered, any(rivals), len(silent) / max(len(problem.effects), 1), bool(odd),
                               counted, lost, to_noise, bool(breaks), bool(elsewhere), helps,
                               trust(found.before, found.after, counted), over, groundless))
    says = said(verdict, [spoken(one) for one in named], rivals, where, covered.part, len(silent), len(problem.effects), odd, counted, lost, breaks,
                shown if helps and whole is None and covered.part < BARS.covered else None, shown if over else None)
    nearest = tuple(one.name for one in named)
    if verdict in ("not_in_catalogue", "no_gap"):
        named = ()
    apart = not_carried_over(held_out, _times_floor(found)) if verdict in ("no_gap", "not_excited") else None
    if apart is not None:
        verdict, says = "not_in_catalogue", said_of_held_out(apart)
    silence = found.heard is None and verdict in ("no_gap", "not_excited")
    beyond = unforeseen(found.before, {link: floor.source for link, floor in problem.floors.items()}) if silence else None
    verdict = "not_in_catalogue" if beyond else verdict
    if kept is not None and named:
        verdict, says = "partly_explained" if verdict == "explained" else verdict, f"{says} {said_of_not_closed(kept)}"
    seen_at = _seen_at(found, odd, bool(where))
    values = selection.final.values if named else selection.base.values
    normal = (selection.final if named else selection.base).normal
    off = found.off if named else None
    moved = _moved(problem, normal, off)
    says = f"{says} {said_of_moved(moved)}" if verdict == "no_gap" and moved else says
    progress("how sure its numbers are", 0.96)
    named = tuple(replace(one, parameters=_numbers(problem, selection.final, one.name, off, searched=True)) for one in named)
    places = localise(subject, problem.prepared, seen_at, problem.floors)
    says = next((said_of_unforeseen(place.channel, place.times_floor) for place in places if place.link == beyond), says)
    whence: tuple[Origin, ...] = ()
    if verdict == "not_in_catalogue":
        progress("where it comes from", 0.96)
        whence = origins(problem, selection.base.values)
        progress("what is left", 0.99)
    return Diagnosis(
        verdict=verdict, says=says, found_first=tuple(f"{r.name}: {what}" for r in recordings for what in r.found),
        location=origin_first(places, whence), origins=whence, effects=named, doubts=words if named else (),
        free_run_location=localise_freely(subject, recordings, found.heard.bare, problem.prepared) if found.heard else (),
        free_run=found.heard and FreeRun(found.heard.gap, found.heard.left, whole, nearest, found.heard.told_apart),
        nominal_moved=moved, not_tested=silent, shrinkage=tuple(rows), refitted=found.refitted if named else dict(selection.base.values), fitted=dict(values),
        remainder=remainders(subject, problem.prepared, selection.base.values, values, problem.floors, problem.designs))


def _times_floor(found: Attribution) -> dict[str, float]:
    """Channel to what the refitted nominal parameters leave of it in the fitted logs, in multiples of the floor."""
    links = found.before.links
    return {link.channel: float(np.sqrt(links[link.name].before)) for link in found.problem.subject.links if link.name in links}


def _odd(found: Attribution) -> tuple[str, ...]:
    """Nominal parameters beyond belief: where effects are named those that hide more than the effects explain, or that are further off together
    than plant files are.

    Where free run finds values for the whole plant that a plant file may have, that is enough. A wrong law drives them there to make up for what it lacks; with the right one they come back.
    """
    roles = found.selection.roles
    if not roles:
        return beyond_belief(found.selection.base.normal) or beyond_belief_together(found.selection.base.normal)
    normal = found.selection.final.normal
    odd = beyond_belief(normal, BARS.belief_named)
    if absorbed(normal, odd) > sum(float(role.gains[0].sum()) for role in roles):
        return odd
    return () if found.heard and found.heard.borne else strained(found.selection.base.normal, normal)


def _seen_at(found: Attribution, odd: Sequence[str], gap: bool) -> dict[str, float]:
    """The values at which it is judged where the gap is. Nominal parameters that nobody believes do not hide it: where no link shows any they are the plant
    file's, where links show less than what these hide they go no further than a plant file may be wrong (a second lag of a gauge, taken for 17
    times the sensor's own, left next to nothing in the gas and showed in a knee's acceleration)."""
    base, problem = found.selection.base, found.problem
    if not gap:
        return {key: value for key, value in base.values.items() if key not in odd}
    hide = beyond_belief(base.normal)
    if absorbed(base.normal, hide) <= above_noise(found.before, problem.scale):
        return dict(base.values)
    return dict(within_belief(problem, base, hide).values)


def _named(found: Attribution, k: int, trusted: float) -> Named:
    """With the intervals of the blocks' scatter alone. What is named itself is no rival of another name."""
    problem, final, role = found.problem, found.selection.final, found.selection.roles[k]
    effect = problem.effects[role.best.effect]
    numbers = _numbers(problem, final, effect.name, None)
    stays = shares(problem, role, found.become[k])
    same = {effect.name, *(fit.effect for fit in found.sets[k] if problem.effects[fit.effect].family == effect.family)}
    return Named(effect.name, effect.family, effect.block, numbers, trusted * sum(stays.get(name, 0.0) for name in same), float(role.gains[0].sum()),
                 tuple(fit.effect for fit in found.sets[k] if fit.effect not in final.effects), who_has(problem, effect.name, numbers), _came_near(found, k))


def _came_near(found: Attribution, k: int) -> tuple[Near, ...]:
    """The best law of each other family that explains half as much at least, three at most."""
    problem, role = found.problem, found.selection.roles[k]
    tried = found.heard.beside.get(role.best.effect, {}) if found.heard else {}
    best, near = role.gains[0], {}
    for fit, gain in zip(role.fits[1:], role.gains[1:], strict=True):
        family, share = problem.effects[fit.effect].family, float(gain.sum() / best.sum()) if best.sum() > 0.0 else 0.0
        if family != problem.effects[role.best.effect].family and family not in near and share > NEAR:
            near[family] = Near(fit.effect, family, share, z_of_sum(best - gain), tried[fit.effect].behind if fit.effect in tried else None)
    return tuple(sorted(near.values(), key=lambda one: -one.explains_share)[:3])


def _numbers(problem: Problem, point: Point, effect: str, off: np.ndarray | None, searched: bool = False) -> tuple[Number, ...]:
    """``searched``: with the ends that are searched for where straight ones lie far apart."""
    width = intervals(point.normal, problem.effects[effect].knobs, off)
    ends = profiled(problem, point, effect, width, off) if searched else {}
    return tuple(_number(problem, key, point.values.get(key, problem.knobs[key].value), by, ends.get(key)) for key, by in width.items())


def _number(problem: Problem, key: str, value: float, width: float, ends: tuple[float, float] | None = None) -> Number:
    """``width``: half of the interval, in spreads, where no ``ends`` of it are known."""
    knob, by = problem.knobs[key], width * problem.spread(key)
    value = min(max(value, knob.low), knob.high)  # spreads and back leave a whisker beside a bound
    low, high = ends or (max(value - by, knob.low), min(value + by, knob.high))
    return Number(key, value, knob.unit, low, high, knob.value)


def _moved(problem: Problem, normal: Normal, off: np.ndarray | None) -> tuple[Number, ...]:
    """Nominal parameters that went further from the plant file than anybody believed they could."""
    width = intervals(normal, problem.nominal, off)
    return tuple(_number(problem, key, problem.knobs[key].value + z * problem.spread(key), width[key])
                 for key, z in zip(normal.keys, normal.z, strict=True) if problem.knobs[key].effect is None and abs(z) > MOVED)
