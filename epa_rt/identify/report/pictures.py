"""Pictures of an identified muscle, as in the paper's Fig. 4 and beyond: clouds, projections,
traces, loops, terms.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from epa_rt.identify.report.curves import Cloud, Stretch
from epa_rt.identify.selection import Selected
from epa_rt.report.charts import (
    FONT,
    INK,
    REFERENCE,
    SERIES,
    Figure,
    Line,
    Panel,
    array,
    axis,
    base_layout,
    stack,
)

SPEEDS = [
    [0.0, "#3b1f5b"],
    [0.25, "#2c6a8a"],
    [0.5, "#45a86f"],
    [0.75, "#c9ab1c"],
    [1.0, "#b8560f"],
]
LENGTH, PRESSURE, FORCE, SPEED = (
    "length, mm",
    "gauge pressure, kPa",
    "force, N",
    "contraction<br>speed, mm/s",
)
CLOUD_PX, ROW_PX = 470, 250
LOWEST_R2 = 0.85  # what lies below is not worth a closer look
WAYS = (
    ("length_mm", LENGTH, "force_n", FORCE),
    ("gauge_kpa", PRESSURE, "force_n", FORCE),
    ("length_mm", LENGTH, "gauge_kpa", PRESSURE),
)


def _fastest(cloud: Cloud) -> float:
    return float(np.ceil(np.abs(cloud.speed_mm_s).max() / 10.0) * 10.0)


def _marker(cloud: Cloud, size: float, bar: bool) -> dict[str, Any]:
    end = _fastest(cloud)
    return {
        "size": size,
        "color": array(cloud.speed_mm_s),
        "colorscale": SPEEDS,
        "cmin": -end,
        "cmax": end,
        "showscale": bar,
        "line": {"width": 0},
        "colorbar": {
            "title": {"text": SPEED, "side": "top", "font": {"size": 12}},
            "thickness": 12,
            "len": 0.8,
            "tickfont": {"size": 12},
            "outlinewidth": 0,
        },
    }


def space(cloud: Cloud, modelled: bool, caption: str) -> Figure:
    """Force over length and pressure in space, coloured by contraction speed."""
    layout = base_layout(CLOUD_PX) | {"margin": {"l": 0, "r": 0, "t": 0, "b": 0}}

    def side(title: str, values: np.ndarray) -> dict[str, Any]:
        low, high = float(values.min()), float(values.max())
        return {
            "title": {"text": title, "font": {"size": 13}},
            "tickfont": {"size": 11},
            "nticks": 5,
            "gridcolor": "#d8dbe0",
            "zeroline": False,
            "range": [low - 0.03 * (high - low), high + 0.03 * (high - low)],
        }

    both = np.concatenate([cloud.force_n, cloud.model_n])
    layout["scene"] = {
        "xaxis": side(LENGTH, cloud.length_mm),
        "yaxis": side(PRESSURE, cloud.gauge_kpa),
        "zaxis": side(FORCE, both),
        "camera": {
            "eye": {"x": -1.6, "y": -1.8, "z": 0.8},
            "center": {"x": 0.05, "y": 0, "z": -0.1},
        },
        "aspectmode": "cube",
    }
    trace = {
        "type": "scatter3d",
        "mode": "markers",
        "x": array(cloud.length_mm),
        "y": array(cloud.gauge_kpa),
        "z": array(cloud.model_n if modelled else cloud.force_n),
        "marker": _marker(cloud, 1.8, True),
        "hovertemplate": (
            "%{x:.1f} mm, %{y:.0f} kPa<br>%{z:.1f} N at %{marker.color:.0f} mm/s<extra></extra>"
        ),
    }
    return Figure([trace], layout, CLOUD_PX, caption)


def projections(cloud: Cloud, name: str, caption: str) -> Figure:
    """The cloud in its planes: measured on the left, the model on the right."""
    height = len(WAYS) * ROW_PX
    layout, data = base_layout(height), []
    layout["margin"] = {"l": 46, "r": 8, "t": 4, "b": 34}
    high = {
        "force_n": float(max(cloud.force_n.max(), cloud.model_n.max())),
        "gauge_kpa": float(cloud.gauge_kpa.max()),
    }
    for row, (x, x_title, y, y_title) in enumerate(WAYS):
        for column, modelled in enumerate((False, True) if y == "force_n" else (False,)):
            place = "" if not data else str(len(data) + 1)
            top = 1.0 - row / 3.0 - 22.0 / height
            left = 0.54 * column
            values = cloud.model_n if modelled else getattr(cloud, y)
            data.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": array(getattr(cloud, x)),
                    "y": array(values),
                    "xaxis": f"x{place}",
                    "yaxis": f"y{place}",
                    "marker": _marker(cloud, 2.5, not data) | {"opacity": 0.7},
                    "hoverinfo": "skip",
                }
            )
            if len(data) == 1:
                data[0]["marker"]["colorbar"] |= {
                    "x": 0.78,
                    "xanchor": "center",
                    "y": 1.0 / 6.0,
                    "yanchor": "middle",
                    "len": 0.24,
                }
            layout[f"xaxis{place}"] = axis(
                domain=[left, left + 0.46],
                anchor=f"y{place}",
                title={"text": x_title, "standoff": 2},
                nticks=5,
            )
            low = float(min(values.min(), getattr(cloud, y).min()))
            layout[f"yaxis{place}"] = axis(
                domain=[top - (ROW_PX - 66.0) / height, top],
                anchor=f"x{place}",
                nticks=5,
                range=[low - 0.03 * high[y], 1.03 * high[y]],
            )
            words = f"<b>{y_title}</b>, {name if modelled else 'measured'}"
            layout["annotations"].append(
                {
                    "text": words,
                    "xref": "paper",
                    "yref": "paper",
                    "x": left,
                    "y": top,
                    "xanchor": "left",
                    "yanchor": "bottom",
                    "showarrow": False,
                    "font": {"size": 12, "family": FONT, "color": INK},
                }
            )
    return Figure(data, layout, height, caption)


def _colours(stretch: Stretch) -> dict[str, str]:
    return dict(zip(stretch.models, SERIES, strict=False))


def over_time(stretch: Stretch, caption: str) -> Figure:
    """Force of every drawn model beside the measured one, and the length that goes with it."""
    colours = _colours(stretch)
    panels = [
        Panel(
            name,
            "N",
            [
                Line(stretch.time_s, stretch.force_n, "measured", REFERENCE, 2.4),
                Line(stretch.time_s, values, name, colours[name]),
            ],
            130,
        )
        for name, values in stretch.models.items()
    ]
    return stack(
        [
            *panels,
            Panel("length", "mm", [Line(stretch.time_s, stretch.length_mm, "length", INK)], 90),
        ],
        "time in the trial, s",
        caption=caption,
    )


def loops(stretch: Stretch, caption: str) -> Figure:
    """Force against length over a few strokes, a panel per model."""
    colours = _colours(stretch)
    panels = [
        Panel(
            name,
            "N",
            [
                Line(stretch.length_mm, stretch.force_n, "measured", REFERENCE, 2.0),
                Line(stretch.length_mm, values, name, colours[name], 1.4),
            ],
            210,
        )
        for name, values in stretch.models.items()
    ]
    return stack(panels, LENGTH, caption=caption, own_x=True)


def terms(ways: Sequence[Selected], caption: str) -> Figure:
    """R2 and condition over the number of terms on each way."""
    paths = [way for way in ways if len(way.path) > 1 and "BIC" not in way.name]

    def lines(value) -> list[Line]:
        drawn = [
            Line(
                np.array([len(s.terms) for s in way.path], float),
                np.array([value(s) for s in way.path]),
                way.name.partition(":")[0],
                SERIES[i],
                1.6,
                mode="lines+markers",
            )
            for i, way in enumerate(paths)
        ]
        own = [way.path[0] for way in ways if len(way.path) == 1]
        return [
            *drawn,
            *(
                Line(
                    np.array([float(len(s.terms))]),
                    np.array([value(s)]),
                    "eq. 8",
                    INK,
                    mode="markers",
                )
                for s in own
            ),
        ]

    worst = min(step.r2 for way in ways for step in way.path if len(step.terms) >= 5)
    return stack(
        [
            Panel("R2", "", lines(lambda s: s.r2), 240, (max(worst - 0.01, LOWEST_R2), 1.0)),
            Panel("condition", "powers of ten", lines(lambda s: np.log10(s.condition)), 150),
        ],
        "terms",
        caption=caption,
    )
