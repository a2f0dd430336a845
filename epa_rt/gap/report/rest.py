"""What is left, what to do next, and what the answer stands on."""

from epa_rt.gap.diagnosis import Diagnosis, Remainder
from epa_rt.gap.report.left_words import explained_words, goes_with
from epa_rt.gap.report.words import (
    alike_words,
    channel_words,
    onset_words,
    percent,
    plain,
    region_words,
    size,
    times,
)
from epa_rt.report.markup import Html, facts, folded, join, note, paragraph, table, tag


def remainder(diagnosis: Diagnosis) -> Html:
    """By link: how much is left, and which measured states it goes with; what begins in a log."""
    begins = paragraph(words) if (words := onset_words(diagnosis.onset)) else Html("")
    if not diagnosis.remainder:
        nothing = "Nothing is left that could be described: every link is at its floor."
        return join([begins, paragraph(nothing)])
    return join(
        [
            begins,
            note(
                "Described by data alone, without any law: which measured states, rates and"
                " memories the rest goes with, judged on stretches of the logs that the description"
                " has not seen."
            ),
            *map(_one, diagnosis.remainder),
        ]
    )


def next_experiment(diagnosis: Diagnosis) -> Html:
    """The experiment that would decide, or come nearest to it, with the file to run."""
    plan = diagnosis.next_experiment
    if plan is None and diagnosis.verdict == "not_separable":
        return paragraph(
            "Not looked for, or none of the menu can be run on this rig: epa gap plan looks for it."
        )
    if plan is None and (alike := alike_words(diagnosis)):
        return paragraph(
            "None was looked for, since laws of one family are one answer. An experiment that"
            f" tells {alike}: epa gap plan looks for it (this house's rigs and servos)."
        )
    if plan is None:
        return paragraph(
            "None is needed: nothing stands that another experiment would have to tell apart."
        )
    between = " and ".join(map(plain, plan.separates)) or "what is open"
    settings = facts((plain(key), value) for key, value in plan.settings.items())
    return join(
        [
            paragraph(
                tag("strong", plain(plan.name)),
                f" {'tells' if plan.tells else 'comes nearest to telling'} apart {between}."
                f" {plan.says}.",
            ),
            settings,
            folded(
                "The experiment file (epa run drives this house's rigs with it; of others it is the"
                " commanded profile)",
                tag("pre", plan.file),
            ),
        ]
    )


def inputs(diagnosis: Diagnosis) -> Html:
    """Rig, plant, logs, held-out logs: what was read."""
    rows = [
        [plain(key), _written(value)]
        for key, value in diagnosis.inputs.items()
        if not isinstance(value, dict)
    ]
    rows.append(["seconds", f"{diagnosis.seconds:.1f}"])
    return table(["", "Read"], rows, (0, 1), "words")


def found_first(diagnosis: Diagnosis) -> Html:
    """What is wrong with the logs, before anything else."""
    if not diagnosis.found_first:
        return Html("")
    sentences = [tag("li", sentence) for sentence in diagnosis.found_first]
    rest = (
        folded(f"{len(sentences) - 6} more", tag("ul", join(sentences[6:])))
        if len(sentences) > 6
        else ""
    )
    return tag(
        "div",
        join(
            [
                tag("strong", "Found in the logs first, before any effect:"),
                tag("ul", join(sentences[:6])),
                rest,
            ]
        ),
        class_="warning",
    )


def _one(left: Remainder) -> Html:
    above = (
        f"{size(left.rms, left.unit)} rms is left,"
        f" {times(left.rms / left.floor) if left.floor else '–'} the floor of"
        f" {size(left.floor, left.unit)}. "
    )
    rows = join(_bar(name, part) for name, part in goes_with(left))
    return tag(
        "div",
        join(
            [
                tag("h3", join([f"{left.link}: {channel_words(left.channel)}"])),
                paragraph(above, explained_words(left)),
                tag("div", rows, class_="bars depends"),
            ]
        ),
        class_="effect",
    )


def _bar(name: str, part: float) -> Html:
    width = f"width:{100.0 * min(max(part, 0.0), 1.0):.1f}%"
    return tag(
        "div",
        join(
            [
                tag("span", region_words(name), class_="name"),
                tag(
                    "span",
                    tag("span", tag("i", "", class_="after", style=width), class_="track"),
                    class_="pair",
                ),
                tag("span", percent(part), class_="says"),
            ]
        ),
        class_="row",
    )


def _written(value: object) -> str:
    return ", ".join(map(str, value)) or "none" if isinstance(value, list | tuple) else str(value)
