"""Counts false alarms of the checks of sensors: simulated runs without a fault, over rigs,
experiments and plants drawn within engineering ranges. The experiments are those of config/ and,
drawn anew for each plant, those that the diagnosis' benchmark records its cases with.

python scripts/false_alarms.py --hours 1 --plants 40 --jobs 2 [--lines PATH] [--first N]
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from math import gcd
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
OWN = ("implausible sensor", "sensor at rest")
RIGS = ("bench", "bench_analog", "knee", "knee_geared", "mass")
OF_BENCHMARK = "benchmark"  # "benchmark rich a": the first log of a rich case


def one_run(rig: str, experiment: str, seed: int) -> dict:
    """A run of a drawn plant: simulated seconds, outcome, cause, hints."""
    from epa_rt.cli.inputs import load_inputs
    from epa_rt.loop.assembly import assemble
    from epa_rt.loop.run import run
    from sim_backend.backend import SimBackend
    from sim_backend.plant_draw import drawn_plant
    from tests.loop.rigging import Quiet

    with TemporaryDirectory() as folder:
        path = experiment_file(rig, experiment, seed, Path(folder))
        inputs = load_inputs(path, ROOT / f"config/rigs/{rig}.yaml", None, with_plant=True)
    inputs = replace(inputs, plant=drawn_plant(inputs.plant, seed))
    assembly, events = assemble(inputs.rig, inputs.experiment), Events()
    backend = SimBackend(inputs.rig, inputs.plant, seed + 1)
    result = run(
        inputs.rig,
        backend,
        assembly.supervisor,
        assembly.envelope,
        assembly.decoder,
        assembly.encoder,
        events,
        Quiet(),
    )
    return {
        "rig": rig,
        "experiment": experiment,
        "seed": seed,
        "seconds": result.cycles * inputs.rig.period_s,
        "outcome": result.outcome,
        "check": result.trip.cause if result.trip else "",
        "cause": result.cause,
        "hints": events.hints,
    }


def experiment_file(rig: str, experiment: str, seed: int, folder: Path) -> Path:
    """The file of an experiment; one of the benchmark's is written into ``folder``."""
    if not experiment.startswith(OF_BENCHMARK):
        return ROOT / f"config/experiments/{experiment}.yaml"
    from numpy.random import default_rng

    from epa_rt.benchmark.plans import plan_of

    _, kind, letter = experiment.split()
    plan = plan_of(rig, kind, default_rng(seed))
    path = folder / f"log_{letter}.yaml"
    path.write_text((*plan.logs, *plan.holdout)["abcd".index(letter)], encoding="utf-8")
    return path


class Events:
    """A Recording that keeps hints and nothing else."""

    failure = None

    def __init__(self) -> None:
        self.hints: list[str] = []

    def sample(self, *values: object) -> None: ...

    def event(self, cycle: int, t_ns: int, kind: str, text: str, /, **data: object) -> None:
        if kind == "hint":
            self.hints.append(text)


def fitting() -> list[tuple[str, str]]:
    """Every rig with every experiment that fits it, the short ones first."""
    from epa_rt.cli.inputs import load_inputs
    from epa_rt.config.source import ConfigError
    from epa_rt.loop.assembly import WiringError, assemble

    found = []
    for path in sorted((ROOT / "config/experiments").glob("*.yaml")):
        for rig in RIGS:
            try:
                inputs = load_inputs(path, ROOT / f"config/rigs/{rig}.yaml", None, with_plant=True)
                assemble(inputs.rig, inputs.experiment)
            except (ConfigError, WiringError):
                continue
            found.append((inputs.experiment.duration_s, rig, path.stem))
    benchmark = [
        (rig, f"{OF_BENCHMARK} {kind} {letter}")
        for rig in ("bench", "knee")
        for kind, letters in (("rich", "abcd"), ("narrow", "a"), ("still", "a"))
        for letter in letters
    ]
    return [(rig, name) for _, rig, name in sorted(found)] + benchmark


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hours", type=float, default=1.0, help="simulated, at least")
    parser.add_argument("--plants", type=int, default=40)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--first", type=int, default=0, help="seed of the first plant")
    parser.add_argument("--longest", type=float, default=1e9, help="no experiment longer, in s")
    parser.add_argument("--shortest", type=float, default=0.0, help="and none shorter, in s")
    parser.add_argument("--only", default="", help="experiments whose name begins so")
    parser.add_argument("--lines", type=Path, help="a line of JSON a run; what is there counts too")
    arguments = parser.parse_args()
    found: list[dict] = []
    if arguments.lines is not None and arguments.lines.exists():
        found = [json.loads(line) for line in arguments.lines.read_text("utf-8").splitlines()]
    done = {(row["rig"], row["experiment"], row["seed"]) for row in found}
    pairs = [p for p in fitting() if p[1].startswith(arguments.only)]
    pairs = [p for p in pairs if arguments.shortest <= _duration(*p) <= arguments.longest]
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for jobs in rounds(pairs, arguments.first, arguments.plants):
            if hours_of(found) >= arguments.hours:
                break
            jobs = [job for job in jobs if job not in done]
            for row in pool.map(one_run, *zip(*jobs, strict=True)) if jobs else ():
                found.append(row)
                if row["check"]:
                    print(f"{row['rig']} {row['experiment']} {row['seed']}: {row['cause']}")
                if arguments.lines is not None:
                    with arguments.lines.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(row) + "\n")
            print(summary(found), flush=True)
    return any(row["check"] in OWN for row in found)


def rounds(
    pairs: list[tuple[str, str]], first: int, plants: int
) -> Iterator[list[tuple[str, str, int]]]:
    """All rigs and experiments, each with another plant; ends once each has had every plant."""
    stride = next(n for n in range(7, 7 + plants) if gcd(n, plants) == 1)
    for turn in range(plants):
        yield [(*pair, first + (stride * turn + 3 * i) % plants) for i, pair in enumerate(pairs)]


def hours_of(found: list[dict]) -> float:
    """Simulated hours."""
    return sum(row["seconds"] for row in found) / 3600.0


def summary(found: list[dict]) -> str:
    """What was found so far: hours, runs, plants, own trips, hints, trips of other checks."""
    own = [row for row in found if row["check"] in OWN]
    others = Counter(row["check"] for row in found if row["check"] and row["check"] not in OWN)
    hints = sum(bool(row["hints"]) for row in found)
    return (
        f"{hours_of(found):.2f} simulated hours, {len(found)} runs,"
        f" {len({row['seed'] for row in found})} plants: {len(own)} false alarms, {hints} runs"
        f" with a hint; trips by other checks: {dict(others) or 'none'}"
    )


def _duration(rig: str, experiment: str) -> float:
    from epa_rt.cli.inputs import load_inputs

    with TemporaryDirectory() as folder:
        path = experiment_file(rig, experiment, 0, Path(folder))
        rig_file = ROOT / f"config/rigs/{rig}.yaml"
        return load_inputs(path, rig_file, None, False).experiment.duration_s


if __name__ == "__main__":
    sys.exit(main())
