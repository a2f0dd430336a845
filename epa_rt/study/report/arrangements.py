"""The comparison of arrangements as figures and a page."""

import numpy as np

from epa_rt.report.charts import SERIES, Figure, Line, Panel, stack
from epa_rt.report.sections.section import Section
from epa_rt.study.arrangements import GOALS, NAMES_OF, Compared
from epa_rt.study.report.page import list_table, study_page
from epa_rt.study.report.sketch import wirings

UNITS = {"stroke_m": (100.0, "cm"), "peak_power_w": (1.0, "W"), "mean_i2_a2": (1.0, "A²")}


def said(least: tuple[float, float, float], factor: float) -> str:
    """'0.68 (800, -)': the figure, and the pressures of both muscles in kPa."""
    value, p0, p1 = least
    if not np.isfinite(value):
        return "does not follow"
    return (
        f"{value * factor:.3g}"
        f" ({', '.join('-' if np.isnan(p) else f'{p / 1e3:.0f}' for p in (p0, p1))})"
    )


def arrangements_figures(found: Compared) -> dict[str, Figure]:
    omega = found.asked.frequency_rad_s
    styles = {
        "serial": (5.0, "solid"),
        "both": (5.0, "solid"),
        "parallel": (2.0, "dash"),
        "antagonistic": (2.0, "dash"),
    }  # the pairs that may coincide: thick below thin
    panels = [
        Panel(
            f"least {words}",
            UNITS[goal][1],
            [
                Line(
                    omega,
                    np.array([one[0] for one in found.least(name, goal)]) * UNITS[goal][0],
                    name,
                    SERIES[i],
                    width,
                    dash,
                )
                for i, (name, (width, dash)) in enumerate(styles.items())
            ],
            170,
        )
        for goal, words in GOALS.items()
    ]
    return {
        "arrangements": stack(
            panels,
            "frequency, rad/s",
            caption="The least that each arrangement takes, each at its own best pressures.",
        )
    }


def arrangements_page(found: Compared, figures: dict[str, Figure]) -> str:
    load = found.asked.plant.params["load"][0]
    lead = [
        (
            f"The muscle of plant {found.asked.plant.name} and a load of {load['mass_kg']:g} kg"
            f" under {load['bias_n']:g} N, following {200 * found.asked.amplitude_m:g} cm peak to"
            " peak, in four wirings. Only the load table's ratios and rest lengths differ: serial"
            " (muscle between spool and load), parallel (a strap to the spool, muscle between"
            " frame and load), both, antagonistic (the spool pulls one and gives way to the"
            " other)."
        ),
        (
            "Each figure is the least over the pressures, among those where the load follows (90 %"
            " of the motion). A parallel muscle cannot shorten the motor's stroke, a serial one"
            " cannot take force off it."
        ),
    ]
    more = []
    for goal, words in GOALS.items():
        least = {name: found.least(name, goal) for name in NAMES_OF}
        rows = [
            (f"{w:.4g}", *(said(least[name][k], UNITS[goal][0]) for name in NAMES_OF))
            for k, w in enumerate(found.asked.frequency_rad_s)
        ]
        more.append(
            Section(
                goal,
                f"Least {words}",
                list_table(
                    ("rad/s", *NAMES_OF),
                    rows,
                    f"In {UNITS[goal][1]}; in brackets the pressures of muscle 0 and 1, kPa"
                    " absolute.",
                ),
            )
        )
    return study_page(
        "Arrangements",
        lead,
        {"The least that each takes": figures["arrangements"]},
        [],
        more,
        drawing=wirings(),
    )
