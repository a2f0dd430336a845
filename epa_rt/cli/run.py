"""Run an experiment on a rig and record it.

On the simulated rig (--backend sim) it goes as fast as the machine can, or paced with --speed (1 =
real time); on the real one, or an emulated bus, by its wire (--backend ethercat --interface IF).
Every run leaves one MCAP log that opens in Foxglove and PlotJuggler and can be replayed.

Ctrl-C brakes, holds the motor under power while the muscles vent, and takes the power off when the
rig is at rest. A second Ctrl-C, 300 cycles after the first or later (a sooner one counts as the
same), takes power off and lets the air out at once, whatever the motor is doing: a stretched muscle
then throws it. The last lines say how the rig was left, as measured.

  epa run config/experiments/identification.yaml --rig config/rigs/bench.yaml -o out
  epa run config/experiments/knee_chirp.yaml --rig config/rigs/knee.yaml --speed 1 -o out
  epa run config/experiments/step.yaml --rig config/rigs/bench.yaml --speed 1 --live
  epa run config/experiments/knee_chirp.yaml --rig config/rigs/knee.yaml --dry       moves nothing
  epa run config/experiments/identification.yaml --rig config/rigs/bench.yaml --resume LOG -o out
                                     LOG was broken off: only the trials that it lacks
"""

import argparse
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.duration import duration_words
from epa_rt.cli.exits import COMPLETED, DIFFERENT, FAILED, OF_OUTCOME, VerbError, code_of_run
from epa_rt.cli.inputs import (
    Inputs,
    add_backend_arguments,
    add_input_arguments,
    add_simulation_arguments,
    add_supply_argument,
    load_inputs,
)
from epa_rt.cli.live import add_view_arguments, opened, views_wanted
from epa_rt.cli.log_name import check_free, take_log_path
from epa_rt.cli.outputs import add_json_argument
from epa_rt.cli.run_end import end_facts, json_text
from epa_rt.cli.run_record import add_record_arguments, record_attachment
from epa_rt.cli.screen_text import filled
from epa_rt.cli.write import check_writable, write_whole
from epa_rt.cli.zero import is_emulated, kind_of_rig

if TYPE_CHECKING:
    from epa_rt.backend import Backend
    from epa_rt.config.rig import Rig
    from epa_rt.live.start import Views
    from epa_rt.logs.recorder import LogSummary, Recorder
    from epa_rt.loop.assembly import Assembly
    from epa_rt.loop.requests import OperatorRequests
    from epa_rt.loop.run import RunResult

EMULATED = {"bus": "emulated"}  # of a log's facts: no rig was there
LOST_FRAMES = "lost working counter"
BUSY_MACHINE = (
    "note: an emulated bus and the loop share this machine, and where it is busy frames come too"
    " late; epa bus run --lock-step does without real time"
)


def add_arguments(verb: argparse.ArgumentParser) -> None:
    add_input_arguments(verb)
    add_backend_arguments(verb)
    add_supply_argument(verb)
    verb.add_argument(
        "-o",
        "--out",
        type=Path,
        default=Path("out"),
        help="folder for the log, or a name that ends in .mcap",
    )
    add_simulation_arguments(verb)
    verb.add_argument(
        "--resume",
        type=Path,
        metavar="LOG",
        help="go on with the first repetition that LOG, broken off, does not hold whole",
    )
    verb.add_argument(
        "--dry",
        action="store_true",
        help="plot and check the profiles against the limits; nothing moves",
    )
    verb.add_argument("--quiet", action="store_true", help="no progress line")
    add_record_arguments(verb)
    add_json_argument(verb, "the end of the run for machines (docs/runs.md)")
    add_view_arguments(verb)


