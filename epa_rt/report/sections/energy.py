"""Energy: the integral of the squared current."""

import numpy as np

from epa_rt.report import charts
from epa_rt.report.charts import Line, Panel
from epa_rt.report.markup import Html, join, note, table
from epa_rt.report.measures.energy import TrialEnergy, energy_of_periods, trial_energy
from epa_rt.report.measures.tracking import periods_of
from epa_rt.report.run import NotShown, Run, Span
from epa_rt.report.sections.section import MOST_TRIALS, Section, is_cut_short, trial_name
from epa_rt.report.shown import number, seconds


def energy(run: Run, winding_ohm: float | None) -> Section:
    """``winding_ohm`` turns it into copper loss, where it is known. Raises NotShown where no
    current is measured.
    """
    if not run.trials:
        raise NotShown("no trial began in this run")
    head = ["Trial", "Lasted", "∫ I² dt, A² s", "Mean I², A²", "RMS current, A", "Peak |I|, A"]
    known = winding_ohm is not None
    head += ["Copper loss, J", "Mean copper loss, W"] if known else []
    rows = [_row(run, trial_energy(run, trial), winding_ohm) for trial in run.trials]
    copper = (
        f"Copper loss is that times the winding's {winding_ohm:g} ohm of the plant file (at its"
        " reference temperature)."
        if known
        else "The winding's resistance is not known for this run, so no copper loss is given."
    )
    parts = [
        table(head, rows),
        note(
            "The study's proxy for electrical energy is the integral of the motor current squared"
            f" over time (its equation 9). {copper} It holds neither mechanical work nor the"
            " drive's own losses."
        ),
    ]
    return Section(
        "energy",
        "Energy",
        join([*parts, _over_frequency(run, run.trials[:MOST_TRIALS], winding_ohm)]),
    )


def _row(run: Run, one: TrialEnergy, winding_ohm: float | None) -> list[object]:
    lasted = seconds(run.seconds(one.trial)) + (" (cut short)" if is_cut_short(one.trial) else "")
    values = [one.integral_a2_s, one.mean_a2, np.sqrt(one.mean_a2), one.peak_a]
    values += (
        [] if winding_ohm is None else [one.integral_a2_s * winding_ohm, one.mean_a2 * winding_ohm]
    )
    return [trial_name(one.trial), lasted, *map(number, values)]


def _over_frequency(run: Run, trials: list[Span], winding_ohm: float | None) -> Html:
    per_period, per_second, swept = [], [], False
    for i, span in enumerate(trials):
        periods = periods_of(run, span)
        if periods is None:
            continue
        energies = energy_of_periods(run, periods)
        is_swept = bool(np.ptp(periods.frequency_hz) > 0.05 * periods.frequency_hz.mean())
        swept = swept or is_swept
        x = periods.frequency_hz if is_swept else run.t_s[periods.begins] - run.t_s[span.begin]
        colour, words = charts.SERIES[i % len(charts.SERIES)], f"trial {span.phase.trial_index + 1}"
        mode = "lines+markers" if len(x) < 100 else "lines"
        per_period.append(Line(x, energies, words, colour, mode=mode))
        per_second.append(Line(x, energies * periods.frequency_hz, words, colour, mode=mode))
    if not per_period:
        return Html("")
    panels = [
        Panel("∫ I² dt of each period", "A² s", per_period),
        Panel("mean I² of each period", "A²", per_second),
    ]
    return charts.embed(
        charts.stack(
            panels,
            "frequency of the period, Hz" if swept else "time since the trial began, s",
            caption=(
                "Integral of current squared over each whole period between the fades, and its mean"
                " over the period."
            ),
        )
    )
