"""Health: what was invalid, stale, clamped or slewed, and how much of each range was used."""

import math

from epa_rt.report.markup import Html, join, note, table, tag
from epa_rt.report.measures.health import SignalHealth, health_of
from epa_rt.report.run import Run
from epa_rt.report.sections.section import Section
from epa_rt.report.shown import Shown, number


def health(run: Run) -> Section:
    """A row for each signal of the rig's table that is a quantity. Raises NotShown without a rig
    file.
    """
    healths = [one for one in health_of(run) if one.row.si_unit]
    head = (
        "Signal",
        "Range used within its limits",
        "Margin",
        "Invalid",
        "Stale",
        "Clamped",
        "Slewed",
        "Clamped by controller",
        "Slewed by controller",
    )
    rows = [_row(run.shown, one) for one in healths]
    return Section(
        "health",
        "Health",
        join(
            [
                table(head, rows, (0, 1), "health"),
                note(
                    "Bars: the range used, on a scale from the lower to the upper limit. Margin:"
                    " how far the signal stayed from the nearer limit. Invalid and stale are"
                    " cycles; clamped and slewed are cycles in which the envelope held a command"
                    " back, or a controller its own before that, counted when the run closes (a"
                    " dash: not recorded)."
                ),
            ]
        ),
    )


def _row(shown: Shown, one: SignalHealth) -> list[object]:
    margin: object = shown.difference(one.margin, one.row.si_unit)
    margin = tag("strong", f"▲ {margin}", class_="off") if one.margin < 0.0 else margin
    is_output = one.row.is_output
    held = (one.clamped, one.slewed, one.controller_clamped, one.controller_slewed)
    counts = [_count(n) for n in (held if is_output else (one.invalid, one.stale))]
    return [
        one.row.name,
        _bar(shown, one),
        margin,
        *(["", "", *counts] if is_output else [*counts, "", "", "", ""]),
    ]


def _count(n: int | None) -> object:
    if n is None:
        return "–"
    return tag("strong", f"▲ {n:,}", class_="off") if n else "0"


def _bar(shown: Shown, one: SignalHealth) -> Html:
    scale = shown.scale(one.row.si_unit)
    words = f"{number(scale.of(one.low))} to {number(scale.of(one.high))} {scale.unit}"
    if one.row.limits is None or not math.isfinite(one.low):
        return join([tag("span", words, class_="range"), tag("span", "no limits", class_="soft")])
    low, high = one.row.limits
    left, right = (
        min(max((value - low) / (high - low), 0.0), 1.0) for value in (one.low, one.high)
    )
    fill = tag(
        "i",
        "",
        style=f"left:{left:.2%};width:{max(right - left, 0.004):.2%}",
        class_="over" if one.margin < 0.0 else "fill",
    )
    ends = tag("span", f"{number(scale.of(low))} … {number(scale.of(high))}", class_="soft")
    return join([tag("span", words, class_="range"), tag("span", fill, class_="bar"), ends])