def main(arguments: argparse.Namespace) -> int:
    check_writable(arguments.json, (".json",))
    is_sim = arguments.backend == "sim"
    inputs = load_inputs(
        arguments.experiment,
        arguments.rig,
        arguments.plant,
        with_plant=is_sim and not arguments.dry,
        with_zero=not is_sim and not arguments.dry,
        emulated=is_emulated(arguments),
    )
    for sentence in inputs.unprotected:
        print(f"UNPROTECTED: {sentence}", file=sys.stderr)
    if arguments.resume is not None:
        from epa_rt.cli.resume import resumed_inputs

        found = resumed_inputs(inputs, arguments.resume, kind_of_rig(arguments))
        if found is None:
            return COMPLETED
        inputs = found
    if arguments.dry:
        return _dry(inputs, arguments.out)
    record = record_attachment(inputs.rig, arguments.rig, arguments.operator, arguments.note)
    inputs = replace(inputs, attachments=inputs.attachments | record)
    from epa_rt.live.start import Views

    with Views(views_wanted(arguments, arguments.live)) as views:
        opened(views, inputs.rig.realtime.core)
        rig, out = arguments.rig, arguments.out
        summary, result = driven(
            arguments, inputs, out, rig, arguments.seed, arguments.speed, views=views
        )
    code = exit_code(summary, result)
    print(filled(closing_text(summary, result, inputs.rig)))
    if arguments.json:
        facts = end_facts(summary, result, inputs.rig, code)
        write_whole(arguments.json, json_text(facts) + "\n")
    return code


def exit_code(summary: "LogSummary", result: "RunResult") -> int:
    """The outcome, a log that is not whole, and how the rig was left; a run without a cycle left
    nothing.
    """
    outcome = "failed" if result.outcome == "completed" and summary.failure else result.outcome
    end = result.end
    if end is None:
        return OF_OUTCOME[outcome]
    return code_of_run(outcome, bool(end.at_rest), bool(end.vented), bool(end.off))


def _dry(inputs: Inputs, out: Path) -> int:
    from epa_rt.cli.dry import show_dry_run

    _assembled(inputs)
    return DIFFERENT if show_dry_run(inputs.experiment, inputs.rig, out) else COMPLETED


def _assembled(inputs: Inputs) -> "Assembly":
    from epa_rt.loop.assembly import WiringError, assemble

    try:
        return assemble(inputs.rig, inputs.experiment)
    except WiringError as error:
        raise VerbError(str(error)) from None


def driven(
    arguments: argparse.Namespace,
    inputs: Inputs,
    out: Path,
    rig_path: Path,
    seed: int,
    speed: float | None,
    views: "Views | None" = None,
    requests: "OperatorRequests | None" = None,
) -> "tuple[LogSummary, RunResult]":
    """One run, recorded into ``out``, on the rig that the backend's arguments say; before it starts
    it says how long that takes, unless --quiet. ``seed``, ``speed``: of a simulated one. Raises
    VerbError.
    """
    check_free(out)
    progress = not arguments.quiet
    if progress:
        takes = f"{inputs.experiment.name} takes {duration_words(inputs.experiment)}"
        print(filled(takes, sys.stderr), file=sys.stderr, flush=True)
    if arguments.backend == "sim":
        return run_simulated(inputs, out, seed, speed, progress, views=views, requests=requests)
    return run_on_bus(
        inputs,
        out,
        arguments.interface,
        arguments.lock_step,
        progress,
        rig_path,
        arguments.take_over,
        arguments.supply_stayed_on,
        views=views,
        requests=requests,
    )


def run_simulated(
    inputs: Inputs,
    out: Path,
    seed: int,
    speed: float | None,
    progress: bool,
    views: "Views | None" = None,
    requests: "OperatorRequests | None" = None,
) -> "tuple[LogSummary, RunResult]":
    """One run on the simulated rig, recorded into ``out``. Raises VerbError where the log cannot be
    opened.
    """
    backend = _simulated_backend(inputs, seed, speed, progress)
    run_facts = {
        "rig": inputs.rig.name,
        "experiment": inputs.experiment.name,
        "plant": inputs.plant.name,
        "backend": "sim",
        "seed": str(seed),
        "speed": "unpaced" if speed is None else f"{speed:g}",
        "period_s": f"{inputs.rig.period_s:g}",
    }
    return run_recorded(
        inputs,
        backend,
        out,
        run_facts,
        speed is not None,
        progress=progress,
        requests=requests,
        views=views,
    )


