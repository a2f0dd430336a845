"""Pictures of a tuning: plant and loop over frequency, sensitivity, Nyquist, and the loop in
time.
"""

import numpy as np

from epa_rt.report.charts import ACCENT, REFERENCE, SECOND, Figure, Line, Panel, stack
from epa_rt.report.shown import Shown
from epa_rt.tune.answer import Answer, Judged
from epa_rt.tune.controller import JOINT, controller_of
from epa_rt.tune.design import MS_LIMIT
from epa_rt.tune.in_time import Trace
from epa_rt.tune.report.words import compared
from epa_rt.tune.response import LEAST_COHERENCE

PRESENT = "present"
NYQUIST_REACH = 2.5  # about the origin: farther out nothing tells of robustness


def figures_of(answer: Answer) -> dict[str, Figure]:
    """Every figure by the name that its file gets."""
    figures = {
        "plant": plant_figure(answer),
        "loop": loop_figure(answer),
        "nyquist": nyquist_figure(answer),
        "steps": step_figure(answer),
    }
    trial = trial_figure(answer)
    return figures if trial is None else figures | {"trial": trial}


def plant_figure(answer: Answer) -> Figure:
    """The plant's gain and phase with their uncertainty, and the coherence."""
    r, whole = answer.response, answer.whole
    x, size = np.log10(r.frequency_hz), np.abs(r.plant)
    fine = answer.grid.frequency_hz
    fit = answer.model.at(fine)
    wide = np.minimum(r.radius / size, 0.9)
    degrees = np.degrees(np.unwrap(np.angle(r.plant)))
    turn = np.degrees(np.arcsin(wide))
    fit_phase = np.degrees(np.unwrap(np.angle(fit)))
    fit_phase += 360.0 * np.round((degrees[0] - fit_phase[0]) / 360.0)
    panels = [
        Panel(
            "gain of the plant",
            "dB",
            [
                _bars(x, _decibel(size * (1.0 - wide)), _decibel(size * (1.0 + wide))),
                Line(np.log10(fine), _decibel(np.abs(fit)), "model", SECOND),
                Line(x, _decibel(size), "measured", ACCENT, mode="markers"),
            ],
            190,
        ),
        Panel(
            "phase",
            "deg",
            [
                _bars(x, degrees - turn, degrees + turn),
                Line(np.log10(fine), fit_phase, "model", SECOND),
                Line(x, degrees, "measured", ACCENT, mode="markers"),
            ],
            150,
        ),
        Panel(
            "coherence",
            "",
            [
                Line(
                    np.log10(whole.frequency_hz),
                    whole.coherence,
                    "coherence",
                    ACCENT,
                    mode="lines+markers",
                )
            ],
            110,
            (0.0, 1.05),
            ((LEAST_COHERENCE, f"{LEAST_COHERENCE:g}"),),
        ),
    ]
    return _over_frequency(panels, answer, "The plant, command to output; bars hold 95 %.")


def loop_figure(answer: Answer) -> Figure:
    """Loop gain and phase, and the sensitivity, of present and proposed gains."""
    fine = answer.grid.frequency_hz
    x = np.log10(fine)
    gains, phases, sensitivities = [], [], []
    for judged, words, colour, dash in _sets(answer):
        loop = _loop(answer, judged)
        gains.append(Line(x, _decibel(np.abs(loop)), words, colour, 1.6, dash))
        phase = np.degrees(np.unwrap(np.angle(loop)))
        phases.append(Line(x, phase, words, colour, 1.6, dash))
        sensitivities.append(Line(x, _decibel(1.0 / np.abs(1.0 + loop)), words, colour, 1.6, dash))
    limit = float(_decibel(np.array([MS_LIMIT]))[0])
    panels = [
        Panel("loop gain", "dB", gains, 150, levels=((0.0, "gain one"),)),
        Panel("loop phase", "deg", phases, 130, levels=((-180.0, "-180 deg"),)),
        Panel("sensitivity |S|", "dB", sensitivities, 150, levels=((limit, f"Ms {MS_LIMIT:g}"),)),
    ]
    return _over_frequency(panels, answer, "The loop, opened at the command.")


def nyquist_figure(answer: Answer) -> Figure:
    """Loop responses in the plane, the point -1 and the circle that Ms keeps them out of."""
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    lines = [
        Line(
            -1.0 + np.cos(turn) / MS_LIMIT,
            np.sin(turn) / MS_LIMIT,
            f"Ms {MS_LIMIT:g}",
            REFERENCE,
            1.4,
        )
    ]
    for judged, words, colour, dash in _sets(answer):
        loop = _loop(answer, judged)
        near = np.abs(loop) < 2.0 * NYQUIST_REACH
        lines.append(Line(loop.real[near], loop.imag[near], words, colour, 1.6, dash))
    lines.append(Line(np.array([-1.0]), np.array([0.0]), "-1", SECOND, mode="markers"))
    panel = Panel("Nyquist", "", lines, 380, (-NYQUIST_REACH, NYQUIST_REACH))
    figure = stack([panel], "real part", caption="A loop outside of the circle keeps Ms.")
    figure.layout["xaxis"]["range"] = [-NYQUIST_REACH, NYQUIST_REACH]
    figure.layout["yaxis"]["scaleanchor"] = "x"
    return figure


