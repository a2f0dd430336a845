"""The head of the page: what it was, how it ended, and why."""

from dataclasses import replace

import numpy as np

from epa_rt.logs.reader import Event
from epa_rt.logs.run_record import record_of
from epa_rt.report import charts
from epa_rt.report.charts import Panel
from epa_rt.report.markup import Html, facts, join, paragraph, tag, warning
from epa_rt.report.measures.pressures import TOLERANCE_PA, trial_pressures
from epa_rt.report.measures.timing import timing_of
from epa_rt.report.measures.tracking import tracking_of
from epa_rt.report.measures.valves import valve_counts
from epa_rt.report.run import NotShown, Run
from epa_rt.report.sections.section import (
    glance_panels,
    has_values,
    is_cut_short,
    signal_line,
    spoken,
)
from epa_rt.report.shown import count, number, seconds, unit_of

WORDS = {
    "completed": ("✓ completed", "The experiment ran to its end."),
    "stopped": (
        "◼ stopped",
        "The operator, or the rig file's policy on overruns, stopped the run.",
    ),
    "tripped": ("▲ tripped", "The safety envelope stopped the rig."),
    "failed": ("✕ failed", "Bus, recorder or program failed."),
    "died": (
        "✕ died",
        (
            "The program that drove the rig ended without closing the run; the recorder closed the"
            " log."
        ),
    ),
    "unknown": ("? not known", "The log does not say how the run ended."),
}
LAST_S = 1.0


def header(run: Run) -> Html:
    """Title, outcome, cause, and the figures that one looks for first."""
    name = run.facts.get("experiment", "unnamed experiment")
    rig = run.facts.get("rig", "unnamed rig")
    known = run.outcome if run.outcome in WORDS else "unknown"
    parts = [
        tag("p", "Report of one run", class_="kicker"),
        tag("h1", join([name, tag("span", f" on {rig}", class_="soft")])),
        _description(run),
        tag(
            "p",
            join([tag("span", _badge(run, known), class_=f"badge {known}"), " ", WORDS[known][1]]),
        ),
    ]
    if known != "completed" and not (known == "unknown" and run.missing):
        parts.append(_cause_box(run, known))
    parts += [warning("the log is not whole: ", sentence) for sentence in run.missing]
    parts += [paragraph(f"Hint: {event.text}.") for event in run.events if event.kind == "hint"]
    parts += [facts(_facts(run)), facts(_first_figures(run))]
    return join(parts)


def _badge(run: Run, known: str) -> str:
    return WORDS[known][0] if known == run.outcome else f"{WORDS[known][0]}: {run.outcome}"


def _description(run: Run) -> Html:
    try:
        return paragraph(run.experiment.description)
    except NotShown as error:
        return warning(error)


def _facts(run: Run) -> list[tuple[str, str]]:
    told = run.facts
    summary = next((event.data for event in run.events if event.kind == "summary"), {})
    confirmed = summary.get("drive_off_confirmed")
    ends = {  # of logs that do not say how the rig was left
        True: "drive confirmed off",
        False: "drive did NOT confirm that it is off",
    }
    pace = told.get("speed", "")
    backend = {"sim": "simulated"}.get(told.get("backend", ""), told.get("backend", "not recorded"))
    speed = {"": "", "unpaced": ", as fast as it goes"}.get(pace, f", at {pace} × real time")
    return [
        ("Duration", seconds(len(run.t_s) * run.period_s)),
        ("Cycles recorded", f"{len(run.t_s):,} of {run.period_s * 1e3:g} ms"),
        ("Rig", f"{told.get('rig', '–')} ({backend}{speed})"),
        ("Plant", f"{told.get('plant', '–')}, seed {told.get('seed', '–')}"),
        *_who(run),
        ("End state", _end(summary, ends.get(confirmed, "not recorded"))),
    ]


def _who(run: Run) -> list[tuple[str, str]]:
    """Who ran it, when, with which specimens; nothing where the log does not say it."""
    record = record_of(run.attachments)
    if record is None:
        return []
    built = [record.rig_serial, *(f"{name}: {text}" for name, text in record.muscles.items())]
    pairs = [
        ("Run by", ", ".join(filter(None, (record.operator, record.started)))),
        ("Built in", "; ".join(filter(None, built))),
        ("Notes", " ".join(record.notes)),
    ]
    return [(name, text) for name, text in pairs if text]


