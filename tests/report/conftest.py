"""Real logs, recorded once: a bench run, a knee run, a run that tripped, and one that was cut."""

from __future__ import annotations

from pathlib import Path

import pytest

from epa_rt.report.run import Run, load_run
from tests.cli.shell import EXPERIMENTS, RIGS, epa_here
from tests.report.rigs import rig_that_trips


def record(folder: Path, experiment: str, rig: Path, exit_code: int = 0) -> Path:
    log = folder / f"{experiment}.mcap"
    done = epa_here("run", EXPERIMENTS / f"{experiment}.yaml", "--rig", rig, "-o", log, "--quiet")
    assert done.returncode == exit_code, done.stderr
    return log


@pytest.fixture(scope="session")
def bench_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("bench"), "identification_short", RIGS / "bench.yaml")


@pytest.fixture(scope="session")
def knee_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("knee"), "knee_chirp_short", RIGS / "knee.yaml")


@pytest.fixture(scope="session")
def tripped_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tripped")
    return record(folder, "identification_short", rig_that_trips(folder), exit_code=3)


@pytest.fixture(scope="session")
def cut_log(bench_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    data = bench_log.read_bytes()
    path = tmp_path_factory.mktemp("cut") / "cut.mcap"
    path.write_bytes(data[: int(0.6 * len(data))])
    return path


@pytest.fixture(scope="session")
def bench(bench_log: Path) -> Run:
    return load_run(bench_log)


@pytest.fixture(scope="session")
def knee(knee_log: Path) -> Run:
    return load_run(knee_log)
