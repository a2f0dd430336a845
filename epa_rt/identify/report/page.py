"""One self-contained HTML page for one identification."""

from collections.abc import Sequence

from epa_rt.identify import models
from epa_rt.identify.answer import PAPER_R2, Answer
from epa_rt.identify.data import Trial
from epa_rt.identify.linear import Scaled
from epa_rt.identify.report.curves import cloud, drawn, stretches
from epa_rt.identify.report.identified import best, identified, residuals
from epa_rt.identify.report.pictures import loops, over_time, projections, space, terms
from epa_rt.identify.report.words import coefficients, condition, number, percent, yes
from epa_rt.identify.scores import DAMPING_N_S_M, HYSTERESIS_SHARE
from epa_rt.report.charts import embed
from epa_rt.report.markup import Html, facts, join, note, paragraph, table, tag, warning
from epa_rt.report.page import page
from epa_rt.report.sections.section import Section

SPACE_POINTS, PLANE_POINTS = 7000, 2100


def identify_page(found: Answer, trials: Sequence[Trial], data: Sequence[Scaled]) -> str:
    """The page of an identification; ``trials`` and ``data`` as they were fitted."""
    sections = [
        Section("identified", "What is identified", identified(found)),
        Section("residuals", "What it leaves unexplained", residuals(found, trials, data)),
        Section("models", "Models", _models(found)),
        Section("muscle", "The muscle", _muscle(found, trials, data)),
        Section("beside", "Models beside the measurement", _beside(found, trials, data)),
        Section("coefficients", "Coefficients", _coefficients(found)),
        *([Section("terms", "Which terms", _terms(found))] if found.selected else []),
        Section("inputs", "What this stands on", _inputs(found)),
    ]
    return page("Identified muscle", _header(found), sections)


def _header(found: Answer) -> Html:
    chosen = best(found)
    kpa = [t["p0_pa"] / 1e3 for t in found.trials]
    return join(
        [
            tag("p", ", ".join(found.inputs.get("logs", [])), class_="kicker"),
            tag(
                "h1",
                f"Identified muscle: {chosen.name}, R² {chosen.r2:.3f}, RMS {chosen.rms_n:.2f} N",
            ),
            *(warning(sentence) for sentence in found.remarks),
            facts(
                [
                    (
                        "Trials",
                        f"{len(found.trials)}, {sum(t['seconds'] for t in found.trials):.0f} s",
                    ),
                    ("No-load pressures", f"{min(kpa):.0f} to {max(kpa):.0f} kPa gauge"),
                    *(
                        (name, f"R² {_score(found, name).r2:.3f} (paper {PAPER_R2[name]:.3f})")
                        for name in PAPER_R2
                    ),
                ]
            ),
        ]
    )


def _score(found: Answer, name: str):
    return next(score for score in found.scores if score.name == name)


def _models(found: Answer) -> Html:
    rows = [
        [
            s.name,
            number(s.r2),
            number(PAPER_R2[s.name]) if s.name in PAPER_R2 else "",
            number(s.rms_n, 2),
            number(s.r2_trial),
            number(s.r2_pressure),
            percent(s.hysteresis),
            percent(s.loop_error),
            yes(s.has_hysteresis),
            number(s.damping_n_s_m, 1),
            yes(s.has_damping),
            condition(s.condition),
        ]
        for s in found.scores
    ]
    head = (
        "Model",
        "R²",
        "R², paper",
        "RMS, N",
        "R², trial left out",
        "R², pressure left out",
        "Loop work",
        "Loop error",
        "Hysteresis",
        "Damping, N s/m",
        "Has it",
        "Condition",
    )
    return join(
        [
            table(head, rows),
            table(("Model", "What it is"), [[s.name, s.says] for s in found.scores], (0, 1)),
            note(
                "R² against the mean of all trials together. Loop work: work the model loses in"
                " whole force-length loops, over what is measured; loop error: its mean miss per"
                f" trial. Hysteresis: at least {100 * HYSTERESIS_SHARE:.0f} % of it. Damping: what"
                " the force gains per speed of lengthening when every speed is halved; has it from"
                f" {DAMPING_N_S_M:g} N s/m. A law without friction takes friction for damping. The"
                " paper's column stands beside the reading of its model that keeps its order."
            ),
        ]
    )


def _muscle(found: Answer, trials: Sequence[Trial], data: Sequence[Scaled]) -> Html:
    name = models.POLYNOMIAL
    whole, few = (cloud(found, trials, data, name, most) for most in (SPACE_POINTS, PLANE_POINTS))
    return join(
        [
            embed(
                space(
                    whole,
                    False,
                    "Measured force over length and pressure; the colour is the speed of"
                    " contraction. Each trial is a sheet, as wide as its leak.",
                )
            ),
            embed(space(whole, True, "The same samples by the polynomial (eq. 8).")),
            embed(
                projections(
                    few, "eq. 8", "The same in its planes. Samples spread evenly over all trials."
                )
            ),
        ]
    )


