"""Pictures of the serial study, as the paper draws them: traces (Fig. 5), stroke over pressure
(Fig. 6), maps (Figs 7 and 8).
"""

import html
from collections.abc import Sequence
from typing import Any

import numpy as np

from epa_rt.report.charts import (
    ACCENT,
    REFERENCE,
    SECOND,
    SERIES,
    Figure,
    Line,
    Panel,
    axis,
    base_layout,
    stack,
)
from epa_rt.study import servo_loop as loop
from epa_rt.study.serial import Maps

SCALE = [
    [0.0, "#1c1033"],
    [0.12, "#3b1f5b"],
    [0.3, "#35457f"],
    [0.5, "#2a8a83"],
    [0.7, "#86bf4e"],
    [0.85, "#e0c63a"],
    [1.0, "#fbf3c0"],
]


def heat(
    x: np.ndarray,
    y: np.ndarray,
    z: np.ndarray,
    x_title: str,
    y_title: str,
    unit: str,
    caption: str,
    lines: Sequence[tuple[np.ndarray, np.ndarray, str, str]] = (),
    height: int = 400,
    highest: float | None = None,
) -> Figure:
    """A map z (y, x) in colour with lines on it (x, y, words, colour)."""
    layout = base_layout(height)
    layout["margin"] = {"l": 64, "r": 14, "t": 30, "b": 46}
    layout["xaxis"] = axis(title={"text": x_title, "standoff": 4})
    layout["yaxis"] = axis(title={"text": y_title, "standoff": 4})
    data: list[dict[str, Any]] = [
        {
            "type": "heatmap",
            "x": np.round(x, 4).tolist(),
            "y": np.round(y, 4).tolist(),
            "colorscale": SCALE,
            "zsmooth": False,
            "z": [[None if not np.isfinite(v) else round(float(v), 4) for v in row] for row in z],
            "zmin": 0.0,
            "zmax": highest or float(np.nanmax(z)),
            "colorbar": {
                "title": {"text": unit, "side": "right"},
                "thickness": 14,
                "outlinewidth": 0,
            },
            "hoverongaps": False,
        }
    ]
    words = []
    for xs, ys, said, colour in lines:
        data.append(
            {
                "type": "scatter",
                "mode": "lines+markers",
                "x": np.round(xs, 4).tolist(),
                "y": [None if not np.isfinite(v) else round(float(v), 4) for v in ys],
                "line": {"color": colour, "width": 2.5},
                "marker": {"size": 6, "color": colour, "line": {"color": "white", "width": 1}},
            }
        )
        words.append(f'<span style="color:{colour}">● {html.escape(said)}</span>')
    layout["annotations"].append(
        {
            "text": "   ".join(words),
            "xref": "paper",
            "yref": "paper",
            "x": 0,
            "y": 1,
            "xanchor": "left",
            "yanchor": "bottom",
            "showarrow": False,
            "font": {"size": 13},
        }
    )
    return Figure(data, layout, height, caption)


def maps_figure(
    maps: Maps, figure: str, factor: float, unit: str, caption: str, highest: float | None = None
) -> Figure:
    """One map over frequency and pressure, with its valley."""
    asked = maps.asked
    return heat(
        asked.frequency_rad_s,
        asked.pressure_pa / 1e3,
        maps.of[figure].T * factor,
        "frequency, rad/s",
        "no-load pressure, kPa (absolute)",
        unit,
        caption,
        [(asked.frequency_rad_s, maps.best_pressure_pa(figure) / 1e3, "least", "#d1345b")],
        highest=highest,
    )


def traces(found: Sequence[tuple[float, np.ndarray]], caption: str) -> Figure:
    """Wanted and achieved motion, motor travel; two periods per no-load pressure (Pa)."""
    panels = []
    for pressure_pa, rows in found:
        half = rows[: len(rows) // 2]
        t = (half[:, loop.TIME] - half[0, loop.TIME]) * 1e3
        travel = half[:, loop.TRAVEL]
        panels.append(
            Panel(
                f"{pressure_pa / 1e3:.0f} kPa",
                "cm",
                [
                    Line(t, half[:, loop.REFERENCE] * 100, "wanted", REFERENCE, 3.0),
                    Line(t, half[:, loop.PLACE] * 100, "mass", ACCENT, 1.8),
                    Line(t, (travel - travel.mean()) * 100, "motor less its mean", SECOND, 1.8),
                ],
                150,
                (-1.15, 1.15),
            )
        )
    return stack(panels, "time, ms", caption=caption)


def over_pressure(maps: Maps, omega_rad_s: Sequence[float], caption: str) -> Figure:
    """Stroke over no-load pressure at some frequencies, with tension and peak power below."""
    asked = maps.asked
    kpa = asked.pressure_pa / 1e3
    rows = [int(np.argmin(np.abs(asked.frequency_rad_s - w))) for w in omega_rad_s]

    def lines(figure: str, factor: float) -> list[Line]:
        return [
            Line(
                kpa,
                maps.of[figure][row] * factor,
                f"{asked.frequency_rad_s[row]:.0f} rad/s",
                SERIES[i % len(SERIES)],
                2.0,
                mode="lines+markers",
            )
            for i, row in enumerate(rows)
        ]

    wanted = 2.0 * asked.amplitude_m * 100.0
    return stack(
        [
            Panel(
                "motor's stroke",
                "cm",
                lines("stroke_m", 100.0),
                190,
                (0.0, wanted * 1.05),
                [(wanted, "the mass")],
            ),
            Panel("peak of |F v| at the spool", "W", lines("peak_power_w", 1.0), 150),
            Panel("highest tension", "N", lines("tension_high_n", 1.0), 110),
        ],
        "no-load pressure, kPa (absolute)",
        caption=caption,
    )


def rules(maps: Maps, caption: str) -> Figure:
    """Best pressure over frequency, and what it takes there."""
    omega = maps.asked.frequency_rad_s
    wanted = 2.0 * maps.asked.amplitude_m
    goals = (
        ("stroke_m", "least stroke", ACCENT, 4.0, "solid"),
        ("peak_power_w", "least peak power", SECOND, 2.0, "dash"),
    )
    best = [
        Line(omega, maps.best_pressure_pa(f) / 1e3, words, colour, width, dash)
        for f, words, colour, width, dash in goals
    ]
    taken = [
        Line(omega, 100.0 * maps.at_best(f, "stroke_m") / wanted, words, colour, width, dash)
        for f, words, colour, width, dash in goals
    ]
    return stack(
        [
            Panel("best no-load pressure", "kPa (absolute)", best, 170),
            Panel(
                "motor's stroke there",
                "% of the mass motion",
                taken,
                150,
                (0.0, 100.0),
                [(15.0, "15 %")],
            ),
        ],
        "frequency, rad/s",
        caption=caption,
    )
