"""The page of ``epa gap localise``: where a gap lies, without a cause."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from epa_rt.gap.diagnosis import Origin, Place
from epa_rt.gap.report.frame import framed
from epa_rt.gap.report.map import AT_FLOOR, gap_map
from epa_rt.gap.report.origin import origins
from epa_rt.gap.report.rest import found_first
from epa_rt.gap.report.words import channel_words, times
from epa_rt.gap.where.origin import SURE
from epa_rt.report.markup import Html, join, paragraph, table, tag


@dataclass(frozen=True)
class Located:
    """What ``epa gap localise`` found, in the words of ``Diagnosis``. ``as_is``: with the plant
    file as it stands, nothing refitted.
    """

    found_first: tuple[str, ...]
    location: tuple[Place, ...]
    free_run_location: tuple[Place, ...]
    origins: tuple[Origin, ...]
    inputs: Mapping[str, object]
    as_is: bool = False
    effects: tuple[()] = ()  # it names none


def where_page(found: Located) -> str:
    """The map as a self-contained page."""
    rows = [
        [key.replace("_", " "), ", ".join(value) if isinstance(value, list) else str(value)]
        for key, value in found.inputs.items()
    ]
    return framed(
        "Sim-to-real gap: where it lies",
        _header(found),
        [
            ("where", "Where the gap lies", join([gap_map(found, found.as_is), origins(found)])),
            ("inputs", "What this stands on", table(["", "Read"], rows, (0, 1), "words")),
        ],
    )


def _header(found: Located) -> Html:
    told = f"The gap between {found.inputs['rig']} and {found.inputs['plant']}"
    return join(
        [
            tag("p", told, class_="kicker"),
            found_first(found),
            tag("h1", _headline(found)),
            paragraph("Where it lies, not which effect causes it: epa gap diagnose asks for that."),
        ]
    )


def _headline(found: Located) -> str:
    worst, whole = _worst(found.location), _worst(found.free_run_location)
    if worst is None:
        return "No link of this rig could be judged with these logs."
    if worst.times_floor > AT_FLOOR or worst.significance > SURE:
        return (
            f"{worst.link} ({channel_words(worst.channel)}) shows most: {times(worst.times_floor)}"
            f" its noise floor, {worst.significance:.0f} standard deviations above what noise would"
            " give."
        )
    if whole is not None and whole.times_floor > AT_FLOOR and whole.significance > SURE:
        return (
            "Every block is at its noise floor, but run from its commands alone the whole plant is"
            f" not: {channel_words(whole.channel)} is {times(whole.times_floor)} its noise floor."
        )
    return "Every block is at its noise floor."


def _worst(places: Sequence[Place]) -> Place | None:
    """The place that is furthest off, of those that are numbers."""
    return max(
        (place for place in places if math.isfinite(place.times_floor)),
        key=lambda place: place.times_floor,
        default=None,
    )
