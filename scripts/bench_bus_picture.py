"""The page that bench_bus.py draws: histograms of the loop beside its two references, and the
figures under them.
"""

from pathlib import Path

import numpy as np

from epa_rt.report import charts
from epa_rt.report.charts import Figure
from epa_rt.report.markup import Html, esc, join, note, paragraph, table
from epa_rt.report.page import page
from epa_rt.report.sections.section import Section

_COLOURS = {"epa_rt": charts.ACCENT, "bare pysoem": charts.SECOND, "cyclictest": charts.REFERENCE}
_EDGES_US = 10.0 ** np.linspace(-1, 4.5, 111)
_TITLES = {
    "lateness": "Wake-up lateness",
    "round trip": "Round trip of a frame",
    "cycle time": "Cycle time less 1 ms, either way",
}


def draw(report: dict, found: dict[str, dict[str, np.ndarray]], path: Path) -> None:
    """Writes the page. ``found``: values in us by quantity and by what was measured."""
    sections = [
        Section(name.replace(" ", "_"), _TITLES[name], _section(name, series))
        for name, series in found.items()
    ]
    load = f", beside {report['burn']} processes that burn the processor" if report["burn"] else ""
    head = join(
        [
            Html("<h1>"),
            esc(f"Bus timing, {report['seconds']:g} s at 1 kHz{load}"),
            Html("</h1>"),
            paragraph(_verdict(report)),
            paragraph(
                "Rights: ",
                "; ".join([*report["rights"]["loop"], f"cores {report['rights']['cores']}"]),
                ".",
            ),
        ]
    )
    path.write_text(page("Bus timing", head, sections), encoding="utf-8")


def _verdict(report: dict) -> str:
    counts, words = report["counts"], []
    for key, text in (
        ("lateness_p99_9_over_cyclictest", "wake-up lateness p99.9 over cyclictest's"),
        ("round_trip_median_over_bare", "round trip median over bare pysoem's"),
    ):
        if key in report["ratios"]:
            words.append(f"{text} {report['ratios'][key]:.2f} (bar {report['bar'][key]:g})")
    return (
        f"{'; '.join(words)}. {counts['cycles']} cycles: {counts['lost_samples']} samples lost,"
        f" {counts['duplicated']} duplicated, {counts['overruns_counted']} overruns,"
        f" {'all' if counts['accounted'] else 'NOT all'} accounted for; {counts['edges_missed']}"
        f" edges missed, {counts['bad_cycles']} frames that did not count."
    )


def _section(name: str, series: dict[str, np.ndarray]) -> Html:
    if name == "cycle time":
        series = {who: np.abs(values - 1000.0) for who, values in series.items()}
    series = {who: values for who, values in series.items() if values.size}
    rows = [
        (
            who,
            *(f"{v:.1f}" for v in (*np.percentile(values, (50, 99, 99.9)), values.max())),
            f"{values.size}",
        )
        for who, values in series.items()
    ]
    return join(
        [
            charts.embed(_histogram(series)),
            table(("", "median, µs", "p99, µs", "p99.9, µs", "largest, µs", "cycles"), rows),
            note(
                "Both axes logarithmic; twenty bins to a decade. The first bin holds all below"
                " 0.11 µs."
            ),
        ]
    )


def _histogram(series: dict[str, np.ndarray]) -> Figure:
    data = []
    for who, values in series.items():
        share = (
            np.histogram(np.clip(values, _EDGES_US[0], _EDGES_US[-1]), _EDGES_US)[0] / values.size
        )
        shown = np.where(share > 0, share, np.nan)
        data.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "marker": {"size": 4},
                "line": {"shape": "hvh", "width": 1.6, "color": _COLOURS[who]},
                "name": who,
                "x": [round(float(x), 3) for x in np.sqrt(_EDGES_US[:-1] * _EDGES_US[1:])],
                "y": [None if np.isnan(y) else float(y) for y in shown],
                "connectgaps": False,
            }
        )
    layout = charts.base_layout(300)
    layout["margin"] = {"l": 64, "r": 14, "t": 26, "b": 44}
    layout["xaxis"] = charts.axis(type="log", dtick=1, title={"text": "µs", "standoff": 4})
    layout["yaxis"] = charts.axis(
        type="log", dtick=1, title={"text": "share of cycles", "standoff": 4}
    )
    words = "   ".join(f'<span style="color:{_COLOURS[who]}">■ {who}</span>' for who in series)
    layout["annotations"] = [
        {
            "text": words,
            "xref": "paper",
            "yref": "paper",
            "x": 0,
            "y": 1,
            "xanchor": "left",
            "yanchor": "bottom",
            "showarrow": False,
        }
    ]
    return Figure(data, layout, 300)
