"""What it could be, for people: the posterior over sets of effects as bars."""

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table

from epa_rt.gap.diagnosis import Could, Diagnosis, Posterior
from epa_rt.gap.report.words import percent, plain
from epa_rt.report.markup import Html, join, note, paragraph, table, tag

SHOWN = 6  # sets of effects on a terminal and a page
WIDTH = 20  # characters of a full bar
UNKNOWN = "something that the catalogue lacks"
VIEWS = {"free_run": "in free run", "blocks": "block by block"}


def set_words(effects: Sequence[str]) -> str:
    """'gravity and delay'; what an empty set stands for."""
    if not effects:
        return "no effect: the plant file as refitted"
    names = [plain(name) for name in effects]
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def provenance(posterior: Posterior) -> str:
    """Where the numbers behind the probabilities come from."""
    return (
        f"The numbers behind these probabilities were calibrated on {posterior.calibrated_on}"
        " sealed cases of a simulated rig: on a real one read them as an order."
    )


def answer_words(posterior: Posterior) -> str:
    """The answer of least expected loss, in one sentence."""
    names = " and ".join(f"{plain(name)} ({share:.2f})" for name, share in posterior.names.items())
    others = "; or ".join(set_words(one) for one in posterior.instead)
    match posterior.verdict:
        case "no_gap":
            return "the logs show nothing that the plant file, refitted, lacks."
        case "not_in_catalogue":
            return "something is missing that no law of the catalogue describes."
        case "not_separable":
            sure = [
                name for name in posterior.names if all(name in one for one in posterior.instead)
            ]
            if sure:
                said = " and ".join(f"{plain(name)} ({posterior.names[name]:.2f})" for name in sure)
                return f"{said} is missing; whether {_beside(posterior, sure)} is too is not told."
            return f"these logs do not tell which: {names}; or {others}."
        case "partly_explained":
            return f"{names} is missing, and something besides."
        case _:
            return f"{names} is missing."


def _beside(posterior: Posterior, sure: list[str]) -> str:
    """What some of the probable sets have beside what all have."""
    sets = (tuple(posterior.names), *posterior.instead)
    more = dict.fromkeys(name for one in sets for name in one if name not in sure)
    return " or ".join(plain(name) for name in more)


def show_posterior(posterior: Posterior, out: Console) -> None:
    """Sets of effects with their probability as a bar, and what each leaves of the gap."""
    left = f"Leaves of the gap {VIEWS[posterior.judged_by]}"
    rows = Table("What it could be", "Probability", "", left, box=box.SIMPLE_HEAD, pad_edge=False)
    for words, probability, left_share in _rows(posterior):
        bar = "█" * round(WIDTH * probability)
        rows.add_row(words, f"{probability:.2f}", bar, left_share)
    out.print(rows)
    if posterior.families:
        shown = list(posterior.families.items())[:SHOWN]
        out.print(
            "Probability that it has one of a family: "
            + ", ".join(f"{plain(name)} {share:.2f}" for name, share in shown)
        )
    out.print(f"On these probabilities: {answer_words(posterior)}")
    out.print(provenance(posterior), style="dim")


def posterior_section(diagnosis: Diagnosis) -> Html:
    """The same as a section of the page; nothing where it was not asked for."""
    posterior = diagnosis.posterior
    if posterior is None:
        return Html("")
    rows = [
        [words, _bar(probability), f"{probability:.2f}", left_share]
        for words, probability, left_share in _rows(posterior)
    ]
    families = [
        [plain(name), _bar(share), f"{share:.2f}"]
        for name, share in list(posterior.families.items())[:SHOWN]
    ]
    left = f"Leaves of the gap {VIEWS[posterior.judged_by]}"
    return join(
        [
            table(["Set of effects", "", "Probability", left], rows, (0, 1), "words"),
            paragraph("Probability that the rig has an effect of a family, whatever else it has:"),
            table(["Family", "", "Probability"], families, (0, 1), "words"),
            paragraph(f"On these probabilities: {answer_words(posterior)}"),
            note(
                "Each set is fitted block by block and in free run, and judged on logs that no fit"
                " has seen. No law of the catalogue is a rig's own law: what a set leaves counts"
                " by its logarithm. A set of little probability may still explain part of the"
                " gap. ",
                provenance(posterior),
            ),
        ]
    )


def _rows(posterior: Posterior) -> list[tuple[str, float, str]]:
    """What it could be, its probability and what it leaves, the most probable first."""
    rows = [
        (set_words(one.effects), one.probability, _left(one)) for one in posterior.models[:SHOWN]
    ]
    return sorted([*rows, (UNKNOWN, posterior.unknown, "-")], key=lambda row: -row[1])


def _bar(share: float) -> Html:
    return tag("span", tag("i", "", style=f"left:0;width:{100.0 * share:.1f}%"), class_="bar")


def _left(one: Could) -> str:
    return percent(one.left_share) if one.left_share is not None else "no gap"
