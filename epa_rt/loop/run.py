"""run(): the one cycle that drives hardware, simulation and replay alike."""

import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from epa_rt.backend import Backend, BackendError, Event
from epa_rt.config.rig import Rig
from epa_rt.control.protocol import Controller
from epa_rt.logs.layout import (
    FLAG_OVERRUN,
    FLAG_RECORDER_FAILED,
    FLAG_STOP_AT_ONCE,
    FLAG_STOP_REQUESTED,
    FLAG_TRIPPED,
    FLAG_WORKING_COUNTER_OK,
)
from epa_rt.loop.end_state import EndState
from epa_rt.loop.gaps import Gaps
from epa_rt.loop.overruns import Overruns
from epa_rt.loop.requests import STOP, STOP_AT_ONCE
from epa_rt.loop.supervisor import BRAKE, DONE, SAFE, Supervisor
from epa_rt.safety.envelope import Envelope
from epa_rt.safety.stopping import BRAKING
from epa_rt.safety.trip import Trip
from epa_rt.signals.codec import Decoder, Encoder

INTERNAL = "internal error"


class Recording(Protocol):
    """What the loop needs of a recorder; a replay puts its comparison here."""

    def sample(self, *values: object) -> None: ...

    def event(self, cycle: int, t_ns: int, kind: str, text: str, /, **data: object) -> None: ...

    @property
    def failure(self) -> str | None: ...


class Requests(Protocol):
    def poll(self, cycle: int) -> int: ...


@dataclass(frozen=True)
class RunResult:
    """How a run ended. ``outcome``: completed, stopped, tripped or failed. ``confirmed``: the drive
    was found to be off. ``end``: the rig as it was measured last; None where no cycle ran.
    ``category``: how a trip stopped it, in words.

    ``clamped`` and ``slewed``: cycles in which the gate cut a row; ``controller_`` the same by row
    and loop, of what the controller had cut before, so that the gate found nothing to cut.
    """

    outcome: str
    cause: str
    cycles: int
    confirmed: bool
    overruns: int
    worst_lateness_ns: int
    clamped: dict[str, int] = field(default_factory=dict)
    slewed: dict[str, int] = field(default_factory=dict)
    controller_clamped: dict[str, dict[str, int]] = field(default_factory=dict)
    controller_slewed: dict[str, dict[str, int]] = field(default_factory=dict)
    trip: Trip | None = None
    t_ns: int = 0  # the last cycle's stamp
    saturated: int = 0  # counts that did not fit their entry
    bad_cycles: int = 0  # without sound process data
    end: EndState | None = None
    category: str = ""
    hints: tuple[str, ...] = ()  # what to calibrate
    position_lost: bool = False  # the motor's count was found wrong, at the trip or after it


@dataclass
class _Now:
    """Where the loop stands: kept apart, so that an error leaves it readable."""

    outputs_raw: bytes
    cycle: int = -1
    t_ns: int = 0
    stopped: bool = False


def run(
    rig: Rig,
    backend: Backend,
    supervisor: Supervisor,
    envelope: Envelope,
    decoder: Decoder,
    encoder: Encoder,
    recording: Recording,
    requests: Requests,
) -> RunResult:
    """Runs an experiment from bring-up until the rig is at rest. Never raises for what the rig
    does: every way out is a result.

    The backend is opened and closed here; closing puts the outputs into their safe state once more.
    A first fault of this program brakes by the envelope, as a trip does; after a second one the
    envelope brakes and vents alone, unrecorded.
    """
    overruns, gaps, now, broken, lost_bus = (
        Overruns(rig.overrun, rig.period_s),
        Gaps(),
        _Now(encoder.safe_raw),
        "",
        "",
    )
    alone = ""  # how the rig was stopped after a second fault of this program
    told = backend.events  # of a bus: recoveries, emergencies, the clock's lock
    parts = (backend, supervisor, envelope, decoder, encoder, recording, requests, overruns, gaps)
    try:
        backend.open()
        try:
            _exchange_until_done(now, told, *parts)
        except BackendError:
            raise
        except Exception as error:
            broken = _own_fault(error, recording, now)
            envelope.trip(INTERNAL, "", broken.removeprefix(f"{INTERNAL}: "), now.cycle + 1)
            _exchange_until_done(now, told, *parts)
    except BackendError as error:
        lost_bus = str(error)
        recording.event(max(now.cycle, 0), now.t_ns, "error", lost_bus)
    except Exception as error:  # the second fault of ours: without all that may have failed
        broken = "; ".join(filter(None, (broken, _own_fault(error, recording, now))))
        try:
            alone = _stop_alone(rig, now, backend, envelope, decoder, encoder)
        except Exception as third:
            broken = f"{broken}; then {type(third).__name__}: {third}"
    finally:
        closing = _close(backend, recording, now.cycle, now.t_ns)
        broken = "; ".join(filter(None, (broken, lost_bus, closing)))
        _pass_on(told, recording, now.cycle, now.t_ns)
    end = _end_state(rig, supervisor, decoder, broken, bool(lost_bus), alone, now.cycle)
    if end is not None:  # the drive's last word, where the bus heard it
        end = end.heard_at_closing(backend.drive_off)
    return _result(envelope, supervisor, overruns, broken, now, encoder.saturated, gaps.count, end)


