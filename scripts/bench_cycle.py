"""What one cycle costs above the backend: decode, experiment, control, envelope, encode and record.
Prints JSON.

The knee chirp runs on the simulated rig with a recorder in its own process; the time between an
exchange's return and the next exchange's call is taken every cycle. Once as fast as it goes and
once paced in real time, where caches are cold after each sleep. The floor is what two readings of
the clock cost in the same run.

With --period the rig runs at that period, and the margin is what a cycle of it leaves the loop.
With --against the same benchmark of another checkout runs in turn with this one, each in processes
of its own: the medians of both, and their ratio.

    python scripts/bench_cycle.py --cycles 120000
    python scripts/bench_cycle.py --period 0.25          4 kHz
    python scripts/bench_cycle.py --against FOLDER --turns 4
"""

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from epa_rt.backend import Backend, Exchange
from epa_rt.cli.inputs import load_inputs
from epa_rt.logs.recorder import Recorder
from epa_rt.loop.assembly import assemble
from epa_rt.loop.run import run
from epa_rt.realtime.process import undisturbed
from sim_backend.backend import SimBackend


class Stopwatch:
    """A backend around a backend: takes the time between exchanges, and asks for a stop after
    enough cycles.
    """

    def __init__(self, inner: Backend, cycles: int):
        self.inner, self.period_s = inner, inner.period_s
        self.taken_ns = np.zeros(cycles + 100_000, np.int64)
        self.cycle, self._limit, self._left_ns = 0, cycles, 0
        self.events, self.drive_off = inner.events, inner.drive_off

    def open(self) -> None:
        self.inner.open()
        self._left_ns = time.perf_counter_ns()

    def exchange(self, outputs_raw: bytes) -> Exchange:
        now_ns = time.perf_counter_ns()
        self.taken_ns[self.cycle] = now_ns - self._left_ns
        self.cycle += 1
        exchange = self.inner.exchange(outputs_raw)
        self._left_ns = time.perf_counter_ns()
        return exchange

    def close(self) -> None:
        self.inner.close()

    def poll(self, cycle: int) -> int:
        return int(cycle >= self._limit)


def clock_floor_us(samples: int = 200_000) -> float:
    """Median cost of two clock readings in microseconds."""
    readings = np.array(
        [-(time.perf_counter_ns() - time.perf_counter_ns()) for _ in range(samples)]
    )
    return float(np.median(readings)) / 1e3


def rig_file(rig: str, period_ms: float, folder: Path) -> Path:
    """The rig at another period, written into a folder; its plant is the delivered one."""
    text = (ROOT / f"config/rigs/{rig}.yaml").read_text(encoding="utf-8")
    for pattern, new in (
        (r"^period: .*$", f"period: {period_ms:g} ms"),
        (r"\blate: [^,}]*", f"late: {0.3 * period_ms:g} ms"),
        (r"^plant: \.\./", f"plant: {ROOT}/config/"),
    ):
        text = re.sub(pattern, new, text, count=1, flags=re.MULTILINE)
    path = folder / f"{rig}.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def measure(
    rig: str, experiment: str, cycles: int, speed: float | None, period_ms: float
) -> dict[str, float]:
    """One run; costs in microseconds over the cycles after bring-up."""
    with tempfile.TemporaryDirectory() as folder:
        path = rig_file(rig, period_ms, Path(folder))
        inputs = load_inputs(ROOT / f"config/experiments/{experiment}.yaml", path, None, True)
    assembly = assemble(inputs.rig, inputs.experiment)
    backend = SimBackend(inputs.rig, inputs.plant, 1, speed)
    backend.model.warm_up()
    stopwatch = Stopwatch(backend, cycles)
    with tempfile.TemporaryDirectory() as folder:
        recorder = Recorder(
            Path(folder) / "bench.mcap",
            assembly.layout,
            inputs.attachments,
            {},
            lossless=speed is None,
        )
        recorder.open()
        with undisturbed(inputs.rig.realtime if speed is not None else None) as granted:
            result = run(
                inputs.rig,
                stopwatch,
                assembly.supervisor,
                assembly.envelope,
                assembly.decoder,
                assembly.encoder,
                recorder,
                stopwatch,
            )
        summary = recorder.close(result.outcome, result.cause)
    taken_us = stopwatch.taken_ns[200 : stopwatch.cycle] / 1e3
    p50, p99, p999 = np.percentile(taken_us, (50, 99, 99.9))
    period_us = 1e3 * period_ms
    return {
        "cycles": int(taken_us.size),
        "median_us": round(float(p50), 2),
        "p99_us": round(float(p99), 2),
        "p99_9_us": round(float(p999), 2),
        "max_us": round(float(taken_us.max()), 1),
        "margin_median": round(1.0 - float(p50) / period_us, 3),
        "margin_p99_9": round(1.0 - float(p999) / period_us, 3),
        "longer_than_period": int(np.count_nonzero(taken_us > period_us)),
        "late_cycles": result.overruns,
        "worst_lateness_us": round(result.worst_lateness_ns / 1e3, 1),
        "lost_samples": summary.lost_samples,
        "outcome": f"{result.outcome} {result.cause}".strip(),
        "realtime": list(granted),
    }


