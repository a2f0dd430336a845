"""Counts false alarms of the checks of sensors: simulated runs without a fault, over rigs,
experiments and plants drawn within engineering ranges.

python scripts/false_alarms.py --hours 1 --plants 40 --jobs 2 [--json PATH] [--first N]
"""

import argparse
import json
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import cycle
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
OWN = ("implausible sensor", "sensor at rest")
RIGS = ("bench", "bench_analog", "knee", "knee_geared", "mass")


def one_run(rig: str, experiment: str, seed: int) -> dict:
    """A run of a drawn plant: simulated seconds, outcome, cause, hints."""
    from epa_rt.cli.inputs import load_inputs
    from epa_rt.loop.assembly import assemble
    from epa_rt.loop.run import run
    from sim_backend.backend import SimBackend
    from sim_backend.plant_draw import drawn_plant
    from tests.loop.rigging import Quiet

    inputs = load_inputs(
        ROOT / f"config/experiments/{experiment}.yaml",
        ROOT / f"config/rigs/{rig}.yaml",
        None,
        with_plant=True,
    )
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
    return [(rig, name) for _, rig, name in sorted(found)]


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hours", type=float, default=1.0, help="simulated, at least")
    parser.add_argument("--plants", type=int, default=40)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--first", type=int, default=0, help="seed of the first plant")
    parser.add_argument("--longest", type=float, default=1e9, help="no experiment longer, in s")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    pairs = [p for p in fitting() if _duration(*p) <= arguments.longest]
    seeds = cycle(range(arguments.first, arguments.first + arguments.plants))
    found, alarms = [], 0
    with ProcessPoolExecutor(arguments.jobs) as pool:
        while sum(row["seconds"] for row in found) < 3600.0 * arguments.hours:
            jobs = [(rig, name, next(seeds)) for rig, name in pairs]
            for row in pool.map(one_run, *zip(*jobs, strict=True)):
                found.append(row)
                if row["check"]:
                    print(
                        f"{row['rig']} {row['experiment']} {row['seed']}: {row['cause']}",
                        flush=True,
                    )
            alarms = report(found, arguments.json)
    return bool(alarms)


def report(found: list[dict], path: Path | None) -> int:
    """Prints what was found so far, writes it; the number of false alarms."""
    hours = sum(row["seconds"] for row in found) / 3600.0
    alarms = [row for row in found if row["check"] in OWN]
    others = Counter(row["check"] for row in found if row["check"] and row["check"] not in OWN)
    print(
        f"{hours:.2f} simulated hours, {len(found)} runs, {len({r['seed'] for r in found})} plants:"
        f" {len(alarms)} false alarms, {sum(bool(r['hints']) for r in found)} runs with a hint;"
        f" trips by other checks: {dict(others) or 'none'}",
        flush=True,
    )
    if path is not None:
        path.write_text(json.dumps(found, indent=1), encoding="utf-8")
    return len(alarms)


def _duration(rig: str, experiment: str) -> float:
    from epa_rt.cli.inputs import load_inputs

    return load_inputs(
        ROOT / f"config/experiments/{experiment}.yaml",
        ROOT / f"config/rigs/{rig}.yaml",
        None,
        False,
    ).experiment.duration_s


if __name__ == "__main__":
    sys.exit(main())
