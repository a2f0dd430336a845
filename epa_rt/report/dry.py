"""A dry run as rows and as a page: references over time with the rig's limits."""

import math

import numpy as np

from epa_rt.config.experiment import ExperimentFile, PhaseFile
from epa_rt.config.rig import Rig
from epa_rt.experiments.dry import DryPhase, DryRun
from epa_rt.report import charts
from epa_rt.report.charts import Panel, timed
from epa_rt.report.markup import (
    Html,
    Marked,
    facts,
    folded,
    join,
    note,
    paragraph,
    table,
    tag,
    warning,
)
from epa_rt.report.page import page
from epa_rt.report.sections.asked import phase_table
from epa_rt.report.sections.section import Section, spoken
from epa_rt.report.shown import Scale, Shown, number, seconds, shown_for
from epa_rt.report.words import experiment_file, motion_words, valve_words

HEAD = ("phase", "times", "each lasts", "motion", "range", "peak speed", "of limit", "valves")


def dry_rows(dry: DryRun, rig: Rig) -> tuple[tuple[str, ...], list[list[str]]]:
    """Head and one row for each phase of the file, its repetitions taken together."""
    file, shown = (
        experiment_file(dry.experiment.text),
        shown_for(dry.experiment.text, rig.atmosphere_pa),
    )
    by_key: dict[str, list[DryPhase]] = {}
    for phase in dry.phases:
        by_key.setdefault(phase.phase.key, []).append(phase)
    written = {phase.name: phase for phase in _file_phases(file)}
    return HEAD, [_row(shown, written[key], phases) for key, phases in by_key.items()]


def dry_page(dry: DryRun, rig: Rig) -> str:
    """The page: findings first, then the picture, the table, the experiment in words."""
    shown = shown_for(dry.experiment.text, rig.atmosphere_pa)
    head, rows = dry_rows(dry, rig)
    trials = {phase.phase.key for phase in dry.phases if phase.phase.trial_index is not None}
    marked = [Marked("trial", row) if row[0] in trials else row for row in rows]
    name = dry.experiment.name
    top = join(
        [
            tag("p", "Dry run: what would move, and how far", class_="kicker"),
            tag("h1", join([name, tag("span", f" on {rig.name}", class_="soft")])),
            paragraph(dry.experiment.description),
            _verdict(dry),
            facts(
                [
                    ("Duration", f"about {seconds(dry.duration_s)}"),
                    ("Phases", len(dry.phases)),
                    ("Trials", len(dry.experiment.trials)),
                ]
            ),
        ]
    )
    figure = charts.stack(
        dry_panels(dry, rig, shown),
        shades=_shades(dry),
        caption=(
            "References over time; trials are shaded blue. Times are estimates from the first phase"
            " on whose end hangs on the rig (filling, venting). Dashed lines are limits of the rig"
            " where they lie near."
        ),
    )
    content = join(
        [
            charts.embed(figure),
            table(head, marked, (0, 3, 7)),
            note(
                "Of limit: peak speed as a share of the axis' highest speed. Range: the lowest to"
                " the highest reference."
            ),
        ]
    )
    asked = join(
        [
            phase_table(experiment_file(dry.experiment.text)),
            folded("The experiment file", tag("pre", dry.experiment.text)),
        ]
    )
    sections = [
        Section("references", "References", content),
        Section("asked", "What was asked", asked),
    ]
    return page(f"dry run: {name} on {rig.name}", top, sections)


def dry_panels(dry: DryRun, rig: Rig, shown: Shown) -> list[Panel]:
    """Position and speed of each controlled coordinate, then the pressure targets."""
    panels = []
    for key in dict.fromkeys(phase.phase.coordinate.position_key for phase in dry.phases):
        phases = [phase for phase in dry.phases if phase.phase.coordinate.position_key == key]
        coordinate = phases[0].phase.coordinate
        scale, rate = shown.scale(coordinate.si_unit), shown.scale(f"{coordinate.si_unit}/s")
        times, positions, speeds = (
            _joined(phases, name) for name in ("t_s", "positions", "speeds")
        )
        words = spoken(key.removeprefix("ref_"))
        highest = coordinate.speed_max
        panels.append(_panel(words, scale, coordinate.limits, times, positions, 170))
        panels.append(_panel(f"{words}: rate", rate, (-highest, highest), times, speeds, 110))
    return panels + _pressure_panels(dry, rig, shown)


