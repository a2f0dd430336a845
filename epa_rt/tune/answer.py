"""A tuning: what the logs say of a loop, how robust it is now, which gains are proposed."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.recording import Recording
from epa_rt.tune.controller import JOINT, MOTOR, Gains, Loop, TuneError, loop_of
from epa_rt.tune.design import MS_LIMIT, Merit, Problem, Proposal, Wanted, problem_of, proposed
from epa_rt.tune.evidence import HIGHEST_HZ_SHARE, Evidence, evidence_of, usual_wanted, wanted_of
from epa_rt.tune.fit import Model, fitted
from epa_rt.tune.followed import Followed, followed_from
from epa_rt.tune.in_time import Situation, Trace, simulated
from epa_rt.tune.margins import Interpolated, Margins, interpolated, shortfall
from epa_rt.tune.response import LEAST_COHERENCE, Response, response_of, widened
from epa_rt.tune.rig_text import written

LEAST_POINTS = 8  # of the response: with fewer no crossing is found between them
WIDEST_GAP = 2.0  # of neighbouring frequencies: an octave in which anything may happen
STEP_S = 2.0  # of the simulated steps
LONGEST_TRACE_S = 12.0  # of a simulated trial
STEP_SIZE = {"rad": np.pi / 180.0, "m": 1e-3}
METHOD = "joint input-output: response to the reference over that of the command"

Motion = tuple[np.ndarray, np.ndarray]  # reference and its speed (k,), a value a cycle


@dataclass(frozen=True)
class Judged:
    """One set of gains: margins, what it is worth, and how it does in time."""

    gains: Gains
    margins: Margins
    merit: Merit
    step: Trace
    load: Trace
    trial: Trace | None


@dataclass(frozen=True)
class Answer:
    """Everything that text, JSON and page are drawn from. ``whole``: the response as measured,
    ``response``: what of it carries a statement, ``grid``: that between its points, ``warning``:
    what a reader has to know of present gains that stay, ``holding``: the gains to take where the
    margin counts more than the tracking; None where the present or the proposed ones keep it.
    """

    rig: str
    loop: Loop
    logs: tuple[str, ...]
    seconds: float
    whole: Response
    response: Response
    grid: Interpolated
    model: Model
    situation: Situation
    wanted: Wanted
    wanted_from: str
    problem: Problem
    present: Judged
    proposal: Proposal
    after: Judged
    remarks: tuple[str, ...]
    warning: str | None
    holding: Judged | None = None


def tuned(
    recordings: Sequence[Recording],
    rig: Rig,
    kind: str,
    motion: Motion | None,
    progress: Callable[[str, float], None] = lambda stage, share: None,
    hold_margin: bool = False,
) -> Answer:
    """The tuning of a loop of a rig from its logs. ``motion``: what the loop is to follow, None:
    what the logs followed. ``hold_margin``: propose gains that keep Ms also where they track worse.
    Raises TuneError.
    """
    loop = loop_of(rig, kind)
    progress("reading", 0.0)
    evidence = evidence_of(recordings, rig, loop, motion[0] if motion is not None else None)
    progress("response", 0.1)
    highest_hz = HIGHEST_HZ_SHARE / loop.period_s
    whole = response_of(evidence.trials, loop.period_s, highest_hz)
    if len(whole.frequency_hz):
        whole = widened(whole, evidence.trials, loop.period_s, highest_hz)
    response = whole.only(whole.radius < np.abs(whole.plant))
    if len(response.frequency_hz) < LEAST_POINTS:
        raise TuneError(
            f"{recordings[0].path}: found {len(response.frequency_hz)} frequencies at which the"
            f" plant's response shows, expected {LEAST_POINTS}: an excitation that is larger,"
            " longer or wider"
        )
    model = fitted(
        response.frequency_hz, response.plant, np.sqrt(response.variance), int(kind == MOTOR)
    )
    grid = interpolated(response.frequency_hz, response.plant, response.radius, model.at)
    wanted, wanted_from = _wanted(loop, evidence, motion)
    followed = _followed(loop, evidence, grid, model)
    problem = problem_of(rig, loop, grid, wanted, evidence.situation.quantum, followed)
    progress("search", 0.2)
    proposal = proposed(problem)
    progress("simulation", 0.8)
    situation = _still(evidence.situation, motion)

    def judged(gains: Gains) -> Judged:
        return _judged(rig, problem, model, situation, motion, gains)

    present, after = judged(loop.gains), judged(proposal.gains)
    proposal, after = _confirmed(rig, problem, proposal, present, after)
    holding = judged(proposal.holding) if proposal.holding is not None else None
    if hold_margin and holding is not None:
        why = f"Ms at {MS_LIMIT:g} was asked for, and costs {_costs(problem, present, holding)}"
        proposal, after, holding = Proposal(holding.gains, False, why), holding, None
    return Answer(
        rig.name,
        loop,
        tuple(recording.path for recording in recordings),
        evidence.seconds,
        whole,
        response,
        grid,
        model,
        situation,
        wanted,
        wanted_from,
        problem,
        present,
        proposal,
        after,
        tuple(_remarks(recordings, whole, response, problem)),
        _warning(problem, present, proposal, holding),
        holding,
    )


def _confirmed(
    rig: Rig, problem: Problem, proposal: Proposal, before: Judged, after: Judged
) -> tuple[Proposal, Judged]:
    """A proposal that tracks worse in time, with the loop's steps and limits, is none."""
    if proposal.keep or before.trial is None or after.trial is None:
        return proposal, after
    within = problem.followed is None or _within_limits(rig, problem.loop, after.trial)
    if within and after.trial.rms_error <= before.trial.rms_error:
        return proposal, after
    why = "what the response promises, limits and steps of the loop take away again"
    holding = None if problem.holds(before.gains) else after.gains
    return Proposal(before.gains, True, why, holding=holding), before


