"""Short runs of the simulated bench, recorded once: two seeds of one rig, and one that leaks."""

from __future__ import annotations

from pathlib import Path

import pytest

from epa_rt.cli.main import main
from epa_rt.report.run import Run, load_run
from tests.cli.shell import RIGS, ROOT

SHORT = """experiment: short
loop: motor_speed
seed: 1
phases:
  - {name: go_to_no_load, move: {to: no_load, speed: 20 mm/s}}
  - {name: fill, valves: {all: {set: 460 kPa gauge}}, until: valves_settled, timeout: 60 s}
  - name: trial
    trial: true
    random_speed: {between: [1 mm, 20 mm], speed: 60 mm/s, acceleration: 2 m/s^2}
    for: 4 s
    valves: {all: hold}
  - {name: vent, valves: {all: vent}, until: valves_settled, timeout: 60 s}
"""
LEAK = "\neffects:\n  leak:\n    leak: 0.001 1/s\n"


def recorded(folder: Path, name: str, *options: object, rig: Path = RIGS / "bench.yaml") -> Path:
    """A run of SHORT on the simulated bench; the log's path."""
    experiment, log = folder / "short.yaml", folder / f"{name}.mcap"
    experiment.write_text(SHORT)
    words = ["run", experiment, "--rig", rig, "-o", log, "--quiet", *options]
    assert main([str(word) for word in words]) == 0
    return log


@pytest.fixture(scope="session")
def logs(tmp_path_factory) -> dict[str, Path]:
    """``first``, ``again`` (same seed, other note), ``other`` (other seed), ``leaking``."""
    folder = tmp_path_factory.mktemp("runs")
    plant = folder / "leaking.yaml"
    plant.write_text((ROOT / "config/plants/bench.yaml").read_text() + LEAK)
    return {
        "first": recorded(folder, "first", "--operator", "Ada", "--note", "new hose"),
        "again": recorded(folder, "again", "--operator", "Émilie", "--note", "x" * 900),
        "other": recorded(folder, "other", "--seed", 2),
        "leaking": recorded(folder, "leaking", "--seed", 3, "--plant", plant),
    }


@pytest.fixture(scope="session")
def runs(logs: dict[str, Path]) -> dict[str, Run]:
    return {name: load_run(path) for name, path in logs.items()}
