"""A tuning in words and rows that text and page share."""

import math
from collections.abc import Callable

from epa_rt.report.shown import Shown, number
from epa_rt.tune.answer import Answer, Judged
from epa_rt.tune.controller import JOINT
from epa_rt.tune.design import MS_LIMIT
from epa_rt.tune.rig_text import keys_of, written

Row = tuple[str, str, str]  # what, present, the other set of `compared`


def compared(answer: Answer) -> tuple[str, Judged]:
    """What stands beside the present gains, and its name: the proposal, or those that keep the
    margin where the present ones stay without it.
    """
    return ("proposed", answer.after) if answer.holding is None else ("margin held", answer.holding)


def decision(answer: Answer) -> str:
    """One sentence: keep or change, and why."""
    if not answer.proposal.known:
        return f"no statement on the gains: {answer.proposal.why}"
    if answer.proposal.keep:
        return f"keep the present gains: {answer.proposal.why}"
    return f"change the gains: {answer.proposal.why}"


def gain_rows(answer: Answer) -> list[Row]:
    """Every gain with its unit."""
    kind = answer.loop.kind
    before, after = (written(j.gains, kind) for j in (answer.present, compared(answer)[1]))
    return [(key, before.get(key, "none"), after.get(key, "none")) for key in keys_of(kind)]


def margin_rows(answer: Answer) -> list[Row]:
    """Margins and what the gains are worth, each with its unit; of a response that ends too early
    no margin.
    """
    shown, unit = Shown(), answer.loop.si_unit
    rows = (
        []
        if not answer.proposal.known
        else [
            ("sensitivity peak Ms", *_pair(answer, lambda j: _plain(j.margins.peak))),
            (
                f"Ms over the uncertainty (limit {MS_LIMIT:g})",
                *_pair(answer, lambda j: _plain(j.margins.worst_peak)),
            ),
            ("gain margin", *_pair(answer, _gain)),
            ("phase margin", *_pair(answer, _phase)),
            ("delay margin", *_pair(answer, _delay)),
            ("crossover", *_pair(answer, lambda j: _hertz(j.margins.crossover_hz))),
            ("bandwidth (|S| at -3 dB)", *_pair(answer, lambda j: _hertz(j.margins.bandwidth_hz))),
        ]
    )
    of_trial = answer.problem.followed is not None
    source = "of the recorded trial" if of_trial else "by the response"
    rows += [
        (
            f"tracking error, RMS, {source}",
            *_pair(answer, lambda j: shown.difference(j.merit.tracking, unit)),
        )
    ]
    if answer.present.trial is not None and not of_trial:
        rows.append(
            (
                "tracking error, RMS, simulated",
                *_pair(
                    answer, lambda j: shown.difference(j.trial.rms_error if j.trial else 0.0, unit)
                ),
            )
        )
    rate = "m/s" if answer.loop.kind == JOINT else "m/s^2"
    rows += [
        (
            "output after a load step, relative",
            "100 %",
            f"{100.0 * compared(answer)[1].merit.load / answer.present.merit.load:.0f} %",
        ),
        (
            "command's hum from the sensor's steps",
            *_pair(answer, lambda j: f"{number(1e3 * j.merit.noise_rate, 3)} m{rate}"),
        ),
    ]
    return rows


def _pair(answer: Answer, text: Callable[[Judged], str]) -> tuple[str, str]:
    return text(answer.present), text(compared(answer)[1])


def _plain(value: float) -> str:
    return number(value, 3) if math.isfinite(value) else "not bounded"


def _hertz(value: float) -> str:
    return f"{number(value, 3)} Hz" if math.isfinite(value) else "none in range"


def _gain(judged: Judged) -> str:
    m = judged.margins
    if not math.isfinite(m.gain):
        return "none in range"
    return f"{number(m.gain, 3)} at {number(m.gain_hz, 3)} Hz"


def _phase(judged: Judged) -> str:
    value = judged.margins.phase_rad
    return f"{math.degrees(value):.0f} deg" if math.isfinite(value) else "none in range"


def _delay(judged: Judged) -> str:
    value = judged.margins.delay_s
    return f"{1e3 * value:.1f} ms" if math.isfinite(value) else "none in range"
