"""Pressures: asked, set, at the trial's start, and what became of them."""

import numpy as np

from epa_rt.config.rig import Muscle
from epa_rt.report import charts
from epa_rt.report.charts import Panel, timed
from epa_rt.report.markup import Html, join, note, table, tag
from epa_rt.report.measures.pressures import SETTLED_S, TOLERANCE_PA, TrialPressure, trial_pressures
from epa_rt.report.run import NotShown, Run
from epa_rt.report.sections.section import MOST_TRIALS, Section, trial_name

BEFORE_S, AFTER_S, CLOSE_PA = 8.0, 1.0, 8000.0


def pressures(run: Run) -> Section:
    """Raises NotShown where the rig has no muscle or the run no trial."""
    if not run.rig.muscles:
        raise NotShown("this rig has no muscle")
    if not run.trials:
        raise NotShown("no trial began in this run")
    kind = (
        "gauge: above the rig's atmosphere of"
        if run.shown.gauge
        else "absolute; the rig's atmosphere is"
    )
    parts = [
        note(f"Pressures on this page are {kind} {run.rig.atmosphere_pa / 1e3:g} kPa abs."),
        _table(run),
    ]
    parts.append(
        note(
            f"“As set” is the mean of the {SETTLED_S:g} s (or the time since the last switching,"
            " where shorter) at the end of the last phase that set or trimmed the muscle; “at"
            " start” the same before the trial began, wherever a move had taken the muscle by"
            f" then. Errors above {TOLERANCE_PA / 1e3:g} kPa are marked, at the start only where"
            " the motor had not moved since. Drift is the change over the trial with the motion"
            " taken out (fit on time, position and position squared)."
        )
    )
    parts += [_approach(run, muscle) for muscle in run.rig.muscles]
    return Section("pressures", "Pressures", join(parts))


def _table(run: Run) -> Html:
    unit = run.shown.scale("Pa").unit
    head = (
        "Trial",
        "Muscle",
        f"Target, {unit}",
        f"As set, {unit}",
        "Error, kPa",
        f"P0 at start, {unit}",
        "Error, kPa",
        "Drift, kPa",
        f"In the trial, {unit}",
    )
    return table(
        head,
        [_row(run, one) for trial in run.trials for one in trial_pressures(run, trial)],
        (0, 1),
    )


def _row(run: Run, one: TrialPressure) -> list[object]:
    scale = run.shown.scale("Pa")
    return [
        trial_name(one.trial),
        one.muscle,
        f"{scale.of(one.target_pa):.1f}",
        f"{scale.of(one.when_set_pa):.2f}",
        _error(one.error_pa),
        f"{scale.of(one.start_pa):.2f}",
        _error(one.start_error_pa, one.moved),
        _signed(one.drift_pa),
        f"{scale.of(one.low_pa):.0f} to {scale.of(one.high_pa):.0f}",
    ]


def _error(error_pa: float, moved: bool = False) -> object:
    text = _signed(error_pa)
    return (
        tag("strong", f"▲ {text}", class_="off")
        if abs(error_pa) > TOLERANCE_PA and not moved
        else text
    )


def _signed(pressure_pa: float) -> str:
    return f"{pressure_pa / 1e3:+.2f}".replace("-", "−")


def _approach(run: Run, muscle: Muscle) -> Html:
    """The pressure against its target in the seconds before each trial."""
    panel_lines, trials = [], run.trials[:MOST_TRIALS]
    before, after = round(BEFORE_S / run.period_s), round(AFTER_S / run.period_s)
    for i, trial in enumerate(trials):
        samples = slice(max(trial.begin - before, 0), min(trial.begin + after, trial.end))
        times = run.t_s[samples] - run.t_s[trial.begin]
        error = (
            run.signals[muscle.pressure][samples]
            - run.signals[f"ref_{muscle.pressure}"][trial.begin]
        )
        colour = charts.ORDERED[round(i * (len(charts.ORDERED) - 1) / max(len(trials) - 1, 1))]
        near_kpa = np.where(np.abs(error) < 4 * CLOSE_PA, error, np.nan) / 1e3
        panel_lines.append(timed(times, near_kpa, f"{trial.phase.trial_index + 1}", colour, 1500))
    panel = Panel(
        f"{muscle.name}: pressure minus target",
        "kPa",
        panel_lines,
        170,
        (-CLOSE_PA / 1e3, CLOSE_PA / 1e3),
        [
            (TOLERANCE_PA / 1e3, f"+{TOLERANCE_PA / 1e3:g} kPa"),
            (-TOLERANCE_PA / 1e3, f"−{TOLERANCE_PA / 1e3:g} kPa"),
        ],
    )
    return charts.embed(
        charts.stack(
            [panel],
            "time before and after the trial began, s",
            caption=(
                f"Setting the pressure of the {muscle.name}: the last {BEFORE_S:g} s before each"
                " trial and the first after it."
            ),
        )
    )
