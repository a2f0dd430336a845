"""Force against travel, trial by trial."""

import html

import numpy as np

from epa_rt.report import charts
from epa_rt.report.charts import Figure, Line
from epa_rt.report.downsample import path_stretches
from epa_rt.report.markup import join, note
from epa_rt.report.run import NotShown, Run, Span
from epa_rt.report.sections.section import MOST_TRIALS, Section, spoken, trial_name

STRETCH_S, STRETCHES = 2.0, 8
_CELL_PX, _COLUMNS = 230, 3


def loops(run: Run) -> Section:
    """Raises NotShown where the rig measures no force or the run has no trial."""
    force = next((row.name for row in run.rig.inputs if row.si_unit == "N"), None)
    if force is None:
        raise NotShown("this rig measures no force")
    if not run.trials:
        raise NotShown("no trial began in this run")
    trials = run.trials[:MOST_TRIALS]
    travel_words, travel = _travel(run)
    lines = [_line(run, span, travel, force, i, len(trials)) for i, span in enumerate(trials)]
    parts = [charts.embed(_grid(lines, travel_words, spoken(force)))]
    if len(run.trials) > len(trials):
        parts.append(note(f"The first {len(trials)} of {len(run.trials)} trials are drawn."))
    return Section("loops", "Force against travel", join(parts))


def _travel(run: Run) -> tuple[str, np.ndarray]:
    """What stretches the muscle at the motor, in m: motor travel, less what the joint gives way."""
    rig = run.rig
    travel = run.signals[rig.motor.position]
    if rig.joint is None:
        return "motor travel, mm", travel
    return "stretch in series, mm", travel - rig.joint.lever_arm * run.signals[rig.joint.position]


def _line(run: Run, span: Span, travel: np.ndarray, force: str, i: int, n: int) -> Line:
    x, y = travel[span.samples] * 1e3, run.signals[force][span.samples]
    x, y = path_stretches(x, y, round(STRETCH_S / run.period_s), STRETCHES)
    colour = charts.ORDERED[round(i * (len(charts.ORDERED) - 1) / max(n - 1, 1))]
    return Line(x, y, f"trial {trial_name(span)}", colour, 0.9)


def _grid(lines: list[Line], x_words: str, y_words: str) -> Figure:
    """Small pictures on equal axes, side by side."""
    columns = min(len(lines), _COLUMNS)
    rows = -(-len(lines) // columns)
    height = rows * (_CELL_PX + 70)
    layout = charts.base_layout(height)
    x_range, y_range = (
        _padded(np.concatenate([getattr(line, axis) for line in lines])) for axis in "xy"
    )
    data = []
    for i, line in enumerate(lines):
        suffix, column, row = "" if i == 0 else str(i + 1), i % columns, i // columns
        top = 1 - (row * (_CELL_PX + 70) + 26) / height
        domain = [column / columns + (0.035 if column else 0.0), (column + 1) / columns - 0.005]
        layout[f"xaxis{suffix}"] = charts.axis(
            domain=domain,
            anchor=f"y{suffix}",
            range=x_range,
            matches="x" if i else None,
            title={"text": x_words, "standoff": 3, "font": {"size": 11}},
        )
        layout[f"yaxis{suffix}"] = charts.axis(
            domain=[top - _CELL_PX / height, top],
            anchor=f"x{suffix}",
            range=y_range,
            matches="y" if i else None,
            showticklabels=column == 0,
        )
        layout["annotations"].append(
            {
                "text": f"<b>{html.escape(line.words)}</b>",
                "xref": "paper",
                "yref": "paper",
                "x": domain[0],
                "y": top,
                "xanchor": "left",
                "yanchor": "bottom",
                "showarrow": False,
                "font": {"size": 11},
            }
        )
        data.append(charts.trace(line, suffix, suffix))
    layout["yaxis"]["title"] = {"text": f"{y_words}, N", "standoff": 3}
    against = f"{y_words.capitalize()} against {x_words.rsplit(',', 1)[0]}"
    return Figure(
        data,
        layout,
        height,
        f"{against}, one picture per trial on equal axes. Of trials longer than"
        f" {STRETCHES * STRETCH_S:g} s, {STRETCHES} stretches of {STRETCH_S:g} s, evenly spread,"
        " are drawn.",
    )


def _padded(values: np.ndarray) -> list[float]:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return [0.0, 1.0]
    low, high = float(finite.min()), float(finite.max())
    pad = 0.05 * (high - low) or 1.0
    return [low - pad, high + pad]