def _exchange_until_done(
    now: _Now,
    told: list[Event],
    backend: Backend,
    supervisor: Supervisor,
    envelope: Envelope,
    decoder: Decoder,
    encoder: Encoder,
    recording: Recording,
    requests: Requests,
    overruns: Overruns,
    gaps: Gaps,
) -> None:
    """Cycle after cycle until the supervisor is done. Whatever is raised, ``now`` says where."""
    outputs_raw, cycle, t_ns, stopped = now.outputs_raw, now.cycle, now.t_ns, now.stopped
    sequence = supervisor.sequence
    try:
        while supervisor.state != DONE:
            exchange = backend.exchange(outputs_raw)
            cycle, t_ns, inputs_raw, bus_ok, lateness_ns, busy_ns, read_ns = exchange
            measured = decoder.decode(inputs_raw)
            request = requests.poll(cycle)
            flags = FLAG_WORKING_COUNTER_OK if bus_ok else 0
            if (not bus_ok or gaps.in_a_row) and (sentence := gaps.step(bus_ok)):
                recording.event(cycle, t_ns, "gap", sentence)
            if lateness_ns or overruns.level_s or request or recording.failure:
                flags |= _judge(cycle, lateness_ns, request, recording, overruns, envelope)
            stopped = stopped or request != 0 or overruns.wants_stop
            command = _step(supervisor, cycle, measured, stopped, bus_ok)
            outputs = envelope.check(
                cycle,
                bus_ok,
                measured,
                decoder.invalid,
                decoder.stale,
                command,
                read_ns,
                supervisor.fault,
            )
            trip = envelope.tripped
            if trip is not None:
                flags |= FLAG_TRIPPED
                supervisor.after_trip(trip, envelope.stopping, measured, bus_ok)
                if trip.cycle != cycle:
                    command = outputs  # nobody asks for more than what leaves
            if supervisor.state >= SAFE:
                outputs = envelope.power_off()
            outputs_raw = encoder.encode(outputs)
            recording.sample(
                cycle,
                t_ns,
                flags,
                supervisor.state,
                sequence.phase_index,
                lateness_ns,
                busy_ns,
                decoder.invalid,
                decoder.stale,
                inputs_raw,
                outputs_raw,
                measured,
                supervisor.reference,
                command,
                supervisor.estimate,
            )
            if supervisor.events or (trip is not None and trip.cycle == cycle):
                _report(supervisor, envelope, recording, cycle, t_ns)
            if told:
                _pass_on(told, recording, cycle, t_ns)
    finally:
        now.outputs_raw, now.cycle, now.t_ns, now.stopped = outputs_raw, cycle, t_ns, stopped


def _stop_alone(
    rig: Rig, now: _Now, backend: Backend, envelope: Envelope, decoder: Decoder, encoder: Encoder
) -> str:
    """Bus, decoder, envelope and encoder brake and vent by themselves, for ``rest_timeout`` at
    most; how that ended, in words, or nothing where there was no power to hold with.
    """
    full = [(m.pressure, rig.atmosphere_pa + rig.vented_pa(m)) for m in rig.muscles]
    for _ in range(round(rig.safety.rest_timeout / rig.period_s)):
        exchange = backend.exchange(now.outputs_raw)
        now.cycle, now.t_ns = exchange.cycle, exchange.t_ns
        measured = decoder.decode(exchange.inputs_raw)
        outputs = envelope.check(
            exchange.cycle,
            exchange.working_counter_ok,
            measured,
            decoder.invalid,
            decoder.stale,
            {},
            exchange.read_ns,
        )
        now.outputs_raw = encoder.encode(outputs)
        if envelope.stopping.category != BRAKING:
            return ""
        if all(measured[name] <= vented_pa for name, vented_pa in full):
            return "the envelope braked and vented alone, then closing took the power off"
    return "the envelope braked alone, and closing took the power off before all was vented"


def _own_fault(error: Exception, recording: Recording, now: _Now) -> str:
    """A fault of this program, in the log with its traceback; the sentence."""
    text, trace = f"{INTERNAL}: {type(error).__name__}: {error}", traceback.format_exc()
    recording.event(max(now.cycle, 0), now.t_ns, "error", text, traceback=trace)
    return text


