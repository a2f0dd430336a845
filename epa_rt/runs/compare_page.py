"""A comparison of two runs as one page: what differs, since when, and how that was judged."""

from __future__ import annotations

import numpy as np

from epa_rt.report import charts
from epa_rt.report.charts import Line, Panel, timed
from epa_rt.report.markup import Html, facts, folded, join, note, paragraph, table, tag, warning
from epa_rt.report.page import page
from epa_rt.report.run import Run
from epa_rt.report.sections.section import Section, spoken
from epa_rt.report.shown import number, seconds
from epa_rt.runs.compare import DRIFT, MISSING, NOISE, Comparison, Difference, Judged
from epa_rt.runs.compare_words import METHOD, ends, run_words, verdict
from epa_rt.runs.noise import block_samples

_MOST_PICTURES = 6
_KINDS = {
    "offset": "apart",
    DRIFT: "drifts, valves shut",
    MISSING: "no value",
    NOISE: "noisier or quieter",
}


def compare_page(found: Comparison) -> str:
    """The page; self-contained."""
    sections = [Section("differs", "What differs", _differences(found))]
    sections.append(Section("pictures", "Side by side", _pictures(found)))
    sections.append(Section("set_up", "What was set up differently", _set_up(found)))
    sections.append(Section("phases", "Phases", _phases(found)))
    sections.append(Section("method", "How it is judged", _method(found)))
    return page(f"{found.a.name} and {found.b.name}", _head(found), sections)


def _head(found: Comparison) -> Html:
    differs = found.is_different
    badge = "▲ different" if differs else "✓ nothing differs"
    kind = "tripped" if differs else "completed"
    parts: list[object] = [
        tag("p", "Comparison of two runs", class_="kicker"),
        tag("h1", join([found.a.name, tag("span", " and ", class_="soft"), found.b.name])),
        tag("p", join([tag("span", badge, class_=f"badge {kind}"), " ", verdict(found)])),
        facts([("Run A", run_words(found.a)), ("Run B", run_words(found.b))]),
    ]
    parts += [warning(sentence) for sentence in ends(found)]
    for name, run in (("A", found.a), ("B", found.b)):
        parts += [warning(f"log {name} is not whole: ", sentence) for sentence in run.missing]
    parts += [warning(sentence) for sentence in found.notes]
    return join(parts)


def _differences(found: Comparison) -> Html:
    if not found.differences:
        return paragraph(verdict(found))
    rows = [
        (
            f"{one.at_s:.1f}",
            spoken(one.signal),
            _KINDS[one.kind],
            one.phase,
            f"{one.since_s:.1f}",
            *_sizes(found.a, one),
        )
        for one in found.differences
    ]
    head = (
        "Since, s of A",
        "Signal",
        "How",
        "Phase",
        "s of phase",
        "Largest B − A",
        "By chance at most",
    )
    return table(head, rows, (1, 2, 3))


def _sizes(run: Run, one: Difference) -> tuple[str, str]:
    if one.kind == MISSING:
        return "–", "–"
    return (
        run.shown.difference(one.largest, one.unit, signed=True),
        run.shown.difference(one.allowed, one.unit),
    )


def _pictures(found: Comparison) -> Html:
    """The signals that differ, the earliest first; where none does, the pressures and forces."""
    names = list(dict.fromkeys(one.signal for one in found.differences))
    judged = {one.signal: one for one in found.judged}
    chosen = [judged[name] for name in names if name in judged][:_MOST_PICTURES]
    if not chosen:
        chosen = [one for one in found.judged if one.unit in ("Pa", "N")][:2] or list(
            found.judged[:1]
        )
    left_out = len(names) - len(chosen)
    more = [note(f"{left_out} more signals differ; the table above names them.")]
    return join([*(_picture(found, one) for one in chosen), *(more if left_out > 0 else [])])


