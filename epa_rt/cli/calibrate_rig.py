"""Taking the points of a calibration on a rig, real or simulated."""

import argparse
import dataclasses
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from epa_rt.cli.by_hand import RigByHand
from epa_rt.cli.exits import COMPLETED, FAILED, STOPPED, VerbError
from epa_rt.cli.screen_text import filled

if TYPE_CHECKING:
    import numpy as np

    from epa_rt.calibrate.point import Point
    from epa_rt.calibrate.points_file import Asked
    from epa_rt.calibrate.taking import Answers, Step, Taking
    from epa_rt.cli.calibrate import Session
    from epa_rt.cli.references import TypedAnswers, TypedLines

T = TypeVar("T")
HIGHEST_SHARE = 0.9  # of pressure_max: the highest step, off the trip by what a wrong gain makes
STEPS_UP = 6
HOW = {
    "force": "hang the mass, let it rest; type its force or mass ('49.05 N', '5.000 kg')",
    "joint": "set the angle by the jig; type it ('30 deg')",
    "pressure": "type what the reference gauge says ('200.0 kPa')",
    "motor": "type what the reference cell says ('120.5 N')",
}


def take_points(session: "Session", by_hand: RigByHand) -> "tuple[list[Point], int]":
    """The points and the exit code of the run that took them. Raises VerbError."""
    arguments = session.arguments
    is_typed = sys.stdin.isatty() and (arguments.points is None or not by_hand.is_sim)
    _refuse_in_vain(session, by_hand, is_typed)
    asked = _asked(session)
    if arguments.kind == "pressure" or arguments.by == "motor":
        return _active(session, by_hand, asked, is_typed)
    return _passive(session, by_hand, asked, is_typed)


def _refuse_in_vain(session: "Session", by_hand: RigByHand, is_typed: bool) -> None:
    arguments, is_active = session.arguments, session.arguments.kind == "pressure"
    if arguments.by == "motor":
        if arguments.kind != "force":
            raise VerbError(f"found --by motor for {arguments.kind}, expected it for force")
        if arguments.travels is None or arguments.pressure is None:
            raise VerbError("found --by motor without --travels and --pressure, expected both")
        is_active = True
    if arguments.steps is not None and arguments.kind != "pressure":
        raise VerbError("found --steps, expected it for pressure; else --points")
    if is_active and arguments.points is not None:
        raise VerbError(
            "found --points where the rig makes its own steps, expected --steps or --travels, or"
            " --from with a table of references and readings"
        )
    if is_typed:
        return
    if not by_hand.is_sim:
        raise VerbError(
            "found no terminal on which an operator reads the reference, expected one, or --from"
        )
    if not is_active and arguments.points is None:
        raise VerbError("found no terminal to ask on, expected --points FILE or --from LOG")


def _asked(session: "Session") -> "list[Asked]":
    """The references of --points, in the order that is asked for."""
    from epa_rt.calibrate.points_file import read_asked

    arguments = session.arguments
    if arguments.points is None:
        return []
    asked = read_asked(arguments.points, session.reader)
    session.used_mass |= any(one.is_mass for one in asked)
    return _ordered(asked, [one.reference for one in asked], arguments)


def _ordered(items: list[T], keys: list[float], arguments: argparse.Namespace) -> list[T]:
    """Up, down, or up and down again; as given where neither is asked for."""
    up = [items[i] for i in sorted(range(len(items)), key=lambda i: keys[i])]
    ascending, descending = arguments.ascending, arguments.descending
    if ascending and descending:
        return up + up[-2::-1]
    if ascending:
        return up
    return up[::-1] if descending else items


def _noise(session: "Session") -> "np.random.Generator | None":
    """Errors of a simulated reference; none where no uncertainty is stated."""
    import numpy as np

    if session.arguments.reference_uncertainty is None:
        return None
    return np.random.default_rng([session.arguments.seed, 57])


def _typed(
    session: "Session", by_hand: RigByHand, asked: "list[Asked]", how: str, by_gauge: bool
) -> "tuple[TypedAnswers, TypedLines]":
    from epa_rt.cli.references import Talk, TypedAnswers, TypedLines

    session.arguments.speed = session.arguments.speed or 1.0  # a hand needs real time
    lines = TypedLines(session.rig.period_s)
    talk = Talk(HOW[how], session.record_s, by_gauge)
    return (
        TypedAnswers(lines, session.reader, session.scale, talk, asked, by_hand.standard),
        lines,
    )


def _taking(session: "Session", steps: "Iterator[Step]", answers: "Answers") -> "Taking":
    from epa_rt.calibrate.readings import native_line
    from epa_rt.calibrate.taking import Taking

    return Taking(
        session.row.name,
        native_line(session.rig, session.row),
        session.scale,
        steps,
        answers,
        session.rig.period_s,
        session.settle_s,
        session.record_s,
    )


