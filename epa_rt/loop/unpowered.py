"""Watching a rig that has no power and no air: cycles in which only the safe outputs leave."""

from dataclasses import dataclass
from typing import Protocol

from epa_rt.backend import Backend, BackendError
from epa_rt.config.rig import Rig
from epa_rt.logs.layout import FLAG_STOP_REQUESTED, FLAG_WORKING_COUNTER_OK, SampleLayout
from epa_rt.loop.run import Recording, Requests
from epa_rt.signals.codec import Decoder, Encoder

STATES = ("unpowered",)
LOST_S = 1.0  # without sound process data; nothing moves, so there is time to say so


class Watcher(Protocol):
    """Takes each sound cycle; True once it has seen enough. ``phase`` and ``events``, which are
    drained: for the log.
    """

    phase: int
    events: list[tuple[str, str, dict[str, object]]]

    def step(self, cycle: int, measured: dict[str, float]) -> bool: ...


@dataclass(frozen=True)
class Watched:
    """How it ended: 'completed', 'stopped' or 'failed', and why."""

    outcome: str
    cause: str
    cycles: int
    t_ns: int


def unpowered_layout(rig: Rig, decoder: Decoder, phases: tuple[str, ...]) -> SampleLayout:
    """Columns of the log of such a watch: what was measured, and the safe commands."""
    encoder = Encoder(rig)
    return SampleLayout(
        decoder.size, encoder.size, tuple(decoder.measured), (), tuple(encoder.safe), (), STATES,
        phases,
    )  # fmt: skip


def watch_unpowered(
    rig: Rig,
    backend: Backend,
    decoder: Decoder,
    watcher: Watcher,
    recording: Recording,
    requests: Requests,
) -> Watched:
    """Opens the backend, keeps it at the safe outputs until the watcher has seen enough or somebody
    stops it, and closes it. The drive is never enabled and no valve is switched.
    """
    encoder = Encoder(rig)
    safe_raw, safe = encoder.safe_raw, encoder.safe
    cycle, t_ns, outcome, cause = -1, 0, "completed", ""
    lost, most_lost = 0, round(LOST_S / rig.period_s)
    try:
        backend.open()
        done = False
        while not done:
            exchange = backend.exchange(safe_raw)
            cycle, t_ns = exchange.cycle, exchange.t_ns
            measured = decoder.decode(exchange.inputs_raw)
            request = requests.poll(cycle)
            is_ok = exchange.working_counter_ok
            flags = FLAG_WORKING_COUNTER_OK * is_ok | FLAG_STOP_REQUESTED * bool(request)
            lost = 0 if is_ok else lost + 1
            if is_ok:
                done = watcher.step(cycle, measured)
            recording.sample(
                cycle, t_ns, flags, 0, watcher.phase, exchange.lateness_ns, exchange.busy_ns,
                decoder.invalid, decoder.stale, exchange.inputs_raw, safe_raw, measured, {}, safe,
                {},
            )  # fmt: skip
            for told in (backend.events, watcher.events):
                for kind, text, data in told:
                    recording.event(cycle, t_ns, kind, text, **data)
                told.clear()
            if request and not done:
                outcome, cause, done = "stopped", "the operator asked to stop", True
            elif lost > most_lost:
                raise BackendError(f"no sound process data for {LOST_S:g} s")
            elif recording.failure:
                outcome, cause, done = "failed", recording.failure, True
    except BackendError as error:
        outcome, cause = "failed", str(error)
        recording.event(max(cycle, 0), t_ns, "error", cause)
    finally:
        backend.close()
    return Watched(outcome, cause, cycle + 1, t_ns)
