"""Where a gap comes from that no effect explains, for people."""

from collections.abc import Sequence

from epa_rt.gap.diagnosis import Diagnosis, Origin, likely
from epa_rt.gap.report.words import percent
from epa_rt.report.markup import Html, join, note, paragraph, table, tag

SHOWN, WORTH = 4, 0.05  # places, and share that one must explain to be shown


def origin_words(found: Sequence[Origin]) -> str:
    """One sentence; empty where no places were asked."""
    if not found:
        return ""
    alike = likely(found)
    if not alike:
        return (
            "No place of the rig explains this gap by an error of its own: what it comes from"
            " cannot be told."
        )
    words = " or ".join(f"{one.says} ({percent(min(one.explained_share, 1.0))})" for one in alike)
    return (
        f"It may come from {words}: so much of what all blocks show would an error there explain,"
        " whatever its law."
    )


def origins(diagnosis: Diagnosis) -> Html:
    """The sentence, and what the places after it would explain; nothing where an effect is
    named.
    """
    if not diagnosis.origins:
        return Html("")
    shown = [
        one for i, one in enumerate(diagnosis.origins) if i == 0 or one.explained_share > WORTH
    ][:SHOWN]
    return join(
        [
            tag("h3", "Where it comes from"),
            paragraph(origin_words(diagnosis.origins)),
            table(
                ["Place", "Block", "Explains", "Behind the first"],
                [_row(one, i) for i, one in enumerate(shown)],
                (0, 1),
                "words",
            ),
            note(
                "Each place in turn is given an error that hangs on what is measured there in any"
                " way, with no law; nominal parameters are fitted with it. What it explains is"
                " judged on trials that its fit has not seen. Places less than two standard"
                " deviations behind the first, or by less than places explain of a rig without a"
                " gap, cannot be told from it."
            ),
        ]
    )


def _row(one: Origin, i: int) -> list[str]:
    return [
        one.says,
        one.block,
        percent(min(one.explained_share, 1.0)),
        f"{one.behind:.1f} \u03c3" if i else "\u2013",
    ]
