"""What happened: states and phases over time, and the run at a glance."""

import html

from epa_rt.report import charts
from epa_rt.report.charts import Figure
from epa_rt.report.markup import Marked, folded, join, note, table
from epa_rt.report.run import NotShown, Run, Span
from epa_rt.report.sections.section import Section, glance_panels, shades
from epa_rt.report.shown import seconds

_TINTS = ("#c9d3df", "#dfe4ea", "#b9c6d3", "#d3dae2", "#c2ccd8", "#e6e9ee")
_NARROW_PX, _LETTER_PX = 600, 7  # a name is written where it fits on a narrow page


def happened(run: Run) -> Section:
    """Timeline, glance, table of phases."""
    parts = [charts.embed(timeline(run))]
    try:
        parts.append(
            charts.embed(
                charts.stack(
                    glance_panels(run),
                    shades=shades(run),
                    caption=(
                        "The run at a glance; trials are shaded blue. Drag to zoom, double-click to"
                        " go back. Long stretches are drawn as the lowest and the highest sample of"
                        " each bin, so that spikes stay; a band means that the signal moved within"
                        " a bin."
                    ),
                )
            )
        )
    except (NotShown, KeyError) as error:
        parts.append(note(f"Signals not shown: {error}."))
    rows = [_row(run, span) for span in run.phases]
    parts.append(
        folded(
            f"All {len(rows)} phases as they were run", table(("Phase", "Began, s", "Lasted"), rows)
        )
    )
    return Section("happened", "What happened", join(parts))


def timeline(run: Run) -> Figure:
    """Two rows of bars: the supervisor's states, the experiment's phases."""
    keys = list(dict.fromkeys(_key(span) for span in run.phases))
    colours = [
        charts.ACCENT if span.is_trial else _TINTS[keys.index(_key(span)) % len(_TINTS)]
        for span in run.phases
    ]
    data = [
        _bars(
            run,
            run.states,
            "state",
            [_TINTS[i % 2] for i in range(len(run.states))],
            [span.name for span in run.states],
        ),
        _bars(run, run.phases, "phase", colours, [_key(span) for span in run.phases]),
    ]
    layout = charts.base_layout(140) | {"barmode": "overlay", "bargap": 0.25}
    layout["margin"] = {"l": 56, "r": 14, "t": 4, "b": 40}
    layout["xaxis"] = charts.axis(
        range=[0.0, len(run.t_s) * run.period_s], title={"text": "time, s", "standoff": 4}
    )
    layout["yaxis"] = charts.axis(autorange="reversed", ticks="")
    return Figure(
        data,
        layout,
        140,
        "States of the supervisor and phases of the experiment over time; trials in blue. "
        "Names stand where they fit; point at a bar for the others.",
    )


def _bars(run: Run, spans: list[Span], row: str, colours: list[str], words: list[str]) -> dict:
    begins = [float(run.t_s[span.begin]) for span in spans]
    lengths = [run.seconds(span) for span in spans]
    room_s = len(run.t_s) * run.period_s / _NARROW_PX * _LETTER_PX
    words = [
        word if length > room_s * (len(word) + 1) else ""
        for word, length in zip(words, lengths, strict=False)
    ]
    hover = [
        f"{html.escape(span.name)}<br>{begin:.3f} s, for {seconds(length)}"
        for span, begin, length in zip(spans, begins, lengths, strict=True)
    ]
    return {
        "type": "bar",
        "orientation": "h",
        "base": begins,
        "x": lengths,
        "y": [row] * len(spans),
        "text": [html.escape(word) for word in words],
        "textposition": "inside",
        "insidetextanchor": "middle",
        "textangle": 0,
        "constraintext": "none",
        "hovertext": hover,
        "hoverinfo": "text",
        "marker": {"color": colours, "line": {"color": "white", "width": 0.5}},
        "insidetextfont": {
            "color": ["white" if colour == charts.ACCENT else charts.INK for colour in colours]
        },
    }


def _key(span: Span) -> str:
    if span.phase is None:
        return span.name
    return span.phase.key + (f" {span.phase.trial_index + 1}" if span.is_trial else "")


def _row(run: Run, span: Span) -> list[object]:
    cells = [span.name, f"{run.t_s[span.begin]:.3f}", seconds(run.seconds(span))]
    return Marked("trial", cells) if span.is_trial else cells
