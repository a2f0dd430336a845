"""One self-contained HTML page for one tuning."""

from epa_rt.report.charts import embed
from epa_rt.report.markup import Html, facts, join, note, paragraph, table, tag, warning
from epa_rt.report.page import page
from epa_rt.report.sections.section import Section
from epa_rt.tune.answer import METHOD, Answer
from epa_rt.tune.design import MS_LIMIT
from epa_rt.tune.report.pictures import (
    loop_figure,
    nyquist_figure,
    plant_figure,
    step_figure,
    trial_figure,
)
from epa_rt.tune.report.words import compared, decision, gain_rows, margin_rows

SPOKEN = {"joint_angle": "joint", "motor_speed": "motor"}


def tune_page(answer: Answer) -> str:
    """The page: decision and gains first, then what they rest on."""
    trial = trial_figure(answer)
    sections = [
        Section("gains", "Gains", _gains(answer)),
        Section("margins", "Margins", _margins(answer)),
        Section("time", "In time", join([embed(step_figure(answer)), *_drawn(trial)])),
        Section("loop", "The loop over frequency", _loop(answer)),
        Section("plant", "The plant, measured", _plant(answer)),
    ]
    return page(f"Tuning of {answer.rig}", _header(answer), sections)


def _header(answer: Answer) -> Html:
    r = answer.response
    return join(
        [
            tag("p", ", ".join(answer.logs), class_="kicker"),
            tag("h1", f"{answer.rig}, {SPOKEN[answer.loop.name]} loop"),
            paragraph(tag("strong", decision(answer)[0].upper() + decision(answer)[1:] + ".")),
            *(warning(s) for s in (answer.warning, *answer.remarks) if s),
            facts(
                [
                    ("Trials", f"{answer.seconds:.0f} s"),
                    ("Response", f"{r.frequency_hz[0]:.3g} to {r.frequency_hz[-1]:.3g} Hz"),
                    ("Wanted", answer.wanted_from),
                    ("Bound", f"Ms at most {MS_LIMIT:g}"),
                ]
            ),
        ]
    )


def _gains(answer: Answer) -> Html:
    return table(("gain", "present", compared(answer)[0]), gain_rows(answer))


def _margins(answer: Answer) -> Html:
    return join(
        [
            table(("margin", "present", compared(answer)[0]), margin_rows(answer)),
            note(
                f"Ms at most {MS_LIMIT:g} keeps a gain margin of {MS_LIMIT / (MS_LIMIT - 1):.2f}"
                " and a phase margin of 36 deg at least. The response ends at"
                f" {answer.response.frequency_hz[-1]:.3g} Hz; a margin beyond is not in range."
            ),
        ]
    )


def _loop(answer: Answer) -> Html:
    return join([embed(loop_figure(answer)), embed(nyquist_figure(answer))])


def _plant(answer: Answer) -> Html:
    return join(
        [
            embed(plant_figure(answer)),
            note(
                f"Estimated by {METHOD}: in closed loop the direct estimate is biased, for the"
                " command holds the output's noise. The model is for the steps in time only and"
                f" misses the response by {100.0 * answer.model.misfit:.1f} % RMS."
            ),
        ]
    )


def _drawn(figure: object) -> list[Html]:
    from epa_rt.report.charts import Figure

    return [embed(figure)] if isinstance(figure, Figure) else []
