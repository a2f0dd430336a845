"""What it could be, for people: the posterior over sets of effects as bars."""

from rich import box
from rich.console import Console
from rich.table import Table

from epa_rt.gap.diagnosis import Could, Diagnosis, Posterior
from epa_rt.gap.posterior.words import plain, set_words
from epa_rt.gap.report.words import percent
from epa_rt.report.markup import Html, join, note, paragraph, table, tag

SHOWN = 6  # sets of effects on a terminal and a page
WIDTH = 20  # characters of a full bar
UNKNOWN = "something that the catalogue lacks"
VIEWS = {"free_run": "in free run", "blocks": "block by block"}


def provenance(posterior: Posterior) -> str:
    """Where the numbers behind the probabilities come from."""
    return (
        f"The numbers behind these probabilities were calibrated on {posterior.calibrated_on}"
        f" sealed cases of a simulated rig and {posterior.recordings} recordings of others: on a"
        " rig unlike these read them as an order."
    )


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