def run_on_bus(
    inputs: Inputs,
    out: Path,
    interface: str | None,
    lock_step: bool,
    progress: bool,
    rig_path: Path,
    take_over: bool = False,
    supply_stayed_on: bool = False,
    views: "Views | None" = None,
    requests: "OperatorRequests | None" = None,
) -> "tuple[LogSummary, RunResult]":
    """One run on an EtherCAT bus, recorded into ``out``. Raises VerbError where the log or the
    interface cannot be had, or a wired drive has no zero file.
    """
    from drivers.backend_factory import open_ethercat
    from drivers.interface import is_emulated_bus
    from epa_rt.backend import BackendError
    from epa_rt.cli.calibration_age import refuse_simulated
    from epa_rt.cli.zero import keep_end, need_known_count, need_zero_file

    emulated = is_emulated_bus(interface)
    if not emulated:
        refuse_simulated(inputs.rig)
    need_zero_file(inputs.rig, rig_path, emulated)
    need_known_count(inputs.rig, rig_path, supply_stayed_on or emulated)
    try:
        backend = open_ethercat(inputs.rig, interface, lock_step, take_over)
    except BackendError as error:
        raise VerbError(str(error), FAILED) from None
    run_facts = {
        "rig": inputs.rig.name,
        "experiment": inputs.experiment.name,
        "backend": "ethercat",
        "speed": "lock step" if lock_step else "1",
        "period_s": f"{inputs.rig.period_s:g}",
    } | (EMULATED if emulated else {})
    assembly = _assembled(inputs)
    summary, result = run_recorded(
        inputs, backend, out, run_facts, not lock_step, progress, assembly, requests, views
    )
    found_zero = assembly.supervisor.found_zero
    keep_end(inputs.rig, rig_path, assembly.decoder, summary, result, found_zero, emulated)
    if emulated and not lock_step and result.cause.startswith(LOST_FRAMES):
        print(filled(BUSY_MACHINE, sys.stderr), file=sys.stderr)
    return summary, result


def _simulated_backend(inputs: Inputs, seed: int, speed: float | None, progress: bool) -> "Backend":
    from epa_rt.cli.progress import said_when_slow

    said = "loading the plant; compiled the first time, a minute or two ..."
    with said_when_slow(said) if progress else nullcontext():
        from sim_backend.backend import SimBackend

        backend = SimBackend(inputs.rig, inputs.plant, seed, speed)
        backend.model.warm_up()
    return backend


def run_recorded(
    inputs: Inputs,
    backend: "Backend",
    out: Path,
    run_facts: dict[str, str],
    paced: bool,
    progress: bool,
    assembly: "Assembly | None" = None,
    requests: "OperatorRequests | None" = None,
    views: "Views | None" = None,
) -> "tuple[LogSummary, RunResult]":
    """A run on any backend with its recorder; ``out`` as in take_log_path. Real-time rights are
    asked for where the run is paced. ``assembly``: where it is not that of the experiment.
    ``views``: of the run, which begin here.
    """
    from epa_rt.cli.calibration_age import facts as calibration_facts
    from epa_rt.cli.calibration_age import old_words
    from epa_rt.cli.zero import zero_words
    from epa_rt.logs.progress import ProgressSpec
    from epa_rt.logs.recorder import Recorder, RecorderError
    from epa_rt.loop.requests import OperatorRequests
    from epa_rt.loop.viewers import ViewerRequests

    assembly = assembly or _assembled(inputs)
    for sentence in old_words(inputs.rig):
        print(f"OLD CALIBRATION: {sentence}", file=sys.stderr)
    words = zero_words(inputs.rig, run_facts["backend"])
    run_facts = run_facts | {"zero": words}
    assembly.supervisor.events[:0] = [("zero", words, {})]
    cycles = round(inputs.experiment.duration_s / inputs.rig.period_s)
    log = take_log_path(out, inputs)
    requests = requests or OperatorRequests(inputs.rig.period_s)
    requests.log = assembly.supervisor.events
    viewers = ViewerRequests(requests)
    recorder = Recorder(
        log,
        assembly.layout,
        inputs.attachments,
        {
            "run": run_facts,
            **unprotected_facts(inputs),
            **calibration_facts(inputs.rig),
            **inputs.metadata,
        },
        lossless=not paced,
        progress=ProgressSpec(cycles, inputs.rig.period_s, progress),
        asks_fd=viewers.recorders_fd,
        may_wait=run_facts["backend"] == "sim",
    )
    try:
        recorder.open()
    except RecorderError as error:
        viewers.close()
        if not log.stat().st_size:
            log.unlink()  # taken, and nothing came of it
        raise VerbError(str(error), FAILED) from None
    assembly.supervisor.events[:0] = [("unprotected", text, {}) for text in inputs.unprotected]
    with viewers.taken(), requests.listening(views.notice() if views else None):
        if views is not None:  # here, for a Ctrl-C meanwhile is the run's already
            views.begin(log)
        return _run(assembly, backend, recorder, requests, paced)