def _within_limits(rig: Rig, loop: Loop, trace: Trace) -> bool:
    """Whether no limit and no slew limit cuts the command of a trial that does not know of them."""
    row = rig.row(loop.command)
    low, high = row.limits or (-np.inf, np.inf)
    steps = np.abs(np.diff(trace.command)) / loop.period_s
    inside = low <= np.min(trace.command) and np.max(trace.command) <= high
    return bool(inside and np.max(steps) <= (row.slew or np.inf))


def _warning(
    problem: Problem, present: Judged, proposal: Proposal, holding: Judged | None
) -> str | None:
    """What is said of present gains that stay although they break the bound of Ms: by how much,
    what keeping it costs, and with which gains.
    """
    short = shortfall(present.margins, MS_LIMIT)
    if not (proposal.keep and proposal.known) or short is None:
        return None
    is_shown = not present.margins.stable or present.margins.peak > MS_LIMIT
    fails = "does not keep" if is_shown else "is not shown to keep"
    said = f"the present loop {fails} its margin (Ms at most {MS_LIMIT:g}): {short}"
    if holding is None:
        return f"{said}; no gains were found that keep it: excite the loop longer or further"
    texts = written(holding.gains, problem.loop.kind)
    gains = ", ".join(f"{key} {text}" for key, text in texts.items())
    return (
        f"{said}; keeping it costs {_costs(problem, present, holding)}: {gains};"
        " --hold-margin proposes these"
    )


def _costs(problem: Problem, present: Judged, holding: Judged) -> str:
    """How much worse gains track and hold a load than the present ones, in words."""
    tracking = holding.merit.tracking / present.merit.tracking
    if present.trial is not None and holding.trial is not None:
        tracking = max(tracking, holding.trial.rms_error / present.trial.rms_error)
    load = holding.merit.load / present.merit.load
    found = [
        f"{100.0 * (ratio - 1.0):.0f} % {what}"
        for ratio, what in ((tracking, "of tracking"), (load, "more output after a load step"))
        if ratio > 1.005
    ]
    return " and ".join(found) or "nothing that these figures show"


def _followed(loop: Loop, evidence: Evidence, grid: Interpolated, model: Model) -> Followed | None:
    """The recorded trial of the wanted motion, for a joint's loop: the motor's has no
    feedforward.
    """
    if loop.kind != JOINT or evidence.of_motion is None:
        return None
    return followed_from(loop, evidence.of_motion, model.at, float(grid.frequency_hz[-1]))


def _wanted(loop: Loop, evidence: Evidence, motion: Motion | None) -> tuple[Wanted, str]:
    if motion is not None:
        return wanted_of([motion[0]], loop.period_s), "the experiment's trial"
    if evidence.wanted is not None:
        return evidence.wanted, "the logs' trials"
    bandwidth_hz = 2.0 if loop.kind == JOINT else 5.0
    return usual_wanted(loop, bandwidth_hz), f"steps, up to {bandwidth_hz:g} Hz"


def _still(situation: Situation, motion: Motion | None) -> Situation:
    """The situation about which a motion is simulated: its own start."""
    if motion is None:
        return situation
    return Situation(float(motion[0][0]), situation.command, situation.quantum)