def _end(summary: dict, otherwise: str) -> str:
    return str(summary.get("end_text", otherwise)).removeprefix("end: ")


def _first_figures(run: Run) -> list[tuple[str, str]]:
    figures = []
    try:
        tracked = [found for span in run.trials if (found := tracking_of(run, span))]
        if tracked:
            worst = max(tracked, key=lambda t: t.rms)
            figures.append(
                (
                    "Tracking in trials, worst RMS",
                    run.shown.difference(worst.rms, worst.coordinate.si_unit),
                )
            )
        pressures = [p for trial in run.trials for p in trial_pressures(run, trial)]
        if pressures:
            worst = max((abs(p.error_pa) for p in pressures), default=float("nan"))
            verdict = "within" if worst <= TOLERANCE_PA else "more than"
            figures.append(
                (
                    "Pressure as set, worst error",
                    f"{run.shown.difference(worst, 'Pa')} ({verdict} {TOLERANCE_PA / 1e3:g} kPa)",
                )
            )
            figures.append(
                (
                    "Valves switched in trials",
                    count(sum(v.in_trials for v in valve_counts(run)), "time"),
                )
            )
        short = sum(is_cut_short(span) for span in run.trials)
        figures.append(
            (
                "Trials",
                (
                    f"{len(run.trials)} of {len(run.experiment.trials)}"
                    f" begun{f', {short} cut short' if short else ''}"
                ),
            )
        )
    except (NotShown, KeyError):
        pass  # the sections below say why
    figures.append(("Late cycles", f"{timing_of(run).overruns:,}"))
    return figures


def _cause_box(run: Run, known: str) -> Html:
    trip = next((event for event in run.events if event.kind in ("trip", "error")), None)
    cause = run.cause or (trip.text if trip else "no cause is recorded")
    parts = [tag("p", cause, class_="cause")]
    if trip is not None:
        at = run.event_s(trip)
        where = next(
            (span.name for span in run.phases if span.begin <= trip.cycle <= span.end), None
        )
        place = f"in the phase {where}" if where else "outside of any phase"
        parts.append(paragraph(f"At {at:.3f} s (cycle {trip.cycle:,}), {place}."))
        parts.append(_before(run, trip))
    return tag("div", join(parts), class_=f"box {known}")


def _before(run: Run, trip: Event) -> Html:
    if not len(run.t_s):
        return paragraph("Signals not shown: no sample is left in the log.")
    end = min(trip.cycle + 1 + round(0.1 / run.period_s), len(run.t_s))
    samples = slice(max(trip.cycle - round(LAST_S / run.period_s), 0), end)
    try:
        panels = _culprit(run, str(trip.data.get("signal", "")), samples) + glance_panels(
            run, samples
        )
    except (NotShown, KeyError) as error:
        return paragraph(f"Signals not shown: {error}.")
    panels = list({panel.title: panel for panel in reversed(panels)}.values())[::-1]
    at = float(run.t_s[min(trip.cycle, len(run.t_s) - 1)])
    after = (at, float(run.t_s[end - 1]), "rgba(184,86,15,0.16)")
    figure = charts.stack(
        [replace(panel, height=105) for panel in panels],
        shades=[after],
        caption="The last second before that; what came after it is shaded.",
    )
    return charts.embed(figure)


def _culprit(run: Run, signal: str, samples: slice) -> list[Panel]:
    if not has_values(run, signal) or not np.isfinite(run.signals[signal][samples]).any():
        return []
    scale = run.shown.scale(unit_of(signal))
    limits = next((row.limits for row in run.rig.signals if row.name == signal), None)
    highest = np.nanmax(np.abs(run.signals[signal][samples]))
    near = [
        (scale.of(x), f"limit {number(scale.of(x))} {scale.unit}")
        for x in limits or ()
        if abs(x) <= 3 * highest
    ]
    line = signal_line(run, signal, "measured", charts.ACCENT, samples, width=1.6)
    return [Panel(spoken(signal), scale.unit, [line], levels=near)]
