"""The serial study's figures and page."""

import numpy as np

from epa_rt.report.charts import Figure
from epa_rt.report.sections.section import Section
from epa_rt.study.claims import Claim
from epa_rt.study.motion import LAG_S, trace
from epa_rt.study.report.page import list_table, study_page
from epa_rt.study.report.pictures import maps_figure, over_pressure, rules, traces
from epa_rt.study.serial import Maps

TRACED_PA, TRACED_RAD_S = (500e3, 600e3, 800e3), 80.0


def serial_figures(maps: Maps, beside: dict[str, Maps]) -> dict[str, Figure]:
    """Figures by the name of their file; none where the mass ran away everywhere."""
    asked = maps.asked
    if not np.isfinite(maps.of["stroke_m"]).any():
        return {}  # the mass ran away everywhere
    mid = float(asked.frequency_rad_s[abs(asked.frequency_rad_s - TRACED_RAD_S).argmin()])
    inside = [p for p in TRACED_PA if asked.pressure_pa.min() <= p <= asked.pressure_pa.max()] or [
        float(asked.pressure_pa[len(asked.pressure_pa) // 2])
    ]
    atmosphere = float(asked.plant.params["gas"]["atmosphere_pa"][0, 1])
    drawn = [
        (
            p,
            trace(
                asked.plant.params,
                (p, atmosphere),
                asked.mean_m,
                asked.amplitude_m,
                mid,
                asked.drive,
            )[0],
        )
        for p in inside
    ]
    chosen = sorted(
        {
            float(w)
            for w in asked.frequency_rad_s[[len(asked.frequency_rad_s) * i // 5 for i in (2, 3, 4)]]
        }
        | {mid}
    )
    drawn = [d for d in drawn if len(d[1])]
    found = (
        {"serial_traces": traces(drawn, f"Mass and motor at {mid:g} rad/s (Fig. 5).")}
        if drawn
        else {}
    )
    found |= {
        "serial_stroke": over_pressure(
            maps, chosen, "Stroke, peak power and tension over pressure (Fig. 6)."
        ),
        "serial_map_stroke": maps_figure(
            maps,
            "stroke_m",
            100.0,
            "cm",
            "The motor's stroke, peak to peak; the line is the least at each frequency (Fig. 7).",
        ),
        "serial_map_power": maps_figure(
            maps,
            "peak_power_w",
            1.0,
            "W",
            "Peak of |F v| at the spool; the line is the least at each frequency (Fig. 8).",
        ),
        "serial_map_motion": maps_figure(
            maps, "motion_m", 100.0, "cm", "The motion that the mass achieves, peak to peak."
        ),
        "serial_map_tension": maps_figure(
            maps, "tension_high_n", 1.0, "N", "The highest tension in a period."
        ),
        "serial_rule": rules(maps, "Best pressure over frequency, by stroke and by peak power."),
    }
    for name, one in beside.items():
        if (one.of["runaway_s"] == 0.0).any():
            found[f"serial_map_stroke_{name}"] = maps_figure(
                one,
                "stroke_m",
                100.0,
                "cm",
                f"The motor's stroke with {name}; white: the mass runs away.",
                200.0 * asked.amplitude_m * 1.2,
            )
    return found


def serial_page(
    maps: Maps, beside: dict[str, Maps], claims: list[Claim], figures: dict[str, Figure]
) -> str:
    asked = maps.asked
    lead = [
        (
            f"Plant {asked.plant.name}: a mass of {asked.plant.params['load']['mass_kg'][0]:g} kg"
            f" under a constant load of {asked.plant.params['load']['bias_n'][0]:g} N hangs on"
            f" muscle and motor and follows a sine of {200 * asked.amplitude_m:g} cm from lowest to"
            " highest point. The motor is a position servo with a lag of"
            f" {asked.drive.lag_s * 1e3:g} ms under a PID {asked.drive.pid}."
        ),
        (
            "Pressures are absolute, at no-load length. Power is the peak of |F v| at the spool;"
            " the electric power beside it is what the plant's motor and gear would have to take to"
            " move so, without the drive's limits: where the braid runs into its lock an ideal"
            " servo jerks, and the figure is large."
        ),
    ]
    if asked.drive.lag_s != LAG_S:
        lead.append(f"The servo's lag is not the study's usual {LAG_S * 1e3:g} ms.")
    titled = {
        figure.caption.split(" (")[0].split(";")[0].rstrip("."): figure
        for figure in figures.values()
    }
    rows = [
        (
            f"{w:.4g}",
            *(f"{maps.best_pressure_pa(g)[i] / 1e3:.0f}" for g in ("stroke_m", "peak_power_w")),
            *(
                f"{maps.at_best('stroke_m', n)[i] * f:.3g}"
                for n, f in (
                    ("stroke_m", 100),
                    ("motion_m", 100),
                    ("peak_power_w", 1),
                    ("peak_electric_w", 1),
                    ("energy_a2_s", 1),
                    ("tension_low_n", 1),
                    ("tension_high_n", 1),
                )
            ),
        )
        for i, w in enumerate(asked.frequency_rad_s)
    ]
    head = (
        "rad/s",
        "best for stroke, kPa",
        "for power, kPa",
        "stroke, cm",
        "motion, cm",
        "peak |F v|, W",
        "peak electric, W",
        "I² per period, A²s",
        "least tension, N",
        "highest, N",
    )
    more = [
        Section(
            "best",
            "At the best pressure",
            list_table(head, rows, "Figures at the pressure of least stroke."),
        )
    ]
    return study_page("Serial actuator", lead, titled, claims, more)
