"""What a section of the page is, and what sections share."""

from dataclasses import dataclass

import numpy as np

from epa_rt.report import charts
from epa_rt.report.charts import Line, Panel, timed
from epa_rt.report.markup import Html
from epa_rt.report.run import Run, Span
from epa_rt.report.shown import unit_of

MOST_TRIALS = 9


@dataclass(frozen=True)
class Section:
    """A titled part of the page."""

    key: str
    title: str
    content: Html


def trial_name(span: Span) -> str:
    """'1 (p0=460 kPa gauge)', counted from 1 as a person does; the phase's own name where that says
    more.
    """
    values = ", ".join(f"{key} = {value}" for key, value in span.phase.values.items())
    words = values or ("" if span.phase.key == "trial" else span.phase.key)
    return f"{span.phase.trial_index + 1} ({words})" if words else f"{span.phase.trial_index + 1}"


def is_cut_short(span: Span) -> bool:
    """Whether a phase of fixed length ended before it was over."""
    return (
        span.phase is not None
        and span.phase.cycles is not None
        and span.end - span.begin < span.phase.cycles
    )


def shades(run: Run) -> list[tuple[float, float, str]]:
    """Background of a picture over the run's time: trials in one tint, every second other phase in
    another.
    """
    found = []
    for i, span in enumerate(run.phases):
        colour = charts.TRIAL_SHADE if span.is_trial else charts.PHASE_SHADE if i % 2 else None
        if colour:
            found.append((float(run.t_s[span.begin]), float(run.t_s[span.end - 1]), colour))
    return found


def signal_line(
    run: Run,
    name: str,
    words: str,
    colour: str,
    samples: slice = slice(None),
    most: int = 4000,
    **style,
) -> Line:
    """A signal over the run's time in the page's units."""
    scale = run.shown.scale(unit_of(name))
    return timed(
        run.t_s[samples], scale.of(run.signals[name][samples]), words, colour, most, **style
    )


def has_values(run: Run, name: str | None) -> bool:
    """Whether the log has a signal with at least one number in it."""
    return name is not None and name in run.signals and bool(np.isfinite(run.signals[name]).any())


def glance_panels(run: Run, samples: slice = slice(None), most: int = 4000) -> list[Panel]:
    """The most telling signals: controlled positions with references, forces, pressures with
    targets, current.
    """
    rig, panels = run.rig, []
    for axis in (rig.joint, rig.motor):
        if axis is not None and has_values(run, axis.position):
            panels.append(_with_reference(run, axis.position, samples, most))
    forces = [row.name for row in rig.inputs if row.si_unit == "N" and has_values(run, row.name)]
    panels += [_plain(run, name, samples, most) for name in forces]
    panels += [
        _with_reference(run, muscle.pressure, samples, most)
        for muscle in rig.muscles
        if has_values(run, muscle.pressure)
    ]
    if has_values(run, rig.motor.current):
        panels.append(_plain(run, rig.motor.current, samples, most))
    return panels


def spoken(name: str) -> str:
    """'muscle pressure' of 'muscle_pressure_pa'."""
    unit_parts = {
        "pa",
        "n",
        "nm",
        "rad",
        "m",
        "s",
        "v",
        "a",
        "k",
        "kg",
        "hz",
        "ratio",
        "raw",
        "open",
        "enable",
    }
    parts = name.split("_")
    while (
        len(parts) > 1
        and parts[-1] in unit_parts
        and not (parts[-1] in ("open", "enable") and len(parts) == 2)
    ):
        parts.pop()
    return " ".join(parts)


def _plain(run: Run, name: str, samples: slice, most: int) -> Panel:
    title = spoken(name)
    return Panel(
        title,
        run.shown.scale(unit_of(name)).unit,
        [signal_line(run, name, title, charts.ACCENT, samples, most)],
    )


def _with_reference(run: Run, name: str, samples: slice, most: int) -> Panel:
    reference, lines = f"ref_{name}", []
    if has_values(run, reference) and np.isfinite(run.signals[reference][samples]).any():
        words = "target" if unit_of(name) == "Pa" else "reference"
        lines.append(signal_line(run, reference, words, charts.REFERENCE, samples, most, width=2.4))
    lines.append(signal_line(run, name, "measured", charts.ACCENT, samples, most))
    return Panel(spoken(name), run.shown.scale(unit_of(name)).unit, lines)