def _end_state(
    rig: Rig,
    supervisor: Supervisor,
    decoder: Decoder,
    broken: str,
    has_lost_bus: bool,
    alone: str,
    cycle: int,
) -> EndState | None:
    """What was measured last. A run that broke off under way knows only what it saw then."""
    if cycle < 0:
        return None
    if supervisor.state == DONE or not broken:
        return supervisor.end_state()
    if supervisor.state <= BRAKE:
        try:
            supervisor.look(decoder.measured)
        except Exception as error:  # looking may be what failed; the run has its cause already
            broken = f"{broken}; then {type(error).__name__}: {error}"
    end = supervisor.end_state()
    text = "what came after, for exchanging ended while the rig was not yet at rest"
    if alone:
        text += f"; {alone}"
    elif supervisor.held_power and not has_lost_bus:
        text += "; closing took the power off and let the air out at once, whatever moved"
    elif supervisor.held_power and rig.drive.interface == "cia402":
        text += (
            "; a drive with supply brakes and holds by itself (0x6007, 0x605A) until voltage off"
        )
    elif supervisor.held_power:
        text += (
            "; the wired drive loses its enable, and so its torque, by the watchdog at the latest"
        )
    return end.lost(text)


def _pass_on(told: list[Event], recording: Recording, cycle: int, t_ns: int) -> None:
    for kind, text, data in told:
        recording.event(max(cycle, 0), t_ns, kind, text, **data)
    told.clear()


def _close(backend: Backend, recording: Recording, cycle: int, t_ns: int) -> str:
    """Closes the backend; a sentence where even that fails, which must not hide how the run
    ended.
    """
    try:
        backend.close()
    except Exception as error:
        recording.event(
            max(cycle, 0),
            t_ns,
            "error",
            f"closing failed: {error}",
            traceback=traceback.format_exc(),
        )
        return f"closing failed: {error}"
    return ""


def _judge(
    cycle: int,
    lateness_ns: int,
    request: int,
    recording: Recording,
    overruns: Overruns,
    envelope: Envelope,
) -> int:
    """What came from outside the process image in this cycle, as flags; trips where it must."""
    flags = 0
    before = overruns.count
    policy = overruns.step(lateness_ns)
    if overruns.count > before:
        flags |= FLAG_OVERRUN
    if policy == "trip":
        envelope.trip("overrun", "", overruns.text, cycle)
    if request >= STOP:
        flags |= FLAG_STOP_REQUESTED
    if request >= STOP_AT_ONCE:
        flags |= FLAG_STOP_AT_ONCE
        envelope.trip("operator", "", "the operator asked to stop at once", cycle)
    failure = recording.failure
    if failure:
        flags |= FLAG_RECORDER_FAILED
        envelope.trip("recorder", "", failure, cycle)
    return flags


def _step(
    supervisor: Supervisor, cycle: int, measured: dict[str, float], stopped: bool, bus_ok: bool
) -> dict[str, float]:
    """The supervisor's command; an error of ours in it becomes a fault that trips. One while it
    ends a run is raised: nothing would end it then.
    """
    try:
        return supervisor.step(cycle, measured, stopped, bus_ok)
    except Exception as error:  # must not leave the rig under its last command
        if supervisor.state >= BRAKE:
            raise
        supervisor.fault = supervisor.fault or (INTERNAL, "", f"{type(error).__name__}: {error}")
        return supervisor.command


def _report(
    supervisor: Supervisor, envelope: Envelope, recording: Recording, cycle: int, t_ns: int
) -> None:
    trip = envelope.tripped
    if trip is not None and trip.cycle == cycle:
        recording.event(cycle, t_ns, "trip", str(trip), cause=trip.cause, signal=trip.signal)
    for kind, text, data in supervisor.events:
        recording.event(cycle, t_ns, kind, text, **data)
    supervisor.events.clear()


def _result(
    envelope: Envelope,
    supervisor: Supervisor,
    overruns: Overruns,
    broken: str,
    now: _Now,
    saturated: int,
    bad_cycles: int,
    end: EndState | None,
) -> RunResult:
    trip, motions = envelope.tripped, supervisor.motions
    if broken:
        outcome, cause = (
            "failed",
            broken if trip is None or broken.startswith(str(trip)) else f"{trip}; then {broken}",
        )
    elif trip is not None:
        outcome, cause = "tripped", str(trip)
    elif now.stopped:
        outcome, cause = (
            "stopped",
            (f"overruns: {overruns.text}" if overruns.wants_stop else "the operator asked to stop"),
        )
    else:
        outcome, cause = "completed", ""
    gate = envelope.gate
    return RunResult(
        outcome,
        cause,
        now.cycle + 1,
        bool(end is not None and end.off),
        overruns.count,
        overruns.worst_ns,
        {k: n for k, n in gate.clamped.items() if n},
        {k: n for k, n in gate.slewed.items() if n},
        _by_row(motions, lambda motion: motion.saturated),
        _by_row(motions, lambda motion: motion.slewed),
        trip,
        now.t_ns,
        saturated,
        bad_cycles,
        end,
        supervisor.category,
        supervisor.hints,
        envelope.position_lost,
    )


def _by_row(
    motions: Mapping[str, Controller], count: Callable[[Controller], int]
) -> dict[str, dict[str, int]]:
    """Counts of loops by the row that each writes, without those of nothing."""
    found: dict[str, dict[str, int]] = {}
    for loop, motion in motions.items():
        for row in motion.writes if count(motion) else ():
            found.setdefault(row, {})[loop] = count(motion)
    return found
