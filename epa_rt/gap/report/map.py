"""The map: the chain of blocks from the bus to the sensors, and where in state, frequency and time
the gap lies.
"""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Protocol

from epa_rt.gap.diagnosis import Named, Origin, Place, likely
from epa_rt.gap.report.words import channel_words, named_words, region_words, size, times
from epa_rt.report.markup import Html, folded, join, note, tag

CHAIN = ("bus", "drive", "transmission", "gas", "muscle", "load", "sensors")
AT_FLOOR, HOTTEST = 1.15, 30.0
MOST_REGIONS = 14
AS_IS = "All figures are those of the plant file as it stands, nothing refitted."
REFITTED = (
    "All figures are those after the plant file's own numbers (its nominal parameters) have been"
    " refitted within what is believed of them, before any effect is added."
)
_SIDE = re.compile(r" (> 0|< 0|near 0|low|high)$")


class Mapped(Protocol):
    """What the map shows: of a diagnosis, or of what was located without one."""

    location: tuple[Place, ...]
    free_run_location: tuple[Place, ...]
    origins: tuple[Origin, ...]
    effects: tuple[Named, ...]


def gap_map(diagnosis: Mapped, as_is: bool = False) -> Html:
    """``as_is``: of the plant file as it stands. Boxes of the chain, then regions, bands and time
    against the links, all in multiples of the floor.
    """
    places = list(
        {place.link: place for place in diagnosis.location}.values()
    )  # of a link that stands for another block too, its own
    if not places:
        return note("Not shown: no link of this rig could be judged with these logs.")
    return join(
        [
            note(
                "Each box is a block of the plant, fed with what was measured and held against what"
                " it should give. 1 × is the noise floor: nothing to find there. The stronger the"
                " colour, the larger the gap. " + (AS_IS if as_is else REFITTED)
            ),
            _chain(diagnosis, places),
            _legend(),
            _tables(places),
            _free_run(diagnosis.free_run_location, as_is),
        ]
    )


def _tables(places: Sequence[Place]) -> Html:
    return join(
        [
            tag(
                "div",
                join(
                    [
                        _grid("In which state of the rig", _regions(places), places),
                        _grid("In which frequency band, Hz", _bands(places), places),
                    ]
                ),
                class_="beside",
            ),
            _time(places),
        ]
    )


def _free_run(places: Sequence[Place], as_is: bool) -> Html:
    """The same tables for the whole plant run from its commands alone; nothing where the rig has no
    model of the whole.
    """
    if not places:
        return Html("")
    overall = {"over all": {place.link: place.times_floor for place in places}}
    believed = "as the plant file has it" if as_is else "with its nominal parameters fitted to that"
    return folded(
        "The same in free run, reading by reading",
        join(
            [
                note(
                    "The whole plant run from its commands alone,"
                    f" {believed}."
                    " An error of one block goes through all readings behind it, so that this says"
                    " how much is off where, and not of which block."
                ),
                _grid("Readings", overall, places),
                _tables(places),
            ]
        ),
    )


def heat(value: float) -> float:
    """0 at the floor to 1 at thirty times the floor, by its logarithm."""
    return (
        0.0
        if not value > AT_FLOOR
        else min(math.log(value / AT_FLOOR) / math.log(HOTTEST / AT_FLOOR), 1.0)
    )


def _shade(value: float) -> dict[str, str]:
    strength = heat(value)
    return {
        "style": f"--heat:{0.0 if strength == 0.0 else 0.10 + 0.85 * strength:.2f}",
        "class_": "heat hot" if strength > 0.55 else "heat",
    }


def _chain(diagnosis: Mapped, places: Sequence[Place]) -> Html:
    of_block: dict[str, list[Place]] = {}
    for place in places:
        of_block.setdefault(place.block, []).append(place)
    named: dict[str, list[str]] = {effect.block: [] for effect in diagnosis.effects}
    for effect in diagnosis.effects:
        named[effect.block].append(named_words(effect))
    for one in likely(diagnosis.origins):
        named.setdefault(one.block, []).append(f"from {one.says}?")
    known = [block for block in CHAIN if block in of_block or block in named]
    order = list(CHAIN) if len(known) >= 3 else known
    order += [block for block in (*of_block, *named) if block not in order]
    return tag(
        "ol",
        join(_box(block, of_block.get(block, ()), named.get(block, ())) for block in order),
        class_="chain",
    )


def _box(block: str, places: Sequence[Place], effects: Sequence[str]) -> Html:
    worst = max((place.times_floor for place in places), default=0.0)
    lines = [tag("b", block)]
    for place in sorted(places, key=lambda p: -p.times_floor):
        what = tag(
            "span", join([tag("i", times(place.times_floor)), f" {place.link}"]), class_="figure"
        )
        lines += [
            what,
            tag(
                "span",
                (
                    f"{channel_words(place.channel)}: {size(place.excess, place.unit)} over the"
                    " floor"
                    if place.excess > 0.0
                    else f"{channel_words(place.channel)}: at the floor"
                ),
                class_="small",
            ),
        ]
    if not places:
        lines.append(tag("span", "not measured on its own", class_="small"))
    lines += [tag("span", name, class_="named") for name in effects]
    look = _shade(worst) if places else {"class_": "heat unseen", "style": "--heat:0"}
    return tag("li", tag("div", join(lines), **look))


