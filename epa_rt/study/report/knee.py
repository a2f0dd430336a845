"""The knee study's figures and page."""

import numpy as np

from epa_rt.report.charts import ACCENT, SECOND, SERIES, Figure, Line, Panel, stack
from epa_rt.report.markup import join, note, table
from epa_rt.report.sections.section import Section
from epa_rt.study.claims import Claim
from epa_rt.study.knee import NONE
from epa_rt.study.knee_study import Catalogue, Conditions
from epa_rt.study.report.page import study_page
from epa_rt.study.report.pictures import heat

SHOWN_HZ = (0.5, 1.0, 1.5, 2.0)


def kpa(pressure_pa: float) -> str:
    return "none" if pressure_pa == NONE else f"{pressure_pa / 1e3:.0f} kPa"


def saved_figure(found: Conditions) -> Figure:
    """Saved energy over frequency, one panel per serial pressure (Fig. 9)."""
    asked = found.asked
    curves = {
        (s, p): found.saved(s, p)
        for s in map(float, asked.spam_pa)
        for p in map(float, asked.ppam_pa)
    }
    low = min(0.0, *(100.0 * ratio.min() - 5.0 for _, ratio in curves.values()))
    return stack(
        [
            Panel(
                f"SPAM {kpa(s)}",
                "% saved",
                [
                    Line(
                        curves[s, p][0],
                        100.0 * curves[s, p][1],
                        f"PPAM {kpa(p)}",
                        (ACCENT, SECOND, SERIES[2])[i % 3],
                        2.2,
                    )
                    for i, p in enumerate(map(float, asked.ppam_pa))
                ],
                150,
                (low, 100.0),
            )
            for s in map(float, asked.spam_pa)
        ],
        "frequency, Hz",
        caption=(
            "Energy saved over that without parallel muscle; positive is saved (Fig. 9, through the"
            " loop)."
        ),
    )


def swing_figure(found: Conditions) -> Figure:
    """Achieved swing over frequency: how much of a saving is less motion."""
    asked = found.asked
    return stack(
        [
            Panel(
                f"SPAM {kpa(s)}",
                "% of the wanted swing",
                [
                    Line(
                        found.swing(s, p)[0],
                        100.0 * found.swing(s, p)[1],
                        f"PPAM {kpa(p)}",
                        ("#8a8f98", ACCENT, SECOND)[i % 3],
                        2.0,
                    )
                    for i, p in enumerate((NONE, *map(float, asked.ppam_pa)))
                ],
                120,
                (60.0, 130.0),
            )
            for s in map(float, asked.spam_pa)
        ],
        "frequency, Hz",
        caption="Achieved swing of the knee, beside the energy.",
    )


def catalogue_figures(found: Catalogue) -> dict[str, Figure]:
    """Maps of mean I^2 over both pressures at some frequencies, and best against fixed."""
    asked = found.asked
    hz = asked.catalogue_rad_s / (2.0 * np.pi)
    effort = np.where(np.isfinite(found.effort()), found.effort(), np.nan)
    highest = float(
        np.nanmax(effort[:, :, 0])
    )  # what the least support takes: dearer settings need no telling apart
    best, (spam, ppam, fixed) = found.best(), found.fixed()
    figures = {}
    for wanted in SHOWN_HZ:
        k = int(np.argmin(np.abs(hz - wanted)))
        figures[f"knee_catalogue_{str(wanted).replace('.', '_')}_hz"] = heat(
            asked.catalogue_ppam_pa / 1e3,
            asked.catalogue_spam_pa / 1e3,
            effort[k],
            "parallel pressure, kPa (absolute)",
            "serial pressure, kPa (absolute)",
            "A²",
            f"Mean of I² at {hz[k]:.2g} Hz over both pressures; white: the knee does not follow.",
            [
                (
                    np.array([best[k][1] / 1e3]),
                    np.array([best[k][0] / 1e3]),
                    "best here",
                    "#d1345b",
                ),
                (np.array([ppam / 1e3]), np.array([spam / 1e3]), "best fixed", "#1f5fa8"),
            ],
            330,
            highest,
        )
    figures["knee_catalogue_best"] = stack(
        [
            Panel(
                "best pressures",
                "kPa (absolute)",
                [
                    Line(
                        hz,
                        np.array([b[0] for b in best]) / 1e3,
                        "serial",
                        ACCENT,
                        2.0,
                        mode="lines+markers",
                    ),
                    Line(
                        hz,
                        np.array([b[1] for b in best]) / 1e3,
                        "parallel",
                        SECOND,
                        2.0,
                        mode="lines+markers",
                    ),
                ],
                170,
            ),
            Panel(
                "mean of I²",
                "A²",
                [
                    Line(
                        hz,
                        np.array([b[2] for b in best]),
                        "switched at each frequency",
                        ACCENT,
                        2.2,
                        mode="lines+markers",
                    ),
                    Line(hz, fixed, f"fixed at {kpa(spam)} and {kpa(ppam)}", SECOND, 2.0, "dash"),
                ],
                150,
            ),
        ],
        "frequency, Hz",
        caption="The catalogue's optimum over frequency, against one fixed setting.",
    )
    return figures


def knee_page(
    found: Conditions, catalogue: Catalogue, claims: list[Claim], figures: dict[str, Figure]
) -> str:
    asked = found.asked
    lead = [
        (
            f"The knee follows {np.degrees(asked.peak_to_peak_rad):g}° peak to peak of a chirp from"
            f" {asked.from_hz:g} to {asked.to_hz:g} Hz in {asked.seconds:g} s, through the loop on"
            " the simulated rig (quantised, with noise, the drive's limits, the rig's own PID)."
            " Pressures are absolute, at the muscle's no-load place. E is the integral of the"
            " measured I² over one period (eq. 9)."
        ),
        (
            "Saved energy is (E₀ − E)/E₀ with E₀ of the same serial pressure without parallel"
            " muscle: positive is saved. Eq. (10) has the other sign."
        ),
        (
            "The catalogue runs the same plant's muscles and load, compiled, under an ideal servo;"
            " current is what its motor, gear and friction take for the motion."
        ),
    ]
    rows = []
    for s, p in asked.conditions:
        one, swing = found.of[s, p], found.swing(s, p)[1]
        saved = found.saved(s, p)[1] if p != NONE else None
        rows.append(
            (
                kpa(s),
                kpa(p),
                f"{one.energy_a2_s.sum():.1f}",
                "" if saved is None else f"{100 * saved.min():.0f} to {100 * saved.max():.0f}",
                f"{100 * swing.min():.0f} to {100 * swing.max():.0f}",
                f"{one.peak_current_a.max():.2f}",
            )
        )
    head = (
        "SPAM",
        "PPAM",
        "I² over the chirp, A²s",
        "saved, %",
        "achieved swing, %",
        "peak current, A",
    )
    more = [
        Section(
            "conditions",
            "The conditions",
            join(
                [
                    table(head, rows, text_columns=(0, 1)),
                    note("Spans over frequency, means over 0.1 Hz."),
                ]
            ),
        )
    ]
    return study_page(
        "Knee",
        lead,
        {
            figure.caption.split(" (")[0].split(";")[0].rstrip("."): figure
            for figure in figures.values()
        },
        claims,
        more,
    )
