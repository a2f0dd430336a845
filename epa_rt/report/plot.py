"""Chosen signals over time, stacked by unit."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from epa_rt.config.near_names import nearest
from epa_rt.report import charts
from epa_rt.report.charts import Panel, timed
from epa_rt.report.markup import Html, join, note, tag
from epa_rt.report.page import page
from epa_rt.report.run import NotShown, Run
from epa_rt.report.sections.section import Section, glance_panels, shades
from epa_rt.report.shown import unit_of

_CYCLE = {"lateness_ns": 1e-3, "busy_ns": 1e-3}  # shown in microseconds


def signal_names(run: Run) -> list[str]:
    """Everything that can be plotted, in the log's order."""
    return [*run.signals, *_CYCLE]


def chosen_signals(run: Run, patterns: Sequence[str]) -> list[str]:
    """Names that fit any of the patterns (* and ?). Raises NotShown for a pattern that fits
    none.
    """
    names, chosen = signal_names(run), {}
    for pattern in patterns:
        fits = [name for name in names if fnmatchcase(name, pattern)]
        if not fits:
            meant = nearest(pattern, names)
            guess = f"; did you mean {meant}?" if meant else ""
            raise NotShown(
                f"found no signal '{pattern}', expected one of {', '.join(names)}{guess}"
            )
        chosen.update(dict.fromkeys(fits))
    return list(chosen)


def samples_between(run: Run, begin_s: float | None, end_s: float | None) -> slice:
    """Samples of a stretch in s since the first sample. Raises NotShown where it holds fewer than
    two.
    """
    begin = 0 if begin_s is None else int(np.searchsorted(run.t_s, begin_s))
    end = len(run.t_s) if end_s is None else int(np.searchsorted(run.t_s, end_s, side="right"))
    if end - begin < 2:
        lasts = f"the log's 0 to {run.t_s[-1]:.3f} s" if len(run.t_s) else "a log with samples"
        until = "the end" if end_s is None else f"{end_s:g} s"
        raise NotShown(
            f"found no two samples between {begin_s or 0:g} s and {until}, expected a stretch of"
            f" {lasts}"
        )
    return slice(begin, end)


def plot_page(run: Run, names: Sequence[str], samples: slice) -> str:
    """A page with one picture; without names, of the most telling signals. Raises NotShown where
    these are not known.
    """
    panels = signal_panels(run, names, samples) if names else glance_panels(run, samples)
    begin, end = float(run.t_s[samples][0]), float(run.t_s[samples][-1])
    inside = [
        (max(a, begin), min(b, end), colour)
        for a, b, colour in shades(run)
        if a < end and b > begin
    ]
    caption = (
        "Trials are shaded blue, every second other phase grey. Drag to zoom, double-click to go"
        " back. Long stretches are drawn as the lowest and the highest sample of each bin."
    )
    title = f"{run.facts.get('experiment', run.name)} on {run.facts.get('rig', 'an unnamed rig')}"
    head = join(
        [
            tag("p", f"{run.name}, {begin:.3f} s to {end:.3f} s", class_="kicker"),
            tag("h1", title),
            _cut(run),
        ]
    )
    return page(
        title,
        head,
        [
            Section(
                "signals",
                "Signals",
                charts.embed(charts.stack(panels, shades=inside, caption=caption)),
            )
        ],
    )


def signal_panels(run: Run, names: Sequence[str], samples: slice) -> list[Panel]:
    """One panel for each unit, in the order in which the units appear."""
    units: dict[str, list[str]] = {}
    for name in names:
        units.setdefault(_unit(run, name), []).append(name)
    return [
        Panel("", unit, [_line(run, name, i, samples) for i, name in enumerate(group)], 170)
        for unit, group in units.items()
    ]


def _unit(run: Run, name: str) -> str:
    if name in _CYCLE:
        return "µs"
    return run.shown.scale(unit_of(name)).unit or (
        "0 or 1" if name.endswith(("_open", "_enable")) else "counts"
    )


def _line(run: Run, name: str, i: int, samples: slice) -> charts.Line:
    if name in _CYCLE:
        values = run.cycle[name][samples] * _CYCLE[name]
    else:
        values = run.shown.scale(unit_of(name)).of(run.signals[name][samples])
    n = len(charts.SERIES)
    return timed(
        run.t_s[samples],
        values,
        name,
        charts.SERIES[i % n],
        dash=("solid", "dash", "dot")[i // n % 3],
    )


def _cut(run: Run) -> Html:
    return join(note(f"The log is not whole: {sentence}") for sentence in run.missing)