def in_turn(other: Path, turns: int, options: list[str]) -> dict[str, dict[str, object]]:
    """Other, this, other, this, ...: medians in microseconds by kind of run, and this over other.

    Each checkout runs its own script of this name. Raises CalledProcessError where one fails.
    """
    found: dict[Path, list[dict[str, dict[str, float]]]] = {other.resolve(): [], ROOT: []}
    for _ in range(turns):
        for checkout, reports in found.items():
            told = subprocess.run(
                [sys.executable, str(checkout / "scripts" / Path(__file__).name), *options],
                cwd=checkout,
                env=os.environ | {"PYTHONPATH": str(checkout)},
                stdout=subprocess.PIPE,
                text=True,
                check=True,
            )
            reports.append(json.loads(told.stdout))
    answer: dict[str, dict[str, object]] = {}
    for kind in ("unpaced", "paced_1x"):
        of_other, of_this = (
            [report[kind]["median_us"] for report in reports] for reports in found.values()
        )
        other_us, this_us = statistics.median(of_other), statistics.median(of_this)
        answer[kind] = {
            "other_us": other_us,
            "this_us": this_us,
            "ratio": round(this_us / other_us, 3),
            "all_other_us": of_other,
            "all_this_us": of_this,
        }
    return answer


def main() -> None:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("--rig", default="knee")
    arguments.add_argument("--experiment", default="knee_chirp")
    arguments.add_argument("--cycles", type=int, default=120_000)
    arguments.add_argument("--paced-cycles", type=int, default=20_000)
    arguments.add_argument("--period", type=float, default=1.0, metavar="MS", help="in ms")
    arguments.add_argument("--against", type=Path, metavar="FOLDER", help="another checkout")
    arguments.add_argument("--turns", type=int, default=3, help="with --against, of each")
    chosen = arguments.parse_args()
    if chosen.against is not None:
        options = ["--rig", chosen.rig, "--experiment", chosen.experiment]
        options += ["--cycles", str(chosen.cycles), "--paced-cycles", str(chosen.paced_cycles)]
        if chosen.period != 1.0:
            options += ["--period", str(chosen.period)]
        print(json.dumps(in_turn(chosen.against, chosen.turns, options), indent=2))
        return
    period = chosen.period
    report = {
        "rig": chosen.rig,
        "experiment": chosen.experiment,
        "period_ms": period,
        "floor_clock_us": clock_floor_us(),
        "unpaced": measure(chosen.rig, chosen.experiment, chosen.cycles, None, period),
        "paced_1x": measure(chosen.rig, chosen.experiment, chosen.paced_cycles, 1.0, period),
        "bar": {"median_us": 25.0, "p99_9_us": 100.0},
    }
    print(json.dumps(report, indent=2))


if __name__ == "__main__":
    main()
