"""Tracking: reference against measured."""

import numpy as np

from epa_rt.report import charts
from epa_rt.report.charts import Line, Panel, timed
from epa_rt.report.markup import Html, Marked, folded, join, note, table, tag
from epa_rt.report.measures.tracking import Tracking, error_of, periods_of, tracking_of
from epa_rt.report.run import NotShown, Run, Span
from epa_rt.report.sections.section import MOST_TRIALS, Section, signal_line, spoken, trial_name
from epa_rt.report.shown import number

EXCERPT_S = 4.0


def tracking(run: Run) -> Section:
    """Errors per trial and per phase, pictures, and for oscillations the achieved amplitude."""
    run.require_experiment()
    found = [one for span in run.phases if (one := tracking_of(run, span))]
    if not found:
        raise NotShown("no phase of this run has both a reference and a measured position")
    trials = [one for one in found if one.span.is_trial]
    chosen = trials or found[-1:]
    head = ("", "Signal", "RMS error", "Peak error", "Mean error", "RMS speed error")
    parts = [
        table(
            head,
            [_row(run, one, trial_name(one.span) if trials else one.span.name) for one in chosen],
            (0, 1),
        )
    ]
    parts.append(
        note(
            "Error is measured minus reference of the same cycle. What a cycle's inputs cause"
            " leaves with the next one, so one cycle's motion is part of it."
        )
    )
    parts += [_pictures(run, chosen), _amplitudes(run, [one.span for one in trials])]
    parts.append(
        folded(
            f"All {len(found)} phases with a reference",
            table(head, [_row(run, one, one.span.name) for one in found], (0, 1)),
        )
    )
    return Section("tracking", "Tracking", join(parts))


def _row(run: Run, one: Tracking, name: str) -> list[object]:
    unit, shown = one.coordinate.si_unit, run.shown
    speed = "–" if np.isnan(one.speed_rms) else shown.difference(one.speed_rms, f"{unit}/s")
    peak = f"{shown.difference(one.peak, unit, signed=True)} at {run.t_s[one.peak_at]:.2f} s"
    cells = [
        name,
        spoken(one.coordinate.measured),
        shown.difference(one.rms, unit),
        peak,
        shown.difference(one.bias, unit, signed=True, like=one.rms),
        speed,
    ]
    return Marked("trial", cells) if one.span.is_trial else cells


def _pictures(run: Run, chosen: list[Tracking]) -> Html:
    panels, drawn = [], chosen[:MOST_TRIALS]
    reach: dict[str, float] = {}
    for one in drawn:
        reach[one.coordinate.si_unit] = max(
            reach.get(one.coordinate.si_unit, 0.0), 1.08 * abs(one.peak)
        )
    for one in drawn:
        coordinate, error = error_of(run, one.span)
        scale = run.shown.difference_scale(coordinate.si_unit)
        times = run.t_s[one.span.samples] - run.t_s[one.span.begin]
        words = (
            f"error in trial {trial_name(one.span)}"
            if one.span.is_trial
            else f"error in {one.span.name}"
        )
        highest = scale.of(reach[coordinate.si_unit]) or 1.0
        panels.append(
            Panel(
                words,
                scale.unit,
                [timed(times, scale.of(error), words, charts.ERROR, 3000, width=1.0)],
                80 if len(drawn) > 1 else 120,
                (-highest, highest),
            )
        )
    worst = max(chosen, key=lambda one: abs(one.peak))
    left = (
        f" The first {len(drawn)} of {len(chosen)} are drawn." if len(chosen) > len(drawn) else ""
    )
    errors = charts.stack(
        panels,
        "time since the trial began, s",
        caption=f"Tracking error over each trial, on equal scales.{left}",
    )
    return join([charts.embed(errors), charts.embed(_excerpt(run, worst))])


def _excerpt(run: Run, worst: Tracking) -> charts.Figure:
    half = round(0.5 * EXCERPT_S / run.period_s)
    samples = slice(
        max(worst.peak_at - half, worst.span.begin), min(worst.peak_at + half, worst.span.end)
    )
    coordinate = worst.coordinate
    unit = run.shown.scale(coordinate.si_unit).unit
    lines = [
        signal_line(
            run, coordinate.position_key, "reference", charts.REFERENCE, samples, width=3.0
        ),
        signal_line(run, coordinate.measured, "measured", charts.ACCENT, samples, width=1.4),
    ]
    return charts.stack(
        [Panel(f"{spoken(coordinate.measured)} about the largest error", unit, lines, 190)],
        caption=(
            f"{EXCERPT_S:g} s about the largest error of the trials, at"
            f" {run.t_s[worst.peak_at]:.3f} s of the run."
        ),
    )


def _amplitudes(run: Run, trials: list[Span]) -> Html:
    ratio, lag, rows = [], [], []
    for i, span in enumerate(trials):
        periods = periods_of(run, span)
        if periods is None:
            continue
        colour = charts.SERIES[i % len(charts.SERIES)]
        words = f"trial {span.phase.trial_index + 1}"
        swept = np.ptp(periods.frequency_hz) > 0.05 * periods.frequency_hz.mean()
        x = periods.frequency_hz if swept else run.t_s[periods.begins] - run.t_s[span.begin]
        ratio.append(
            Line(x, periods.ratio, words, colour, mode="lines+markers" if len(x) < 100 else "lines")
        )
        lag.append(
            Line(
                x,
                np.degrees(periods.lag_rad),
                words,
                colour,
                mode="lines+markers" if len(x) < 100 else "lines",
            )
        )
        rows.append(
            (
                trial_name(span),
                len(x),
                *(number(float(f(periods.ratio)), 4) for f in (np.nanmean, np.nanmin, np.nanmax)),
                f"{number(float(np.degrees(np.nanmax(periods.lag_rad))), 3)} deg",
            )
        )
    if not rows:
        return Html("")
    x_title = "frequency of the period, Hz" if swept else "time since the trial began, s"
    panels = [
        Panel("achieved over asked amplitude", "", ratio, levels=[(1.0, "as asked")]),
        Panel("lag", "deg of the period", lag),
    ]
    figure = charts.stack(
        panels,
        x_title,
        caption=(
            "Each whole period between the fades by itself: the measured signal is fitted by the"
            " reference, the reference a quarter of a period earlier and a constant."
        ),
    )
    head = ("Trial", "Periods", "Mean ratio", "Lowest", "Highest", "Largest lag")
    return join([tag("h3", "Achieved amplitude"), table(head, rows), charts.embed(figure)])
