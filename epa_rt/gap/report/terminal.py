"""A diagnosis on the terminal: what was found first, the verdict, the effects, where, how far, what
next.
"""

from collections.abc import Sequence

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from epa_rt.config.units import with_unit
from epa_rt.gap.diagnosis import Diagnosis, Place
from epa_rt.gap.held_out.shrink import OVERALL
from epa_rt.gap.report.could import show_posterior
from epa_rt.gap.report.gate import gate_line
from epa_rt.gap.report.left_words import ends_words, goes_with
from epa_rt.gap.report.origin import origin_words
from epa_rt.gap.report.words import (
    MODES,
    PROBABILITY,
    WHO,
    before_words,
    by_log_words,
    channel_words,
    free_run_words,
    gone_words,
    judged_on,
    more_numbers_words,
    onset_words,
    parameter_words,
    percent,
    plain,
    region_words,
    said_otherwise,
    share_words,
    shown_rows,
    sigmas,
    size,
    times,
    verdict_words,
)

MOST_PLACES, MOST_NOT_TESTED = 8, 12
STANDS_OUT = 4.0  # times the median stretch of time


def console() -> Console:
    """As wide as the terminal; wide enough for every column where it is a file."""
    found = Console(highlight=False, markup=False)
    return found if found.is_terminal else Console(highlight=False, markup=False, width=160)


def show(diagnosis: Diagnosis, out: Console) -> None:
    """Everything that an operator needs to read before opening the page."""
    show_found(diagnosis.found_first, out)
    word, _ = verdict_words(diagnosis)
    out.print(f"{word.upper()}: {diagnosis.says}", style="bold")
    if words := ends_words(diagnosis):
        out.print(f"{words}.", style="bold yellow")
    if diagnosis.effects:
        _effects(diagnosis, out)
    _nominal(diagnosis, out)
    if words := free_run_words(diagnosis):
        out.print(words)
    if diagnosis.posterior:
        show_posterior(diagnosis.posterior, out)
    show_location(diagnosis.location, out)
    held_out = bool(diagnosis.inputs.get("holdout"))
    if not held_out:  # the floor of "how far" is that of the fitted logs
        _unmeasured(diagnosis, out)
    if words := origin_words(diagnosis.origins):
        out.print(words)
    if words := onset_words(diagnosis.onset):
        out.print(words)
    _changes(diagnosis, out)
    _far(diagnosis, out)
    if held_out:
        _unmeasured(diagnosis, out)
    for left in diagnosis.remainder[:3]:
        on = ", ".join(
            f"{region_words(name)} {percent(part)}" for name, part in goes_with(left)[:3]
        )
        out.print(
            f"left in {left.link}: {size(left.rms, left.unit)}, {times(left.rms / left.floor)}"
            " floor" + (f"; goes with {on}" if on else "")
        )
    _next(diagnosis, out)
    out.print(f"{diagnosis.seconds:.0f} s", style="dim")


def show_found(found: Sequence[str], out: Console) -> None:
    """What is wrong with the logs; nothing where nothing is."""
    if found:
        out.print("Found in the logs first:", style="bold yellow")
        for sentence in found:
            out.print(f"  {sentence}", style="yellow")


UNMEASURED = (
    "No run of the rig or of the plant has measured this floor: slow noise is not in it, so that σ"
    " and times the floor come out too high. Repeats of one motion tell; of a rig of others laps,"
    " or its repeats_to."
)


def _unmeasured(diagnosis: Diagnosis, out: Console) -> None:
    if any(row.floor_source == "sensors" for row in diagnosis.shrinkage):
        out.print(UNMEASURED, style="dim")


