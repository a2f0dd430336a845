"""The gate: what was promised and what came true when the patched plant file was run, on the page
and in a line.
"""

from epa_rt.gap.held_out.gate import PASSES_POINTS
from epa_rt.gap.report.words import channel_words, percent, size
from epa_rt.report.markup import Html, join, note, table, tag

CLOSE, ALL_OF_IT = 1.2, 1.05  # times the floor; share of a gap
_WORDS = {True: ("passed", "good"), False: ("not passed", "bad"), None: ("not judged", "open")}


def gate_section(gate: dict) -> Html:
    """What was promised and what came true when the patched plant file was run."""
    word, kind = _WORDS[gate["passed"]]
    says = (
        f"The patched plant file was loaded from disk and the experiment of {gate['log']} was run"
        f" again in the simulated rig, loop closed. {_came_true(gate)}."
    )
    rows = [
        [
            channel_words(row["channel"]),
            size(row["before"], row["unit"]),
            size(row["after"], row["unit"]),
            size(row["floor"], row["unit"]),
            *_gate_shares(row),
        ]
        for row in gate["channels"]
    ]
    return join(
        [
            tag("p", join([tag("span", word, class_=f"badge {kind}"), says])),
            table(
                ["Channel", "Before", "After", "Floor", "Predicted", "Achieved", "Off by, points"],
                rows,
            ),
            note(
                "Before: the plant file as it stands, run on the same experiment. After: five runs"
                " of the patched plant, each with noise of its own. Floor: what these differ by."
                " Passed where all channels together come within 5 points of what was predicted. At"
                " the floor: neither before nor after is above 1.2 × the floor, so there is no gap"
                " of which a share could be closed. Down to the floor: after lies below the floor,"
                " the whole gap is closed."
            ),
        ]
    )


def gate_line(gate: dict) -> str:
    """The same in one line."""
    if gate["passed"] is None:
        return f"gate not judged: {gate['not_judged']}{_closes(gate)}"
    return (
        f"gate {'passed' if gate['passed'] else 'NOT passed'}: the patched plant, run again, closes"
        f" {percent(gate['achieved_share'])} of the gap{_on(gate)} (predicted"
        f" {percent(gate['predicted_share'])}){missed_words(gate)}"
    )


def gate_words(row: dict) -> str:
    """The share that a channel achieved in the gate; words where the noise decides what the figure
    is.
    """
    if (
        row["achieved_share"] is not None
        and max(row["before"], row["after"]) < CLOSE * row["floor"]
    ):
        return "at the floor"
    if row["achieved_share"] is not None and row["achieved_share"] > ALL_OF_IT:
        return "down to the floor"
    return percent(row["achieved_share"])


def missed_words(gate: dict) -> str:
    """The channels by themselves that came out otherwise than predicted, where the gate judges all
    of them together; '' where none did.
    """
    rows = [
        row
        for row in gate["channels"][1:]
        if row["points"] is not None
        and abs(row["points"]) > PASSES_POINTS
        and gate_words(row) not in ("at the floor", "down to the floor")
    ]
    found = ", ".join(f"{channel_words(row['channel'])} {gate_words(row)}" for row in rows)
    return f"; by themselves otherwise than predicted: {found}" if rows else ""


def measured_over(gate: dict) -> str:
    """Over what the gate's shares are: one trial of a log of several, if that alone was set
    aside.
    """
    if gate["trials"] == gate["of_trials"]:
        return "over all trials of the log"
    return (
        "over the trial set aside"
        if gate["trials"] == 1
        else f"over the {gate['trials']} trials set aside"
    )


def _came_true(gate: dict) -> str:
    if gate["passed"] is None:
        return f"It is not judged: {gate['not_judged']}{_closes(gate)}"
    return (
        f"Predicted {percent(gate['predicted_share'])} of the gap closed{_on(gate)}, achieved"
        f" {percent(gate['achieved_share'])}{missed_words(gate)}"
    )


def _closes(gate: dict) -> str:
    """What was achieved where nothing had been promised."""
    return (
        ""
        if gate["achieved_share"] is None
        else (
            f"; the patched plant, run again, closes {percent(gate['achieved_share'])} of the"
            f" gap{_on(gate)}"
        )
    )


def _on(gate: dict) -> str:
    return "" if gate["trials"] == gate["of_trials"] else f" {measured_over(gate)}"


def _gate_shares(row: dict) -> list[str]:
    """Predicted, achieved and the difference in points; no figure that is the noise's alone."""
    words = gate_words(row)
    return (
        ["–", words, "–"]
        if words == "at the floor"
        else [percent(row["predicted_share"]), words, _points(row["points"])]
    )


def _points(points: float | None) -> str:
    return (
        "–"
        if points is None
        else f"{points:+.1f}".replace("-", "−").replace("−0.0", "0.0").replace("+0.0", "0.0")
    )
