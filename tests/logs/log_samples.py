"""A small rig's layout, and samples for it that can be made again when they are read."""

from __future__ import annotations

import os
import random
from pathlib import Path

from epa_rt.logs.layout import FLAG_OVERRUN, FLAG_WORKING_COUNTER_OK, SampleLayout
from epa_rt.logs.recorder import LogSummary, Recorder

PERIOD_NS = 1_000_000
ATTACHMENTS = {"rig.yaml": b"rig: bench\n", "code.tar": bytes(range(256)) * 700}
METADATA = {"run": {"seed": "7", "rig": "bench"}}
LAYOUT = SampleLayout(
    inputs_bytes=13,
    outputs_bytes=5,
    measured=tuple(f"place{k}_pressure_pa" for k in range(20)),
    reference=("ref_motor_speed_rad_s",),
    command=("cmd_motor_speed_rad_s", "cmd_inlet_valve"),
    estimate=(),
    states=("bring_up", "running", "tripped"),
    phases=("no_load", "trial_1"),
)


def sample_of(cycle: int, layout: SampleLayout = LAYOUT) -> dict[str, object]:
    """A sample that a cycle number determines wholly."""
    random_numbers = random.Random(cycle)
    groups = {"measured": {}, "reference": {}, "command": {}, "estimate": {}}
    for group, names in layout.groups().items():
        groups[group] = {name: random_numbers.gauss(0.0, 1e5) for name in names}
    return {
        "cycle": cycle,
        "t_ns": cycle * PERIOD_NS,
        "state": cycle % 3,
        "phase": cycle % 2,
        "flags": FLAG_WORKING_COUNTER_OK | (FLAG_OVERRUN if cycle % 100 == 99 else 0),
        "lateness_ns": random_numbers.randrange(-1000, 90_000),
        "busy_ns": random_numbers.randrange(20_000, 40_000),
        "invalid_mask": random_numbers.getrandbits(64),
        "stale_mask": random_numbers.getrandbits(20),
        "inputs_raw": random_numbers.randbytes(layout.inputs_bytes),
        "outputs_raw": random_numbers.randbytes(layout.outputs_bytes),
        **groups,
    }


def record(
    path: Path, samples: int, *, event_every: int = 700, lossless: bool = True, **options: object
) -> LogSummary:
    """Record that many samples of `sample_of`, with an event now and then."""
    recorder = Recorder(path, LAYOUT, ATTACHMENTS, METADATA, lossless, **options)
    recorder.open()
    for cycle in range(samples):
        recorder.sample(**sample_of(cycle))
        if cycle % event_every == 0:
            recorder.event(
                cycle,
                cycle * PERIOD_NS,
                "valve",
                f"inlet switched at {cycle}",
                count=cycle,
                opened=True,
            )
    return recorder.close("finished", "all phases done")


def wait_for_end(pid: int) -> None:
    """Wait until a child process has ended, leaving it to its owner to reap."""
    os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