def show_location(places: Sequence[Place], out: Console) -> None:
    """Links ranked by significance, with the state, band and time where each is largest."""
    if not places:
        out.print("where: no link of this rig could be judged with these logs")
        return
    table = Table(
        "Where",
        "Block",
        "Channel",
        "Gap",
        "Floor",
        "x floor",
        "σ",
        "Largest at",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    for place in places[:MOST_PLACES]:
        peaks = [
            region_words(max(part, key=part.get)) + unit
            for part, unit in ((place.state, ""), (place.band_hz, " Hz"))
            if part
        ] + sudden(place)
        table.add_row(
            place.link,
            place.block,
            channel_words(place.channel),
            size(place.excess, place.unit) if place.excess > 0.0 else "none",
            size(place.floor, place.unit),
            times(place.times_floor),
            sigmas(place.significance),
            "; ".join(peaks) if place.times_floor > 1.15 else "",
        )
    out.print(table)
    out.print(
        "Floor: what noise alone leaves, rms. x floor: all that is left over the floor; 1 × is"
        " noise alone.\nσ: standard deviations by which that stands above what noise would give;"
        " above 4 is beyond doubt.",
        style="dim",
    )


def sudden(place: Place) -> list[str]:
    """The stretch of time that stands out from all others, where one does: something that happened
    once is in no state and in no band.
    """
    if len(place.time_s) < 3:
        return []
    name = max(place.time_s, key=place.time_s.get)
    return (
        [f"{name} s"]
        if place.time_s[name] > STANDS_OUT * float(np.median(list(place.time_s.values())))
        else []
    )


def _effects(diagnosis: Diagnosis, out: Console) -> None:
    table = Table(
        "Effect",
        "Family",
        "Block",
        "Confidence",
        "Parameter",
        "Value",
        "95 % interval",
        "Unit",
        "Not separable from",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    for effect in diagnosis.effects:
        head = [effect.name, effect.family, effect.block, percent(effect.confidence)]
        others = ", ".join(effect.not_separable_from) or "–"
        for i, one in enumerate(effect.parameters):
            value, interval, _, unit = (
                parameter_words(one) if effect.who != "plant_file" else gone_words(one)
            )
            table.add_row(
                *(head if i == 0 else [""] * 4),
                one.name,
                value,
                interval,
                unit,
                others if i == 0 else "",
            )
        if not effect.parameters:
            table.add_row(*head, "", "", "", "", others)
    out.print(table)
    out.print(f"Confidence in an effect: {PROBABILITY}.", style="dim")
    for effect in diagnosis.effects:
        if words := by_log_words(effect):
            out.print(f"{plain(effect.name)}: {words}")
    for effect in (one for one in diagnosis.effects if one.in_more_numbers):
        out.print(f"{plain(effect.name)}: {more_numbers_words(effect)}")
    for effect in (one for one in diagnosis.effects if one.who in WHO):
        says = ", ".join(
            f"{one.name} {gone_words(one)[2]} {gone_words(one)[3]}".rstrip()
            for one in effect.parameters
        )
        out.print(
            f"{plain(effect.name)}: {WHO[effect.who]}; the plant file says {says}", style="bold"
        )


def _nominal(diagnosis: Diagnosis, out: Console) -> None:
    """Numbers of the plant file that these logs say otherwise."""
    told = (*diagnosis.nominal_moved, *said_otherwise(diagnosis))
    if told:
        out.print("The plant file's own numbers that these logs say otherwise:")
    for one in told:
        value, interval, neutral, unit = parameter_words(one)
        further = ", further than it should be wrong" if one in diagnosis.nominal_moved else ""
        out.print(f"  {one.name} from {neutral} to {value} {unit} ({interval}){further}")


def _changes(diagnosis: Diagnosis, out: Console) -> None:
    """What moved since the baseline, the furthest first."""
    if not diagnosis.changes:
        return
    out.print("Since the baseline, in spreads from one healthy run to the next:")
    table = Table("Number", "Was", "Is", "Spread", "Spreads", box=box.SIMPLE_HEAD, pad_edge=False)
    for one in diagnosis.changes:
        row = (with_unit(f"{x:.4g}", one.unit) for x in (one.before, one.now, one.spread))
        table.add_row(one.name, *row, f"{one.spreads:+.1f}")
    out.print(table)


def _far(diagnosis: Diagnosis, out: Console) -> None:
    rows = shown_rows(diagnosis)
    if not rows:
        return
    out.print(
        f"How far, on {judged_on(diagnosis)}; before: {before_words(diagnosis)}, after:"
        f" {'with the effects' if diagnosis.effects else 'refitted'}"
    )
    table = Table(
        "Channel",
        "Mode",
        "Before",
        "After",
        "Floor",
        "Gap closed (95 %)",
        "Floor left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    for row in rows:
        table.add_row(
            channel_words(row.channel),
            MODES[row.mode],
            size(row.before, row.unit),
            size(row.after, row.unit),
            size(row.floor, row.unit),
            share_words(row),
            times(row.times_floor),
            style="bold" if row.channel == OVERALL else None,
        )
    out.print(table)
    out.print(
        "block by block: every block fed with what was measured. free run: the whole plant fed with"
        " the commands alone.",
        style="dim",
    )
    if diagnosis.gate:
        out.print(gate_line(diagnosis.gate))


def _next(diagnosis: Diagnosis, out: Console) -> None:
    if diagnosis.not_tested:
        names = ", ".join(map(plain, diagnosis.not_tested[:MOST_NOT_TESTED]))
        more = len(diagnosis.not_tested) - MOST_NOT_TESTED
        out.print(f"not tested by these logs: {names}{f' and {more} more' if more > 0 else ''}")
    if diagnosis.next_experiment:
        out.print(f"next experiment: {diagnosis.next_experiment.says}", style="bold")