def _beside(found: Answer, trials: Sequence[Trial], data: Sequence[Scaled]) -> Html:
    parts = stretches(found, trials, data)
    middle = parts[len(parts) // 2]
    return join(
        [
            paragraph(f"Drawn: {', '.join(drawn(found))}."),
            embed(
                over_time(
                    middle,
                    f"A stretch from the middle of the trial at {middle.p0_kpa:.0f} kPa, averaged"
                    " over 10 ms.",
                )
            ),
            *(
                embed(
                    loops(
                        parts[part],
                        f"Force against length, 5 s of the trial at {parts[part].p0_kpa:.0f} kPa.",
                    )
                )
                for part in dict.fromkeys((0, len(parts) - 1))
            ),
        ]
    )


def _coefficients(found: Answer) -> Html:
    rows = [
        [score.name if i == 0 else "", *row]
        for score in found.scores
        for i, row in enumerate(coefficients(score))
    ]
    b, n = found.geometry
    return join(
        [
            table(("Model", "Coefficient", "Value", "95 % interval", "Unit"), rows, (0, 1, 4)),
            note(
                "Intervals allow for autocorrelation: blocks of 2 s, resampled for the linear"
                " models, left out one by one (jackknife) for the physical ones. They hold for the"
                " model as it is written; where the model is wrong they say how far its best fit is"
                " known, no more."
            ),
            paragraph(
                f"“Static, b and n fitted” is a muscle with b = {b * 1e3:.2f} mm and n = {n:.3f}."
            ),
            _gas(found),
        ]
    )


def _gas(found: Answer) -> Html:
    gas = found.gas
    return (
        Html("")
        if gas is None
        else paragraph(
            f"Gas: Boyle (eq. 3) misses the pressure by {gas.rms_boyle_pa / 1e3:.2f} kPa (R²"
            f" {gas.r2_boyle:.3f} within trials). An exponent of {gas.polytropic_ratio:.3f} and a"
            f" leak of {gas.leak_per_s:.1e} 1/s beside {gas.dead_volume_m3 * 1e6:.1f} cm³ of dead"
            f" volume miss it by {gas.rms_pa / 1e3:.2f} kPa (R² {gas.r2:.3f}). Exponent and dead"
            " volume cannot be told apart; the volume is the plant file's."
        )
    )


def _terms(found: Answer) -> Html:
    rows, words = [], []
    for way in found.selected:
        five = next((step for step in way.path if len(step.terms) == 5), None)
        rows.append(
            [
                way.name,
                str(len(way.chosen.terms)),
                number(way.chosen.r2),
                condition(way.chosen.condition),
                number(five.r2) if five else "",
            ]
        )
        words.append([way.name, ", ".join(five.terms) if five else "", way.why])
    return join(
        [
            table(("Way", "Terms where it stops", "R²", "Condition", "R² at five terms"), rows),
            table(("Way", "Its five terms", "Why it stops"), words, (0, 1, 2)),
            embed(
                terms(
                    found.selected,
                    "R² and condition number of the regressors over the number of terms, on each"
                    " way.",
                )
            ),
            note(
                "All products of P, L and v up to the third power each: 64 terms, nearly"
                f" collinear. Effective samples: {found.effective_samples:.0f}. The size of a"
                " coefficient in such a fit says little about what its term is worth, which is why"
                " the paper's elimination ends elsewhere."
            ),
        ]
    )


def _inputs(found: Answer) -> Html:
    rows = [
        [
            t["log"],
            t["name"],
            f"{t['p0_pa'] / 1e3:.0f}",
            f"{t['seconds']:.0f}",
            *(
                f"{low * s:.{d}f} to {high * s:.{d}f}"
                for (low, high), s, d in (
                    (t["gauge_pa"], 1e-3, 0),
                    (t["length_m"], 1e3, 1),
                    (t["speed_m_s"], 1e3, 0),
                    (t["force_n"], 1.0, 0),
                )
            ),
        ]
        for t in found.trials
    ]
    return join(
        [
            paragraph("Normalised: ", found.normalisation.said(), "."),
            facts(
                [
                    (key, ", ".join(value) if isinstance(value, list) else value)
                    for key, value in found.inputs.items()
                ]
            ),
            table(
                (
                    "Log",
                    "Trial",
                    "P0, kPa gauge",
                    "s",
                    "Pressure, kPa gauge",
                    "Length, mm",
                    "Speed, mm/s",
                    "Force, N",
                ),
                rows,
                (0, 1),
            ),
        ]
    )