def _judged(
    rig: Rig,
    problem: Problem,
    model: Model,
    situation: Situation,
    motion: Motion | None,
    gains: Gains,
) -> Judged:
    loop = problem.loop
    count, rest = round(STEP_S / loop.period_s), round(0.1 / loop.period_s)
    size = STEP_SIZE[loop.si_unit]
    still = np.zeros(count)
    stepped = np.full(count, situation.output)
    stepped[rest:] += size
    at_rest = np.full(count, situation.output)
    load = size * abs(loop.command_of)  # as much command as turns the joint by that, muscles held
    run = (rig, loop, gains, model, situation)
    trial = None
    if problem.followed is not None:
        trial = problem.followed.trace(gains)
    elif motion is not None:
        longest = round(LONGEST_TRACE_S / loop.period_s)
        trial = simulated(*run, motion[0][:longest], motion[1][:longest])
    return Judged(
        gains,
        problem.margins(gains),
        problem.merit(gains),
        simulated(*run, stepped, still),
        simulated(*run, at_rest, still, load),
        trial,
    )


def _remarks(
    recordings: Sequence[Recording], whole: Response, response: Response, problem: Problem
) -> list[str]:
    """What a reader has to know of the response before believing it."""
    remarks = [f"{r.name}: {sentence}" for r in recordings for sentence in r.found]
    weak = ~whole.sound
    if np.any(weak):
        frequency = whole.frequency_hz[weak]
        remarks.append(
            f"the coherence is below {LEAST_COHERENCE:g} at {int(weak.sum())} of"
            f" {len(weak)} frequencies, from {frequency[0]:.3g} to {frequency[-1]:.3g} Hz: there"
            " the response is known to its stated uncertainty only"
        )
    frequency = response.frequency_hz
    wide = np.flatnonzero(frequency[1:] / frequency[:-1] > WIDEST_GAP)
    remarks += [
        f"nothing is known between {frequency[i]:.3g} and {frequency[i + 1]:.3g} Hz"
        for i in wide.tolist()
    ]
    top = problem.wanted.frequency_hz[-1]
    if top > 1.05 * frequency[-1]:
        remarks.append(
            f"the wanted motion goes up to {top:.3g} Hz, the response to {frequency[-1]:.3g} Hz"
        )
    return remarks


def decision_word(proposal: Proposal) -> str:
    """'keep', 'change', or 'unknown' where the response ends too early to say either."""
    if not proposal.known:
        return "unknown"
    return "keep" if proposal.keep else "change"


def as_json(answer: Answer) -> dict[str, Any]:
    """The answer as plain data in SI; what is not known or infinite is null."""
    loop = answer.loop
    r = answer.whole
    return {
        "rig": answer.rig,
        "loop": loop.name,
        "logs": list(answer.logs),
        "seconds": answer.seconds,
        "method": METHOD,
        "target": {"ms": MS_LIMIT, "confidence": 0.95},
        "decision": decision_word(answer.proposal),
        "why": answer.proposal.why,
        "warning": answer.warning,
        "remarks": list(answer.remarks),
        "wanted": {
            "from": answer.wanted_from,
            "frequency_hz": answer.wanted.frequency_hz.tolist(),
            "power": answer.wanted.power.tolist(),
        },
        "present": _set_as_json(answer.present, loop),
        "proposed": _set_as_json(answer.after, loop),
        "holding": _set_as_json(answer.holding, loop) if answer.holding else None,
        "response": {
            "frequency_hz": r.frequency_hz.tolist(),
            "real": r.plant.real.tolist(),
            "imaginary": r.plant.imag.tolist(),
            "radius_95": r.radius.tolist(),
            "coherence": r.coherence.tolist(),
        },
        "model": {
            "poles": [[p.real, p.imag] for p in answer.model.poles],
            "residues": [[p.real, p.imag] for p in answer.model.residues],
            "integrators": answer.model.integrators,
            "misfit": answer.model.misfit,
        },
    }


def _set_as_json(judged: Judged, loop: Loop) -> dict[str, Any]:
    return {
        "gains": written(judged.gains, loop.kind),
        "margins": {key: _known(value) for key, value in asdict(judged.margins).items()},
        "merit": asdict(judged.merit),
        "trial_rms": judged.trial.rms_error if judged.trial else None,
    }


def _known(value: float) -> float | bool | None:
    return value if isinstance(value, bool) or np.isfinite(value) else None
