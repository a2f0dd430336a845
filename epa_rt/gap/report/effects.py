"""Which effects, with their parameters and intervals; what else moved; what was not tested."""

from epa_rt.config.units import with_unit
from epa_rt.gap.diagnosis import Change, Diagnosis, Named, Number
from epa_rt.gap.report.words import (
    PROBABILITY,
    by_log_words,
    free_run_words,
    gone_words,
    more_numbers_words,
    named_words,
    parameter_words,
    percent,
    plain,
)
from epa_rt.report.markup import Html, folded, join, note, paragraph, table, tag


def effects(diagnosis: Diagnosis) -> Html:
    """The named effects, best first, each with its numbers; then the nominal parameters that
    moved.
    """
    parts = [join(_effect(i, effect) for i, effect in enumerate(diagnosis.effects, 1))]
    if not diagnosis.effects:
        parts = [paragraph("No effect is named.")]
    if words := free_run_words(diagnosis):
        parts.append(paragraph(words))
    if diagnosis.nominal_moved:
        parts += [
            tag("h3", "Nominal parameters that moved with them"),
            _numbers(diagnosis.nominal_moved),
            note(
                "A parameter of the plant file is believed to within its own spread; it moves where"
                " the logs insist."
            ),
        ]
    if diagnosis.nominal:
        parts.append(folded("The plant file's own numbers, as fitted", _numbers(diagnosis.nominal)))
    if diagnosis.changes:
        parts += [tag("h3", "What moved since the baseline"), _changes(diagnosis.changes)]
    return join(parts)


def _changes(changes: tuple[Change, ...]) -> Html:
    rows = [
        (
            one.name,
            *(with_unit(f"{x:.4g}", one.unit) for x in (one.before, one.now, one.spread)),
            f"{one.spreads:+.1f}",
        )
        for one in changes
    ]
    return join(
        [
            table(("number", "was", "is", "spread", "spreads"), rows),
            note("Spread: by how much one healthy run differs from the next, as a deviation."),
        ]
    )


def not_tested(diagnosis: Diagnosis) -> Html:
    """Effects that these logs could not have shown: their absence from the answer says nothing."""
    if not diagnosis.not_tested:
        return paragraph(
            "Every effect of the catalogue would have shown in these logs at typical strength."
        )
    names = join(tag("li", plain(name)) for name in diagnosis.not_tested)
    return join(
        [
            paragraph(
                f"{len(diagnosis.not_tested)} effects of typical strength would not have shown in"
                " these logs. That they are not named says nothing about whether the rig has them."
            ),
            tag("ul", names, class_="columns"),
        ]
    )


def _effect(rank: int, effect: Named) -> Html:
    family = f", family {effect.family}" if effect.family != effect.name else ""
    head = tag(
        "h3",
        join(
            [
                f"{rank}. {named_words(effect)} ",
                tag(
                    "span",
                    join(
                        [tag("code", effect.name), f"{family}, block {effect.block}{_ends(effect)}"]
                    ),
                    class_="soft",
                ),
            ]
        ),
    )
    sure = paragraph(
        f"Confidence {percent(effect.confidence)}: {PROBABILITY}. What is named here lowers the"
        " sum of squared errors, each divided by the rms of the noise, by"
        f" {effect.gain:,.0f}."
    )
    parts = [
        head,
        sure,
        *_whose(effect),
        _gone(effect.parameters) if effect.who == "plant_file" else _numbers(effect.parameters),
    ]
    if effect.not_separable_from:
        others = ", ".join(map(plain, effect.not_separable_from))
        parts.append(
            tag(
                "p",
                join(
                    [
                        tag("strong", "Cannot be told apart from "),
                        others,
                        ": these logs fit as well with them.",
                    ]
                ),
                class_="warning",
            )
        )
    if words := by_log_words(effect):
        parts.append(note(words))
    if same := more_numbers_words(effect):
        parts.append(note(f"{same[0].upper()}{same[1:]}."))
    return tag("div", join(parts), class_="effect")


def _ends(effect: Named) -> str:
    ends = [one.name for one in effect.parameters if one.at_end and effect.who != "plant_file"]
    return f"; {' and '.join(ends)} at the end of the range of its law" if ends else ""


def _whose(effect: Named) -> list[Html]:
    if effect.who == "rig":
        return []
    return [
        paragraph(
            "The plant file has this effect and the rig does not: the patched plant file is"
            " without it."
            if effect.who == "plant_file"
            else "The plant file has this effect already, the rig at another strength."
        )
    ]


def _gone(numbers: tuple[Number, ...]) -> Html:
    """Of an effect that the rig does not have: what the plant file says. What shapes it cannot be
    fitted where it is not.
    """
    return table(
        ["Parameter", "Plant file", "Unit"],
        [[one.name, *gone_words(one)[2:]] for one in numbers],
        (0, 2),
        "numbers",
    )


def _numbers(numbers: tuple[Number, ...]) -> Html:
    rows = []
    for one in numbers:
        value, interval, neutral, unit = parameter_words(one)
        rows.append([one.name, value, interval, unit, neutral, _interval(one)])
    return table(
        [
            "Parameter",
            "Value",
            "95 % interval",
            "Unit",
            "Plant file",
            "plant file ┃ and interval ━●━",
        ],
        rows,
        (0, 3, 5),
        "numbers",
    )


def _interval(one: Number) -> Html:
    """The interval on a line that begins or ends at the plant file's value."""
    low, high = min(one.low, one.neutral, one.value), max(one.high, one.neutral, one.value)
    span = high - low
    if not span > 0.0:
        return Html("")

    def at(x: float) -> str:
        return f"{100.0 * (x - low) / span:.1f}%"

    width = f"{100.0 * (one.high - one.low) / span:.1f}%"
    marks = (
        ("neutral", f"left:{at(one.neutral)}"),
        ("range", f"left:{at(one.low)};width:{width}"),
        ("dot", f"left:{at(one.value)}"),
    )
    return tag(
        "span",
        join(tag("i", "", class_=name, style=style) for name, style in marks),
        class_="interval",
    )


def catalogue_note(diagnosis: Diagnosis) -> Html:
    """What was left out of the catalogue by wish."""
    left_out = diagnosis.inputs.get("left_out") or ()
    return (
        folded("Left out of the catalogue", paragraph(", ".join(map(str, left_out))))
        if left_out
        else Html("")
    )
