"""How far: bars of before, after and floor for every channel, the shares with their intervals, and the gate."""

from collections.abc import Sequence

from epa_rt.gap.diagnosis import Diagnosis, Shrinkage
from epa_rt.gap.report.words import BASELINES, MODES, SOURCES, channel_words, gate_words, judged_on, missed_words, percent, share_words, shown_rows, size, times
from epa_rt.report.markup import Html, folded, join, note, paragraph, table, tag

_HEADS = {"teacher_forced": "Block by block, each fed with what was measured", "free_run": "The whole plant in free run, fed with the commands only"}


def how_far(diagnosis: Diagnosis) -> Html:
    """Bars over all logs against the refitted nominal plant; every row in a table that opens."""
    rows = diagnosis.shrinkage
    if not rows:
        return paragraph("Not shown: no shrinkage was measured.")
    parts = [note(f"Measured on {judged_on(diagnosis)}. ", _key(), " The share closed is 1 − (after² − floor²)/(before² − floor²), never clipped: "
                  "below zero the patch makes it worse. Its 95 % interval stands in brackets. Before: ", BASELINES["refitted" if diagnosis.effects else "plant_file"], "; after: ",
                  "with the effects." if diagnosis.effects else "nominal parameters refitted (no effect is named).")]
    for mode, head in _HEADS.items():
        chosen = [row for row in shown_rows(diagnosis) if row.mode == mode]
        if chosen:
            source = chosen[0].floor_source
            parts += [tag("h3", head), tag("div", join(map(_bars, chosen)), class_="bars"), note(f"Floor from {SOURCES.get(source, source)}.")]
    parts.append(folded(f"All {len(rows)} figures, also against the plant file as it stands and log by log", _table(rows)))
    return join(parts)


def gate_section(gate: dict) -> Html:
    """What was promised and what came true when the patched plant file was run."""
    word = "passed" if gate["passed"] else "not passed"
    says = (f"The patched plant file was loaded from disk and the experiment of {gate['log']} was run again in the simulated rig, loop closed. "
            f"Predicted {percent(gate['predicted_share'])} of the gap closed, achieved {percent(gate['achieved_share'])}{missed_words(gate)}.")
    rows = [[channel_words(row["channel"]), size(row["before"], row["unit"]), size(row["after"], row["unit"]), size(row["floor"], row["unit"]),
             *_gate_shares(row)] for row in gate["channels"]]
    return join([tag("p", join([tag("span", word, class_=f"badge {'good' if gate['passed'] else 'bad'}"), says])),
                 table(["Channel", "Before", "After", "Floor", "Predicted", "Achieved", "Off by, points"], rows),
                 note("Before: the plant file as it stands, run on the same experiment. After: five runs of the patched plant, each with noise of its own. Floor: what these differ by. "
                      "Passed where all channels together come within 5 points of what was predicted. At the floor: neither before nor after is above 1.2 × the floor, "
                      "so there is no gap of which a share could be closed. Down to the floor: after lies below the floor, the whole gap is closed.")])


def _gate_shares(row: dict) -> list[str]:
    """Predicted, achieved and the difference in points; no figure that is the noise's alone."""
    words = gate_words(row)
    return ["–", words, "–"] if words == "at the floor" else [percent(row["predicted_share"]), words, _points(row["points"])]


def _points(points: float | None) -> str:
    return "–" if points is None else f"{points:+.1f}".replace("-", "−").replace("−0.0", "0.0").replace("+0.0", "0.0")


def _key() -> Html:
    return join((tag("span", words, class_=f"swatch {words.split()[-1]}") for words in ("before", "after", "noise floor")), " ")


def _bars(row: Shrinkage) -> Html:
    longest = max(row.before, row.after, row.floor) or 1.0

    def bar(value: float, kind: str) -> Html:
        beyond = 100.0 * max(row.floor - value, 0.0) / longest  # the number stands right of the floor's line, not across it
        return tag("span", join([tag("i", "", class_=kind, style=f"width:{100.0 * value / longest:.2f}%"),
                                 tag("em", size(value, row.unit), style=f"margin-left:calc(.45em + {beyond:.2f}%)")]), class_="track")

    floor = tag("i", "", class_="floor", style=f"--at:{row.floor / longest:.4f}")
    words = join([tag("strong", share_words(row)), "" if row.closed_share is None else " closed", tag("span", f"{times(row.times_floor)} floor left", class_="soft")])
    pair = join([bar(row.before, "before"), bar(row.after, "after"), floor])
    parts = ((channel_words(row.channel), "name"), (pair, "pair"), (words, "says"))
    return tag("div", join(tag("span", content, class_=name) for content, name in parts), class_="row")


def _table(rows: Sequence[Shrinkage]) -> Html:
    lines = [[channel_words(row.channel), MODES[row.mode], row.log, BASELINES[row.baseline], size(row.before, row.unit), size(row.after, row.unit),
              size(row.floor, row.unit), share_words(row), times(row.times_floor)] for row in rows]
    return table(["Channel", "Mode", "Log", "Before is", "Before", "After", "Floor", "Share closed", "Floor left"], lines, (0, 1, 2, 3))
