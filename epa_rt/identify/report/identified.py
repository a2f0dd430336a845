"""What an identification found, first of all: the law, its numbers, and what they leave over."""

from collections.abc import Sequence

import numpy as np

from epa_rt.identify.answer import Answer
from epa_rt.identify.data import Trial
from epa_rt.identify.linear import Scaled
from epa_rt.identify.report.curves import Cloud, cloud, forces
from epa_rt.identify.report.words import coefficients, number
from epa_rt.identify.scores import Score
from epa_rt.report.charts import ACCENT, Figure, Line, Panel, embed, stack
from epa_rt.report.markup import Html, join, note, paragraph, table

RESIDUAL_POINTS = 2400  # of all trials, a picture: more only blackens it


def best(found: Answer) -> Score:
    """The model that misses trials least that it was not fitted to; least at all where none was
    left out.
    """
    return min(found.scores, key=lambda s: s.rms_trial_n if np.isfinite(s.rms_trial_n) else s.rms_n)


def identified(found: Answer) -> Html:
    """The best law in words, its coefficients with intervals and units, and the gas."""
    score = best(found)
    left_out = (
        f", {score.rms_trial_n:.2f} N on trials left out" if np.isfinite(score.rms_trial_n) else ""
    )
    rows = [(*row[:3], row[3] or "1, normalised") for row in coefficients(score)]
    numbers = (
        table(("Coefficient", "Value", "95 % interval", "Unit"), rows, (0, 3))
        if rows
        else paragraph("It has no fitted number: all of it is the plant file's.")
    )
    return join(
        [
            paragraph(
                f"The muscle's force is told best by “{score.name}”: {score.says}. It misses the"
                f" measured force by {score.rms_n:.2f} N RMS{left_out}; R² {score.r2:.4f}."
            ),
            numbers,
            note(f"Normalised: {found.normalisation.said()}."),
            _gas(found),
        ]
    )


def _gas(found: Answer) -> Html:
    gas = found.gas
    if gas is None:
        return Html("")
    return paragraph(
        f"Gas: exponent {gas.polytropic_ratio:.3f}, leak {gas.leak_per_s:.1e} 1/s; they miss the"
        f" pressure by {gas.rms_pa / 1e3:.2f} kPa RMS."
    )


def residuals(found: Answer, trials: Sequence[Trial], data: Sequence[Scaled]) -> Html:
    """Measured force minus that of the best law: over what it depends on, and by trial."""
    name = best(found).name
    few = cloud(found, trials, data, name, RESIDUAL_POINTS)
    rows = [_of_trial(found, name, *pair) for pair in zip(trials, data, strict=True)]
    return join(
        [
            *map(embed, residual_figures(few, name)),
            table(("Trial", "P0, kPa gauge", "Mean, N", "RMS, N", "Largest, N"), rows, (0,)),
            note(
                "Residual: measured force minus modelled. A law that is right leaves noise without"
                " a shape; a bow over length, a step at speed zero or a slope over pressure is"
                " what it lacks."
            ),
        ]
    )


def residual_figures(few: Cloud, name: str) -> list[Figure]:
    """Residuals (N) over length, pressure and speed of contraction."""
    left = few.force_n - few.model_n
    end = float(np.abs(left).max()) * 1.05 or 1.0
    axes = (
        (few.length_mm, "length, mm"),
        (few.gauge_kpa, "gauge pressure, kPa"),
        (few.speed_mm_s, "contraction speed, mm/s"),
    )
    return [
        stack(
            [
                Panel(
                    f"residual of {name}",
                    "N",
                    [Line(x, left, "residual", ACCENT, 1.0, mode="markers")],
                    130,
                    (-end, end),
                    ((0.0, ""),),
                )
            ],
            title,
        )
        for x, title in axes
    ]


def _of_trial(found: Answer, name: str, trial: Trial, data: Scaled) -> list[str]:
    left = trial.force_n - forces(found, name, trial, data)
    return [
        trial.name,
        f"{trial.p0_pa / 1e3:.0f}",
        number(float(left.mean()), 2),
        number(float(np.sqrt(np.mean(left**2))), 2),
        number(float(np.abs(left).max()), 2),
    ]
