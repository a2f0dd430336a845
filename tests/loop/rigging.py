"""A run in memory for the tests of the loop: simulated rig, recording kept in lists, faults put in
between.
"""

from dataclasses import dataclass, field
from pathlib import Path

from epa_rt.backend import BackendError, Exchange
from epa_rt.cli.inputs import Inputs, load_inputs
from epa_rt.loop.assembly import Assembly, assemble
from epa_rt.loop.run import RunResult, run
from sim_backend.backend import SimBackend

ROOT = Path(__file__).resolve().parents[2]

TINY = """
experiment: tiny
loop: {loop}
seed: 1
phases:
  - {{name: fill, valves: {{all: {{set: {pressure}}}}}, until: valves_settled, timeout: 30 s}}
  - {{name: out, move: {{to: 10 mm, speed: 40 mm/s}}}}
  - {{name: trial, trial: true, random_speed: {{between: [2 mm, 26 mm], speed: 50 mm/s}}, for: 2 s, valves: {{all: hold}}}}
  - {{name: return, move: {{to: no_load, speed: 40 mm/s}}}}
  - {{name: vent, valves: {{all: vent}}, until: valves_settled, timeout: 30 s}}
"""  # noqa: E501


@dataclass
class Memory:
    """A Recording that keeps everything; ``fail_at`` is the cycle from which it reports a
    failure.
    """

    samples: list[tuple] = field(default_factory=list)
    events: list[tuple[int, str, str, dict]] = field(default_factory=list)
    fail_at: int | None = None

    def sample(
        self,
        cycle,
        t_ns,
        flags,
        state,
        phase,
        lateness_ns,
        busy_ns,
        invalid,
        stale,
        inputs_raw,
        outputs_raw,
        measured,
        reference,
        command,
        estimate,
    ) -> None:
        self.samples.append(
            (
                cycle,
                flags,
                state,
                phase,
                inputs_raw,
                outputs_raw,
                dict(measured),
                dict(reference),
                dict(command),
            )
        )

    def event(self, cycle, t_ns, kind, text, /, **data) -> None:
        self.events.append((cycle, kind, text, data))

    @property
    def failure(self) -> str | None:
        return (
            "recorder died (signal 9)"
            if self.fail_at is not None and len(self.samples) >= self.fail_at
            else None
        )

    @property
    def states(self) -> list[int]:
        order: list[int] = []
        for sample in self.samples:
            if not order or order[-1] != sample[2]:
                order.append(sample[2])
        return order


class Quiet:
    """Requests: nothing, or stops at given cycles."""

    def __init__(self, stop_at: int = 1 << 60, stop_at_once_at: int = 1 << 60):
        self.stop_at, self.stop_at_once_at = stop_at, stop_at_once_at

    def poll(self, cycle: int) -> int:
        return 2 if cycle >= self.stop_at_once_at else int(cycle >= self.stop_at)


class Between:
    """A backend around the simulated one that hurts what comes in: ``hurt(exchange, model) ->
    Exchange``.
    """

    def __init__(self, inner: SimBackend, hurt=None):
        self.inner, self.period_s, self.hurt = inner, inner.period_s, hurt
        self.sent: list[bytes] = []
        self.closed = 0
        self.events, self.drive_off = inner.events, inner.drive_off

    def open(self) -> None:
        self.inner.open()

    def exchange(self, outputs_raw: bytes) -> Exchange:
        self.sent.append(outputs_raw)
        exchange = self.inner.exchange(outputs_raw)
        return self.hurt(exchange, self.inner.model) if self.hurt else exchange

    def close(self) -> None:
        self.closed += 1
        self.inner.close()


@dataclass
class Outcome:
    result: RunResult
    memory: Memory
    backend: Between
    assembly: Assembly


def tiny_inputs(
    folder: Path, rig: str = "bench", loop: str = "motor_speed", pressure: str = "500 kPa gauge"
) -> Inputs:
    path = folder / "tiny.yaml"
    path.write_text(TINY.format(loop=loop, pressure=pressure))
    return load_inputs(path, ROOT / f"config/rigs/{rig}.yaml", None, with_plant=True)


def run_in_memory(
    inputs: Inputs, hurt=None, requests=None, memory: Memory | None = None, prepare=None, pace=None
) -> Outcome:
    """One run on the simulated rig; ``prepare(assembly, model)`` may change things before it
    starts. ``pace``: what it waits for, as ``realtime.pace.Pace``; None runs as fast as it goes.
    """
    assembly = assemble(inputs.rig, inputs.experiment)
    backend = Between(SimBackend(inputs.rig, inputs.plant, 1), hurt)
    backend.inner._pace = pace
    memory = memory or Memory()
    if prepare:
        prepare(assembly, backend.inner.model)
    result = run(
        inputs.rig,
        backend,
        assembly.supervisor,
        assembly.envelope,
        assembly.decoder,
        assembly.encoder,
        memory,
        requests or Quiet(),
    )
    return Outcome(result, memory, backend, assembly)


__all__ = [
    "BackendError",
    "Between",
    "Exchange",
    "Memory",
    "Outcome",
    "Quiet",
    "ROOT",
    "run_in_memory",
    "tiny_inputs",
]