def step_figure(answer: Answer) -> Figure:
    """The simulated steps: of the reference, and of a load at the command."""
    scale = Shown().difference_scale(answer.loop.si_unit)
    zero = answer.situation.output
    of_step = [
        _line(
            answer.present.step,
            answer.present.step.reference - zero,
            "reference",
            REFERENCE,
            scale.factor,
        )
    ]
    of_load, of_command = [], []
    command = Shown().difference_scale("m" if answer.loop.kind == JOINT else "m/s")
    for judged, words, colour, dash in _sets(answer):
        out, load = judged.step.output - zero, judged.load.output - zero
        of_step.append(_line(judged.step, out, words, colour, scale.factor, dash))
        of_load.append(_line(judged.load, load, words, colour, scale.factor, dash))
        sent = judged.step.command - answer.situation.command
        of_command.append(_line(judged.step, sent, words, colour, command.factor, dash))
    panels = [
        Panel("step of the reference", scale.unit, of_step, 170),
        Panel("command of that step", command.unit, of_command, 110),
        Panel("step of a load at the command", scale.unit, of_load, 140),
    ]
    return stack(panels, caption="Simulated with the loop's delay, sampling, steps and limits.")


def trial_figure(answer: Answer) -> Figure | None:
    """Errors over the wanted motion: of its recorded trial, or simulated; None where no motion was
    given.
    """
    before = answer.present.trial
    if before is None:
        return None
    scale = Shown().difference_scale(answer.loop.si_unit)
    errors = []
    for judged, words, colour, dash in _sets(answer):
        trace = judged.trial or before
        error = trace.reference - trace.output
        errors.append(_line(trace, error, words, colour, scale.factor, dash))
    panels = [
        Panel(
            "wanted motion",
            scale.unit,
            [_line(before, before.reference, "wanted motion", REFERENCE, scale.factor)],
            110,
        ),
        Panel("tracking error", scale.unit, errors, 170),
    ]
    recorded = answer.problem.followed is not None
    source = "as the recorded trial has it" if recorded else "simulated"
    return stack(panels, caption=f"Reference minus output over the experiment's trial, {source}.")


def _sets(answer: Answer) -> tuple[tuple[Judged, str, str, str], ...]:
    name, other = compared(answer)
    both = ((answer.present, PRESENT, SECOND, "dash"), (other, name, ACCENT, "solid"))
    return both[:1] if other is answer.present or other.gains == answer.present.gains else both


def _loop(answer: Answer, judged: Judged) -> np.ndarray:
    feedback = controller_of(answer.loop, judged.gains, answer.grid.frequency_hz).feedback
    loop: np.ndarray = answer.grid.plant * feedback
    return loop


def _decibel(values: np.ndarray) -> np.ndarray:
    level: np.ndarray = 20.0 * np.log10(values)
    return level


def _bars(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> Line:
    """A vertical bar at each x; NaN breaks the line between them."""
    gap = np.full(len(x), np.nan)
    return Line(
        np.stack([x, x, gap], 1).ravel(),
        np.stack([low, high, gap], 1).ravel(),
        "95 %",
        REFERENCE,
        1.0,
    )


def _line(
    trace: Trace, values: np.ndarray, words: str, colour: str, factor: float, dash: str = "solid"
) -> Line:
    every = max(len(values) // 2000, 1)
    return Line(trace.t_s[::every], factor * values[::every], words, colour, 1.4, dash)


def _over_frequency(panels: list[Panel], answer: Answer, caption: str) -> Figure:
    """A stack whose axis holds logarithms, labelled with what they stand for."""
    figure = stack(panels, "frequency, Hz", caption=caption)
    low, high = answer.grid.frequency_hz[0], answer.grid.frequency_hz[-1]
    ticks = [v for v in _TICKS_HZ if 0.9 * low <= v <= 1.1 * high]
    figure.layout["xaxis"] |= {
        "tickvals": [float(np.log10(v)) for v in ticks],
        "ticktext": [f"{v:g}" for v in ticks],
        "range": [float(np.log10(0.92 * low)), float(np.log10(1.08 * high))],
        "hoverformat": ".3~f",
    }
    return figure


_TICKS_HZ = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0)
