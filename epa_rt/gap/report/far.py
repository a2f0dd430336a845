"""How far: bars of before, after and floor for every channel, and the shares with their
intervals.
"""

from collections.abc import Sequence

from epa_rt.gap.diagnosis import Diagnosis, Shrinkage
from epa_rt.gap.report.words import (
    BASELINES,
    MODES,
    SOURCES,
    before_words,
    channel_words,
    got_worse,
    judged_on,
    share_words,
    shown_rows,
    size,
    times,
)
from epa_rt.report.markup import Html, folded, join, note, paragraph, table, tag

_HEADS = {
    "teacher_forced": "Block by block, each fed with what was measured",
    "free_run": "The whole plant in free run, fed with the commands only",
}


def how_far(diagnosis: Diagnosis) -> Html:
    """Bars over all logs against the refitted nominal plant; every row in a table that opens."""
    rows = diagnosis.shrinkage
    if not rows:
        return paragraph("Not shown: no shrinkage was measured.")
    parts = [
        note(
            f"Measured on {judged_on(diagnosis)}. ",
            _key(),
            " The share closed is 1 − (after² − floor²)/(before² − floor²), never clipped: below"
            " zero the patch makes it worse; where it is less than −100 %, the multiples of the"
            " floor before and after stand in its place. Its 95 % interval stands in brackets."
            " Before: ",
            before_words(diagnosis),
            "; after: ",
            (
                "with the effects."
                if diagnosis.effects
                else "nominal parameters refitted (no effect is named)."
            ),
        )
    ]
    for mode, head in _HEADS.items():
        chosen = [row for row in shown_rows(diagnosis) if row.mode == mode]
        if chosen:
            source = chosen[0].floor_source
            parts += [
                tag("h3", head),
                tag("div", join(map(_bars, chosen)), class_="bars"),
                note(f"Floor from {SOURCES.get(source, source)}."),
            ]
    parts.append(
        folded(
            f"All {len(rows)} figures, also against the plant file as it stands and log by log",
            _table(rows),
        )
    )
    return join(parts)


def _key() -> Html:
    return join(
        (
            tag("span", words, class_=f"swatch {words.split()[-1]}")
            for words in ("before", "after", "noise floor")
        ),
        " ",
    )


def _bars(row: Shrinkage) -> Html:
    longest = max(row.before, row.after, row.floor) or 1.0

    def bar(value: float, kind: str) -> Html:
        beyond = (
            100.0 * max(row.floor - value, 0.0) / longest
        )  # the number stands right of the floor's line, not across it
        return tag(
            "span",
            join(
                [
                    tag("i", "", class_=kind, style=f"width:{100.0 * value / longest:.2f}%"),
                    tag(
                        "em",
                        size(value, row.unit),
                        style=f"margin-left:calc(.45em + {beyond:.2f}%)",
                    ),
                ]
            ),
            class_="track",
        )

    floor = tag("i", "", class_="floor", style=f"--at:{row.floor / longest:.4f}")
    words = join(
        [
            tag("strong", share_words(row)),
            "" if row.closed_share is None or got_worse(row) else " closed",
            tag("span", f"{times(row.times_floor)} floor left", class_="soft"),
        ]
    )
    pair = join([bar(row.before, "before"), bar(row.after, "after"), floor])
    parts = ((channel_words(row.channel), "name"), (pair, "pair"), (words, "says"))
    return tag(
        "div", join(tag("span", content, class_=name) for content, name in parts), class_="row"
    )


def _table(rows: Sequence[Shrinkage]) -> Html:
    lines = [
        [
            channel_words(row.channel),
            MODES[row.mode],
            row.log,
            BASELINES[row.baseline],
            size(row.before, row.unit),
            size(row.after, row.unit),
            size(row.floor, row.unit),
            share_words(row),
            times(row.times_floor),
        ]
        for row in rows
    ]
    return table(
        [
            "Channel",
            "Mode",
            "Log",
            "Before is",
            "Before",
            "After",
            "Floor",
            "Share closed",
            "Floor left",
        ],
        lines,
        (0, 1, 2, 3),
    )
