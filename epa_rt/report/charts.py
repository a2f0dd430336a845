"""Figures as plotly.js wants them, without importing plotly: stacked panels over one axis, with
direct labels.
"""

import base64
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from epa_rt.report.downsample import MOST_POINTS, envelope
from epa_rt.report.markup import Html

ACCENT, REFERENCE, SECOND, ERROR, INK, RULE = (
    "#1f5fa8",
    "#8a8f98",
    "#b8560f",
    "#7a3b8f",
    "#22262b",
    "#d8dbe0",
)
SERIES = (ACCENT, SECOND, "#2b7a6b", "#7a3b8f", "#8a6d00", "#5b6470")
ORDERED = (
    "#3b1f5b",
    "#35457f",
    "#2c6a8a",
    "#2a8a83",
    "#45a86f",
    "#86bf4e",
    "#c9ab1c",
    "#d08a1a",
    "#b8560f",
)
TRIAL_SHADE, PHASE_SHADE = "rgba(31,95,168,0.10)", "rgba(90,96,106,0.06)"
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"
_TITLE_PX, _GAP_PX, _FOOT_PX = 24, 14, 40


@dataclass(frozen=True)
class Line:
    """One trace: x and y as shown, what it is in words."""

    x: np.ndarray
    y: np.ndarray
    words: str
    colour: str = ACCENT
    width: float = 1.2
    dash: str = "solid"
    mode: str = "lines"


@dataclass(frozen=True)
class Panel:
    """One plot of a stack. ``title`` says what is drawn, ``unit`` stands behind it."""

    title: str
    unit: str
    lines: Sequence[Line]
    height: int = 150
    y_range: tuple[float, float] | None = None
    levels: Sequence[tuple[float, str]] = ()  # dashed horizontal lines with their words
    x_range: tuple[float, float] | None = None


@dataclass
class Figure:
    """Traces and layout, and the height in px that they want."""

    data: list[dict[str, Any]]
    layout: dict[str, Any]
    height: int
    caption: str = field(default="")


def timed(
    times: np.ndarray,
    values: np.ndarray,
    words: str,
    colour: str = ACCENT,
    most: int = MOST_POINTS,
    **style: Any,
) -> Line:
    """A line over time as the envelope of its samples."""
    return Line(*envelope(times, values, most), words, colour, **style)


def array(values: np.ndarray) -> dict[str, str]:
    """Numbers as plotly.js reads them from base64: float32, exact to 7 digits."""
    return {
        "dtype": "f4",
        "bdata": base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode(),
    }


def stack(
    panels: Sequence[Panel],
    x_title: str = "time, s",
    shades: Sequence[tuple[float, float, str]] = (),
    caption: str = "",
    own_x: bool = False,
) -> Figure:
    """Panels above each other. They share the x axis unless ``own_x``; ``shades`` are (from, to,
    colour).
    """
    foot = _FOOT_PX if own_x else 0
    height = (
        sum(panel.height + _TITLE_PX + _GAP_PX + foot for panel in panels)
        - _GAP_PX
        + (0 if own_x else _FOOT_PX)
    )
    layout: dict[str, Any] = base_layout(height)
    data: list[dict[str, Any]] = []
    top = float(height)
    for i, panel in enumerate(panels):
        suffix = "" if i == 0 else str(i + 1)
        x_suffix = suffix if own_x else ""
        domain = [(top - _TITLE_PX - panel.height) / height, (top - _TITLE_PX) / height]
        layout[f"yaxis{suffix}"] = axis(domain=domain, anchor=f"x{x_suffix}")
        if panel.y_range:
            layout[f"yaxis{suffix}"]["range"] = list(panel.y_range)
        layout["annotations"].append(_title(panel, domain[1]))
        data += [trace(line, x_suffix, suffix) for line in panel.lines]
        _levels(layout, panel, x_suffix, suffix)
        if own_x:
            layout[f"xaxis{suffix}"] = axis(
                anchor=f"y{suffix}", title={"text": x_title, "standoff": 4}
            ) | ({"range": list(panel.x_range)} if panel.x_range else {})
        top -= _TITLE_PX + panel.height + _GAP_PX + foot
    if not own_x:
        last = "" if len(panels) == 1 else str(len(panels))
        layout["xaxis"] = axis(anchor=f"y{last}", title={"text": x_title, "standoff": 4})
    lowest = layout[f"yaxis{suffix}"]["domain"][0]
    layout["shapes"] += [
        {
            "type": "rect",
            "xref": "x",
            "yref": "paper",
            "x0": a,
            "x1": b,
            "y0": lowest,
            "y1": 1,
            "fillcolor": colour,
            "line": {"width": 0},
            "layer": "below",
        }
        for a, b, colour in shades
    ]
    return Figure(data, layout, height, caption)