def _picture(found: Comparison, one: Judged) -> Html:
    a, b = found.a, found.b
    scale, difference = a.shown.scale(one.unit), a.shown.difference_scale(one.unit)
    spans = [slice(p.b.begin, min(p.b.end, p.b.begin + p.a.end - p.a.begin)) for p in found.pairs]
    times = [
        a.t_s[p.a.begin] + b.t_s[samples] - b.t_s[p.b.begin]
        for p, samples in zip(found.pairs, spans, strict=True)
    ]
    gap = [np.array([np.nan])]
    b_t, b_y = (
        np.concatenate([part for piece in pieces for part in (piece, *gap)])
        for pieces in (times, [scale.of(b.signals[one.signal][samples]) for samples in spans])
    )
    n = block_samples(a.period_s)
    centres = [
        a.t_s[p.in_a.start] + (np.arange(len(blocks.a)) + 0.5) * n * a.period_s
        for p, blocks in zip(found.pairs, one.blocks, strict=True)
    ]
    t = np.concatenate([part for piece in centres for part in (piece, *gap)])
    d = _joined([blocks.difference for blocks in one.blocks], difference.factor)
    allowed = _joined(list(one.allowed), difference.factor)
    title = spoken(one.signal)
    grey = charts.REFERENCE
    upper = Panel(
        title,
        scale.unit,
        [
            timed(a.t_s, np.asarray(scale.of(a.signals[one.signal])), "A", charts.ACCENT),
            timed(b_t, b_y, "B", charts.SECOND, dash="dot"),
        ],
        150,
    )
    lower = Panel(
        f"{title}, B − A",
        difference.unit,
        [
            Line(t, d, "difference", charts.SECOND, mode="lines+markers"),
            Line(t, allowed, "by chance", grey, dash="dash"),
            Line(t, -allowed, "by chance", grey, dash="dash"),
        ],
        120,
    )
    marks = [
        (x.at_s, x.at_s + 0.1, "rgba(184,86,15,0.35)")
        for x in found.differences
        if x.signal == one.signal
    ]
    caption = (
        f"{title.capitalize()} of both runs, B shifted phase by phase to begin with A's, and their"
        " difference as means; orange bars: where a difference begins."
    )
    return charts.embed(charts.stack([upper, lower], "time of run A, s", marks, caption))


def _joined(pieces: list[np.ndarray], factor: float) -> np.ndarray:
    gap = np.array([np.nan])
    return np.concatenate([part for piece in pieces for part in (piece * factor, gap)])


def _set_up(found: Comparison) -> Html:
    if not found.set_up and not found.asked:
        return paragraph("Nothing: facts and files of both logs are the same.")
    parts: list[Html] = [
        folded(what, tag("pre", "\n".join(lines))) if lines else paragraph(what)
        for what, lines in found.set_up
    ]
    if found.asked:
        rows = [
            (one.signal, one.phase, f"{one.since_s:.1f}", *_sizes(found.a, one))
            for one in found.asked
        ]
        head = ("Reference", "Phase", "Since, s of phase", "Largest B − A", "By chance at most")
        parts.append(table(head, rows, (0, 1)))
    return join(parts)


def _phases(found: Comparison) -> Html:
    rows = [
        (
            pair.name,
            str(pair.trial) if pair.trial else "",
            seconds(found.a.seconds(pair.a)),
            seconds(found.b.seconds(pair.b)),
            "its end" if pair.in_a != pair.a.samples else "all of it",
        )
        for pair in found.pairs
    ]
    return table(("Phase", "Trial", "A lasted", "B lasted", "Compared"), rows, (0, 4))


def _method(found: Comparison) -> Html:
    rows = [
        (
            spoken(one.signal),
            _small(found.a, one.noise, one.unit),
            _small(found.a, one.step, one.unit),
        )
        for one in found.judged
    ]
    return join(
        [
            *(paragraph(sentence) for sentence in METHOD),
            table(("Signal", "Noise of a mean, B − A", "Converter's step"), rows),
        ]
    )


def _small(run: Run, value: float, unit: str) -> str:
    scale = run.shown.difference_scale(unit)
    return f"{number(value * scale.factor, 3)} {scale.unit}"