def unprotected_facts(inputs: Inputs) -> dict[str, dict[str, str]]:
    """What the rig does without, for the log's metadata; nothing where it is protected."""
    if not inputs.unprotected:
        return {}
    return {"unprotected": {str(i): text for i, text in enumerate(inputs.unprotected)}}


def _run(
    assembly: "Assembly", backend: "Backend", recorder: "Recorder", requests: object, paced: bool
) -> "tuple[LogSummary, RunResult]":
    from epa_rt.loop.run import run
    from epa_rt.realtime.process import undisturbed

    outcome, cause, end = "failed", "the loop ended by an error of its own", "not known"
    try:
        with undisturbed(assembly.rig.realtime if paced else None) as sentences:
            assembly.supervisor.events[:0] = [("realtime", sentence, {}) for sentence in sentences]
            result = run(
                assembly.rig,
                backend,
                assembly.supervisor,
                assembly.envelope,
                assembly.decoder,
                assembly.encoder,
                recorder,
                requests,
            )
        outcome, cause = result.outcome, result.cause
        end = end_text(result, assembly.rig)
        facts = {
            "cycles": result.cycles,
            "overruns": result.overruns,
            "worst_lateness_ns": result.worst_lateness_ns,
            "drive_off_confirmed": result.confirmed,
            "clamped": result.clamped,
            "slewed": result.slewed,
            "controller_clamped": result.controller_clamped,
            "controller_slewed": result.controller_slewed,
            "saturated": result.saturated,
            "bad_cycles": result.bad_cycles,
            "category": result.category,
            "end": result.end.facts() if result.end else None,
            "end_text": end,
        }
        recorder.event(
            result.cycles - 1,
            result.t_ns,
            "summary",
            f"{outcome}{': ' + cause if cause else ''}",
            **facts,
        )
    finally:
        summary = recorder.close(outcome, cause, end)
    return summary, result


def end_text(result: "RunResult", rig: "Rig") -> str:
    """How the rig was left: what was measured, and what was not."""
    if result.end is None:
        return "end: not known, for no cycle was exchanged"
    return result.end.text(rig, rig.safety.rest_timeout)


def closing_text(summary: "LogSummary", result: "RunResult", rig: "Rig") -> str:
    """What the operator reads at the end of a run."""
    period_s = rig.period_s
    lines = [
        f"{result.outcome}{': ' + result.cause if result.cause else ''}",
        *([result.category] if result.category else []),
        (
            f"{_count(result.cycles, 'cycle')} ({result.cycles * period_s:.1f} s),"
            f" {_count(result.overruns, 'overrun')}, {_count(summary.samples, 'sample')} and"
            f" {_count(summary.events, 'event')} recorded"
        ),
    ]
    if summary.samples != result.cycles:
        lines.append(f"LOST: {result.cycles - summary.samples} samples are not in the log")
    if summary.failure:
        lines.append(f"recorder: {summary.failure}")
    if result.bad_cycles:
        lines.append(f"{_count(result.bad_cycles, 'cycle')} without sound process data")
    for words, counts, before in (
        ("clamped to its limits", result.clamped, result.controller_clamped),
        ("slowed to its slew limit", result.slewed, result.controller_slewed),
    ):
        lines += [
            f"{name} was {words} by the gate in {_count(count, 'cycle')}"
            for name, count in counts.items()
        ]
        lines += [
            f"{name} was {words} by the controller {loop} in {_count(count, 'cycle')}"
            for name, loops in before.items()
            for loop, count in loops.items()
        ]
    if result.saturated:
        lines.append(f"{result.saturated} values did not fit their entry and were cut")
    lines += [f"hint: {text}" for text in result.hints]
    lines.append(end_text(result, rig))
    lines.append(f"log: {summary.path} ({summary.size_bytes / 1e6:.1f} MB)")
    return "\n".join(lines)


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' if number != 1 else ''}"