def _passive(
    session: "Session", by_hand: RigByHand, asked: "list[Asked]", is_typed: bool
) -> "tuple[list[Point], int]":
    """Drive and air off; references are applied from outside."""
    from epa_rt.calibrate.taking import Step, points_of
    from epa_rt.cli.keys import raw_keys
    from epa_rt.cli.references import FileAnswers

    kind = session.arguments.kind
    session.method = {
        "force": "references applied by hand, drive and air off",
        "joint": "angles set by a jig, drive and air off",
    }[kind]
    if is_typed:
        answers, requests = _typed(session, by_hand, asked, kind, by_gauge=False)
        taking = _taking(session, repeat(Step((), "")), answers)
        answers.taking = taking
        print("drive and air stay off; nothing moves")
    else:
        files = FileAnswers(asked, by_hand.standard, _noise(session))
        answers, requests = None, None
        taking = _taking(session, files.steps, files)
    with raw_keys() if is_typed else nullcontext():
        code = _watch(session, by_hand, taking, requests)
    session.used_mass |= answers is not None and answers.used_mass
    return points_of(taking.taken), code


def _watch(
    session: "Session", by_hand: RigByHand, taking: "Taking", requests: "TypedLines | None"
) -> int:
    """One recorded watch of the unpowered rig; its exit code. Raises VerbError."""
    from epa_rt.calibrate.taking import PHASES
    from epa_rt.cli.calibration_age import facts as calibration_facts
    from epa_rt.cli.calibration_age import old_words
    from epa_rt.cli.inputs import Inputs
    from epa_rt.cli.log_name import take_log_path
    from epa_rt.cli.run import unprotected_facts
    from epa_rt.experiments.experiment import Experiment
    from epa_rt.logs.recorder import Recorder, RecorderError
    from epa_rt.loop.requests import OperatorRequests
    from epa_rt.loop.unpowered import unpowered_layout, watch_unpowered
    from epa_rt.realtime.process import undisturbed
    from epa_rt.signals.codec import Decoder

    rig, arguments = session.rig, session.arguments
    experiment = Experiment(_log_name(session), "", 0, rig.period_s, (), Path("calibrate"))
    inputs = Inputs(rig, experiment, None, by_hand.attached(), by_hand.unprotected)
    for sentence in old_words(rig):
        print(f"OLD CALIBRATION: {sentence}", file=sys.stderr)
    paced = arguments.speed is not None if by_hand.is_sim else not arguments.lock_step
    facts = by_hand.facts(experiment.name, paced)
    decoder = Decoder(rig)
    backend = by_hand.backend()
    log = take_log_path(arguments.out, inputs)
    layout = unpowered_layout(rig, decoder, PHASES)
    recorder = Recorder(
        log,
        layout,
        inputs.attachments,
        {"run": facts, **unprotected_facts(inputs), **calibration_facts(rig)},
        lossless=not paced,
        may_wait=by_hand.is_sim,
    )
    try:
        recorder.open()
    except RecorderError as error:
        if not log.stat().st_size:
            log.unlink()
        raise VerbError(str(error), FAILED) from None
    outcome, cause = "failed", "the watch ended by an error of its own"
    try:
        with (
            (requests or OperatorRequests(rig.period_s)).listening() as listening,
            undisturbed(rig.realtime if paced else None),
        ):
            watched = watch_unpowered(rig, backend, decoder, taking, recorder, listening)
        outcome, cause = watched.outcome, watched.cause
    finally:
        summary = recorder.close(outcome, cause, "the drive was never on, no valve was switched")
    if cause:
        print(filled(f"{outcome}: {cause}"))
    print(filled(f"log: {summary.path}"))
    return {"completed": COMPLETED, "stopped": STOPPED}.get(outcome, FAILED)


def _log_name(session: "Session") -> str:
    return f"calibrate_{session.arguments.kind}"