def _panel(
    words: str,
    scale: Scale,
    limits: tuple[float, float],
    times: np.ndarray,
    values: np.ndarray,
    height: int,
) -> Panel:
    if all(math.isfinite(x) for x in limits):
        words += f" (allowed: {number(scale.of(limits[0]), 3)} to {number(scale.of(limits[1]), 3)})"
    return Panel(
        words,
        scale.unit,
        [timed(times, scale.of(values), words)],
        height,
        levels=_near(scale, limits, values),
    )


def _pressure_panels(dry: DryRun, rig: Rig, shown: Shown) -> list[Panel]:
    panels, scale = [], shown.scale("Pa")
    for muscle in rig.muscles:
        times, targets, target = [], [], math.nan
        for phase in dry.phases:
            for order in phase.phase.orders:
                if order.muscle == muscle.name and order.word in ("set", "vent"):
                    target = order.target_pa if order.word == "set" else rig.atmosphere_pa
            times += [phase.start_s, phase.start_s + phase.duration_s]
            targets += [target, target]
        words = f"{muscle.name}: target of the pressure"
        panels.append(
            Panel(
                words,
                scale.unit,
                [charts.Line(np.array(times), scale.of(np.array(targets)), words)],
                110,
                levels=_near(scale, (muscle.pressure_max,), np.array(targets)),
            )
        )
    return panels


def _row(shown: Shown, written: PhaseFile, phases: list[DryPhase]) -> list[str]:
    coordinate = phases[0].phase.coordinate
    shortest, longest = (pick(phase.duration_s for phase in phases) for pick in (min, max))
    lasts = (
        seconds(longest) if longest - shortest < 1e-3 else f"{shortest:.3f} to {seconds(longest)}"
    )
    peak = max(phase.speed_peak for phase in phases)
    scale = shown.scale(coordinate.si_unit)
    low, high = (
        scale.of(min(phase.low for phase in phases)),
        scale.of(max(phase.high for phase in phases)),
    )
    share = f"{peak / coordinate.speed_max:.0%}" if math.isfinite(coordinate.speed_max) else "–"
    about = "about " if any(phase.phase.conditions for phase in phases) else ""
    span = (
        f"{low:.2f} {scale.unit}"
        if high - low < 1e-9
        else f"{low:.2f} to {high:.2f} {scale.unit}".replace("-", "−")
    )
    return [
        written.name,
        f"{len(phases)}",
        f"{about}{lasts}",
        motion_words(written),
        span,
        shown.value(peak, f"{coordinate.si_unit}/s", 3),
        share,
        valve_words(written),
    ]


def _joined(phases: list[DryPhase], name: str) -> np.ndarray:
    """One column of all phases, with a gap where another coordinate is controlled between."""
    parts = []
    for before, phase in zip([None, *phases], phases, strict=False):
        if before is not None and phase.start_s - (before.start_s + before.duration_s) > 1e-6:
            parts.append([phase.start_s] if name == "t_s" else [math.nan])
        parts.append(getattr(phase, name))
    return np.concatenate(parts)


def _near(scale: Scale, limits: tuple[float, ...], values: np.ndarray) -> list[tuple[float, str]]:
    """Limits that a picture can hold without flattening what it shows."""
    finite = values[np.isfinite(values)]
    reach = max(float(np.max(np.abs(finite))) if len(finite) else 0.0, 1e-9)
    near = [scale.of(x) for x in limits if math.isfinite(x) and abs(x) <= 2.5 * reach]
    return [(x, f"limit {x:.4g} {scale.unit}".replace("-", "−")) for x in near]


def _verdict(dry: DryRun) -> Html:
    if not dry.findings:
        return tag(
            "p",
            join(
                [
                    tag("span", "✓ within limits", class_="badge completed"),
                    " The rig can follow every reference.",
                ]
            ),
        )
    badge = tag("span", "▲ findings", class_="badge tripped")
    return join(
        [
            tag("p", join([badge, " The rig cannot follow this."])),
            *(warning(finding) for finding in dry.findings),
        ]
    )


def _shades(dry: DryRun) -> list[tuple[float, float, str]]:
    shaded = []
    for i, phase in enumerate(dry.phases):
        is_trial = phase.phase.trial_index is not None
        if is_trial or i % 2:
            shaded.append(
                (
                    phase.start_s,
                    phase.start_s + phase.duration_s,
                    charts.TRIAL_SHADE if is_trial else charts.PHASE_SHADE,
                )
            )
    return shaded


def _file_phases(file: ExperimentFile) -> tuple[PhaseFile, ...]:
    return file.before + file.phases + file.after
