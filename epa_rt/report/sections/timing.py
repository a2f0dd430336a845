"""Timing: period, overruns, lateness."""

import numpy as np

from epa_rt.report import charts
from epa_rt.report.charts import Figure
from epa_rt.report.markup import Html, join, note, paragraph, table
from epa_rt.report.measures.timing import Timing, timing_of
from epa_rt.report.run import NotShown, Run
from epa_rt.report.sections.section import Section
from epa_rt.report.shown import count, number


def timing(run: Run) -> Section:
    """Quantiles and histogram; a sentence where no cycle had any."""
    found = timing_of(run)
    counted = (
        f"{count(len(run.t_s), 'cycle')} of {run.period_s * 1e3:g} ms,"
        f" {count(found.overruns, 'overrun')}{_late(run)}."
    )
    parts: list[object] = [paragraph(counted)]
    if not found.recorded:
        unpaced = run.facts.get("speed") == "unpaced"
        parts.append(
            paragraph(
                "Unpaced simulation: no timing." if unpaced else "The backend recorded no lateness."
            )
        )
        return Section("timing", "Timing", join(parts))
    rows = [
        (name, *(f"{number(value / 1e3, 4)}" for value in values.values()))
        for name, values in (("Lateness, µs", found.lateness_ns), ("Busy, µs", found.busy_ns))
    ]
    parts += [
        table(("", *found.lateness_ns), rows),
        charts.embed(histogram(found)),
        note(
            "Lateness: how long after its edge a cycle's exchange began. Busy: what the cycle took."
            " A quantile is the smallest value that so great a share of the cycles does not exceed."
        ),
    ]
    return Section("timing", "Timing", join(parts))


def histogram(found: Timing) -> Figure:
    """Cycles by lateness and busy time, both axes logarithmic."""
    edges = [f"{a:g}–{b:g}" for a, b in zip(found.edges_us, found.edges_us[1:], strict=False)]
    last = (
        int(
            max(
                np.flatnonzero(counts).max(initial=0)
                for counts in (found.lateness_counts, found.busy_counts)
            )
        )
        + 1
    )
    data = [
        {
            "type": "bar",
            "x": edges[:last],
            "y": counts[:last].tolist(),
            "name": name,
            "marker": {"color": colour},
        }
        for counts, name, colour in (
            (found.lateness_counts, "lateness", charts.ACCENT),
            (found.busy_counts, "busy", charts.REFERENCE),
        )
    ]
    layout = charts.base_layout(240) | {"barmode": "group", "bargap": 0.15}
    layout["margin"] = {"l": 56, "r": 14, "t": 26, "b": 66}
    layout["xaxis"] = charts.axis(type="category", tickangle=-40)
    layout["yaxis"] = charts.axis(type="log", dtick=1, title={"text": "cycles", "standoff": 4})
    layout["annotations"] = [
        {
            "text": (
                f'<b>cycles by time in µs</b>   <span style="color:{charts.ACCENT}">■'
                f' lateness</span>   <span style="color:{charts.REFERENCE}">■ busy</span>'
            ),
            "xref": "paper",
            "yref": "paper",
            "x": 0,
            "y": 1,
            "xanchor": "left",
            "yanchor": "bottom",
            "showarrow": False,
        }
    ]
    return Figure(
        data, layout, 240, "How many cycles were so late, and how many so long; logarithmic."
    )


def _late(run: Run) -> Html | str:
    try:
        return f" (later than {run.rig.overrun.late * 1e3:g} ms; policy: {run.rig.overrun.policy})"
    except NotShown:
        return ""