def base_layout(height: int) -> dict[str, Any]:
    return {
        "height": height,
        "margin": {"l": 56, "r": 14, "t": 2, "b": 0},
        "showlegend": False,
        "shapes": [],
        "annotations": [],
        "font": {"family": FONT, "size": 12, "color": INK},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "hovermode": "closest",
        "dragmode": "zoom",
    }


def axis(**more: Any) -> dict[str, Any]:
    return {
        "gridcolor": "#eceef1",
        "zerolinecolor": RULE,
        "linecolor": RULE,
        "tickfont": {"size": 11},
        "automargin": False,
        "hoverformat": ".5~g",
        "exponentformat": "none",
        "ticks": "outside",
        "ticklen": 3,
        "tickcolor": RULE,
        **more,
    }


def embed(figure: Figure) -> Html:
    """The figure as markup for the page's script to draw; no text in it can end the script
    element.
    """
    content = json.dumps({"data": figure.data, "layout": figure.layout}, separators=(",", ":"))
    for sign in "<>&":
        content = content.replace(sign, f"\\u{ord(sign):04x}")
    caption = f"<figcaption>{html.escape(figure.caption)}</figcaption>" if figure.caption else ""
    return Html(
        '<figure><div class="chart" role="img"'
        f' aria-label="{html.escape(figure.caption or "chart")}"'
        f' style="height:{figure.height}px"><script'
        f' type="application/json">{content}</script></div>{caption}</figure>'
    )


def trace(line: Line, x_suffix: str, y_suffix: str) -> dict[str, Any]:
    """One line as plotly.js wants it, on the axes of these suffixes."""
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": line.mode,
        "x": array(line.x),
        "y": array(line.y),
        "name": html.escape(line.words),
        "xaxis": f"x{x_suffix}",
        "yaxis": f"y{y_suffix}",
    }
    if "lines" in line.mode:
        trace["line"] = {
            "color": line.colour,
            "width": line.width,
            "dash": line.dash,
            "simplify": False,
        }
    if "markers" in line.mode:
        trace["marker"] = {"color": line.colour, "size": 5}
    return trace


def _title(panel: Panel, y: float) -> dict[str, Any]:
    names = (
        []
        if len(panel.lines) == 1 and panel.lines[0].words == panel.title
        else [
            f'<span style="color:{colour}">{"┄" if dash else "━"} {html.escape(words)}</span>'
            for words, colour, dash in dict.fromkeys(
                (line.words, line.colour, line.dash != "solid") for line in panel.lines
            )
        ]
    )
    title = f"<b>{html.escape(panel.title)}</b>" if panel.title else ""
    text = "   ".join(
        [", ".join(part for part in (title, html.escape(panel.unit)) if part), *names]
    )
    return {
        "text": text,
        "xref": "paper",
        "yref": "paper",
        "x": 0,
        "y": y,
        "xanchor": "left",
        "yanchor": "bottom",
        "showarrow": False,
        "font": {"size": 12},
        "align": "left",
    }


def _levels(layout: dict[str, Any], panel: Panel, x_suffix: str, y_suffix: str) -> None:
    for value, words in panel.levels:
        layout["shapes"].append(
            {
                "type": "line",
                "xref": f"x{x_suffix} domain",
                "yref": f"y{y_suffix}",
                "x0": 0,
                "x1": 1,
                "y0": value,
                "y1": value,
                "line": {"color": SECOND, "width": 1, "dash": "dash"},
            }
        )
        layout["annotations"].append(
            {
                "text": html.escape(words),
                "xref": f"x{x_suffix} domain",
                "yref": f"y{y_suffix}",
                "x": 0,
                "y": value,
                "xanchor": "left",
                "yanchor": "top" if value < 0.0 else "bottom",
                "showarrow": False,
                "font": {"size": 10, "color": SECOND},
            }
        )