def _active(
    session: "Session", by_hand: RigByHand, asked: "list[Asked]", is_typed: bool
) -> "tuple[list[Point], int]":
    """The rig makes the steps itself, as a jog does; the references are read."""
    from epa_rt.calibrate.taking import Stepping, points_of
    from epa_rt.cli.jog import known_zero
    from epa_rt.cli.keys import raw_keys
    from epa_rt.cli.references import GaugeAnswers
    from epa_rt.cli.run import closing_text, exit_code
    from epa_rt.cli.zero import need_known_count
    from epa_rt.loop.assembly import WiringError
    from epa_rt.loop.by_hand import assemble_jog

    arguments, rig = session.arguments, session.rig
    steps = _pressure_steps(session) if arguments.kind == "pressure" else _travel_steps(session)
    if arguments.by == "motor" and by_hand.is_real:  # it goes to travels, as a run does
        need_known_count(rig, arguments.rig, arguments.supply_stayed_on)
    answers: Answers
    requests = None
    if is_typed:
        how = "pressure" if arguments.kind == "pressure" else "motor"
        typed, requests = _typed(session, by_hand, asked, how, by_gauge=True)
        answers = typed
    else:
        assert by_hand.standard is not None
        u = session.reader.uncertainty or 0.01 * abs(session.scale.gain) * session.scale.step
        shift = rig.atmosphere_pa if session.row.reads == "absolute" else 0.0
        answers = GaugeAnswers(by_hand.standard, u, _noise(session), shift)
    taking = _taking(session, iter(steps), answers)
    if is_typed:
        typed.taking = taking
    try:
        source = Stepping(taking, rig, session.row.name)
        assembly, jog = assemble_jog(rig, source, known_zero(by_hand))
    except WiringError as error:
        raise VerbError(str(error)) from None
    experiment = dataclasses.replace(assembly.experiment, name=_log_name(session))
    assembly = dataclasses.replace(assembly, experiment=experiment)
    if is_typed and not by_hand.is_sim:
        print("the motor is held under power and a muscle is filled: keep clear")
    with raw_keys() if is_typed else nullcontext():
        summary, result = by_hand.run(assembly, requests, line=False)
    # first, for the words may go to a pipe that is closed
    by_hand.keep_end(assembly.decoder, summary, result, jog.found_zero)
    print(filled(closing_text(summary, result, rig)))
    return points_of(taking.taken), exit_code(summary, result)


def _list(text: str, what: str) -> list[str]:
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if len(parts) < 2:
        raise VerbError(f"--{what}: found '{text}', expected at least two values: 'A, B, C'")
    return parts


def _pressure_steps(session: "Session") -> "list[Step]":
    """Fills from atmosphere up and down again, unless one way or a list is asked for."""
    from epa_rt.calibrate.taking import Step
    from epa_rt.config.units import UnitError
    from epa_rt.experiments.jogging import Fill, Vent, parse_order

    arguments, rig, row = session.arguments, session.rig, session.row
    muscle = next((m for m in rig.muscles if m.pressure == row.name), None)
    if muscle is None:
        raise VerbError(
            f"found {row.name}, which no muscle's valves can fill, expected a muscle's pressure, or"
            " --from with a table of references and readings"
        )
    top = HIGHEST_SHARE * (muscle.pressure_max - rig.atmosphere_pa)
    targets = [top * i / STEPS_UP for i in range(STEPS_UP + 1)]
    if arguments.steps is not None:
        try:
            orders = [
                parse_order(f"fill {muscle.name} {part}", rig)
                for part in _list(arguments.steps, "steps")
            ]
        except UnitError as error:
            raise VerbError(f"--steps: {error}") from None
        targets = [o.target_pa - rig.atmosphere_pa for o in orders if isinstance(o, Fill)]
    elif not (arguments.ascending or arguments.descending):
        targets = targets + targets[-2::-1]
    targets = _ordered(targets, targets, arguments)
    session.method = "the muscle filled in steps, the motor held, a gauge read at each"
    least = 1e3  # gauge: below, the exhaust is opened
    return [
        Step(
            (
                Vent((muscle.name,))
                if gauge < least
                else Fill(muscle.name, gauge + rig.atmosphere_pa),
            ),
            f"{muscle.name} at about {gauge / 1e3:.0f} kPa gauge",
        )
        for gauge in targets
    ]


def _travel_steps(session: "Session") -> "list[Step]":
    """The muscle is filled once; the motor pulls it from travel to travel."""
    from epa_rt.calibrate.taking import GoTo, Step
    from epa_rt.config.units import UnitError, parse_quantity
    from epa_rt.experiments.jogging import Fill, parse_order

    arguments, rig = session.arguments, session.rig
    if not rig.muscles:
        raise VerbError(f"found {rig.name} without a muscle, expected one to pull on")
    motor = rig.motor
    si_unit = rig.row(motor.position).si_unit
    try:
        fill = parse_order(f"fill {rig.muscles[0].name} {arguments.pressure}", rig)
        travels = [parse_quantity(part, si_unit) for part in _list(arguments.travels, "travels")]
    except UnitError as error:
        raise VerbError(f"--travels, --pressure: {error}") from None
    limits = rig.row(motor.position).limits
    for travel in travels:
        if limits is not None and not limits[0] < travel < limits[1]:
            raise VerbError(
                f"--travels: found {1e3 * travel:g} mm, expected within {1e3 * limits[0]:g} to"
                f" {1e3 * limits[1]:g} mm"
            )
    travels = _ordered(travels, travels, arguments)
    assert isinstance(fill, Fill)
    session.method = "the motor pulls against a reference cell"
    return [
        Step(
            ((fill,) if i == 0 else ()) + (GoTo(travel, motor.jog_speed_si),),
            f"motor at {1e3 * travel:.1f} mm",
        )
        for i, travel in enumerate(travels)
    ]