def _legend() -> Html:
    steps = (1.0, 2.0, 4.0, 8.0, 16.0, 30.0)
    cells = join(tag("span", f"{step:g} ×", **_shade(step)) for step in steps)
    return tag(
        "p",
        join(
            [
                cells,
                tag("span", " rms of the gap, in multiples of the noise floor", class_="soft"),
                "   ",
                tag("span", "effect", class_="named"),
                tag(
                    "span",
                    " what is named there, or an error that would explain the gap",
                    class_="soft",
                ),
            ]
        ),
        class_="legend",
    )


def _regions(places: Sequence[Place]) -> dict[str, dict[str, float]]:
    """Those quantities whose regions differ most, each with all of its regions: high alone would
    say that low has no gap. At most so many that one can read them.
    """
    found: dict[str, dict[str, float]] = {}
    for place in places:
        for region, value in place.state.items():
            found.setdefault(region, {})[place.link] = value
    overall = {place.link: place.times_floor for place in places}
    contrast = {
        region: max(
            abs(math.log(max(v, 1e-3) / max(overall[link], 1e-3))) * heat(max(v, overall[link]))
            for link, v in row.items()
        )
        for region, row in found.items()
    }
    of_quantity: dict[str, list[str]] = {}
    for region in found:
        of_quantity.setdefault(_quantity(region), []).append(region)
    kept: set[str] = set()
    for regions in sorted(
        of_quantity.values(), key=lambda regions: -max(contrast[region] for region in regions)
    ):
        if not kept or len(kept) + len(regions) <= MOST_REGIONS:
            kept |= set(regions)
    return {region: row for region, row in found.items() if region in kept}


def _quantity(region: str) -> str:
    """'muscle_speed_m_s' of 'muscle_speed_m_s > 0' and of 'reversal of muscle_speed_m_s'."""
    return _SIDE.sub("", region.removeprefix("reversal of "))


def _bands(places: Sequence[Place]) -> dict[str, dict[str, float]]:
    names = sorted(
        dict.fromkeys(band for place in places for band in place.band_hz),
        key=lambda band: _number(band.partition("-")[0]),
    )
    return {
        band: {place.link: place.band_hz[band] for place in places if band in place.band_hz}
        for band in names
    }


def _grid(title: str, rows: Mapping[str, Mapping[str, float]], places: Sequence[Place]) -> Html:
    if not rows:
        return Html("")
    links = [place for place in places if any(place.link in row for row in rows.values())]
    head = tag("tr", join([tag("th", ""), *(tag("th", _heading(p)) for p in links)]))
    body = join(
        tag(
            "tr",
            join(
                [
                    tag("th", region_words(name), scope="row"),
                    *(_cell(row.get(p.link)) for p in links),
                ]
            ),
        )
        for name, row in rows.items()
    )
    table = tag("table", join([tag("thead", head), tag("tbody", body)]), class_="grid")
    return tag("div", join([tag("h3", title), tag("div", table, class_="wide")]))


def _name(place: Place) -> str:
    return (
        channel_words(place.channel) if place.link == place.channel else place.link
    )  # in free run a reading is its own link


def _heading(place: Place) -> object:
    return (
        _name(place)
        if place.link == place.channel
        else join([place.link, tag("small", channel_words(place.channel))])
    )


def _cell(value: float | None) -> Html:
    return (
        tag("td", "", class_="empty")
        if value is None or not math.isfinite(value)
        else tag("td", times(value), **_shade(value))
    )


def _time(places: Sequence[Place]) -> Html:
    """One strip per link: a cell per stretch of time, logs set apart."""
    keys = list(dict.fromkeys(key for place in places for key in place.time_s))
    if not keys:
        return Html("")
    logs: dict[str, list[str]] = {}
    for key in keys:
        logs.setdefault(key.rpartition(" ")[0], []).append(key)
    for inside in logs.values():
        inside.sort(key=_begin)
    rows = []
    for place in places:
        strips = join(
            tag(
                "span",
                join(_tick(place, key) for key in inside),
                class_="strip",
                style=f"flex-grow:{len(inside)}",
            )
            for inside in logs.values()
        )
        rows += [tag("span", _name(place), class_="name"), tag("span", strips, class_="strips")]
    labels = join(
        tag(
            "span",
            join([log, " ", tag("span", f"to {_end(inside[-1])} s", class_="soft")]),
            class_="strip label",
            style=f"flex-grow:{len(inside)}",
        )
        for log, inside in logs.items()
    )
    rows += [tag("span", "", class_="name"), tag("span", labels, class_="strips")]
    return join([tag("h3", "When"), tag("div", join(rows), class_="time")])


def _tick(place: Place, key: str) -> Html:
    value = place.time_s.get(key)
    if value is None or not math.isfinite(value):
        return tag("span", "", class_="empty", title=f"{key} s: not judged")
    return tag("span", "", title=f"{key} s: {times(value)} floor", **_shade(value))


def _begin(key: str) -> float:
    return _number(key.rpartition(" ")[2].partition("-")[0])


def _end(key: str) -> str:
    return key.rpartition(" ")[2].partition("-")[2]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 0.0
