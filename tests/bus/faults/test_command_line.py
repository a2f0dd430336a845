"""epa run --backend ethercat beside epa bus run, as an operator types it: every rig, lock step and
real time, and the replay.
"""

import subprocess
import sys

import pytest

from epa_rt.config.zero_file import ZeroFile, write_zero, zero_path
from epa_rt.logs.reader import LogReader
from tests.bus.driver.homed import AT_ZERO
from tests.bus.faults.runs import ROOT, experiment_file, rig_file
from tests.bus.faults.scenarios import Scenario
from tests.bus.own_network import REAL_TIME

pytestmark = [pytest.mark.network, pytest.mark.timeout(900)]


def epa(*arguments: object) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-W", "error", "-m", "epa_rt", *map(str, arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


def on_the_bus(
    rig: object, experiment: object, log: object, *options: str
) -> subprocess.CompletedProcess:
    """One shell line: the emulated bus, and the run beside it."""
    run = [
        sys.executable,
        "-W",
        "error",
        "-m",
        "epa_rt",
        "run",
        experiment,
        "--rig",
        rig,
        "--backend",
        "ethercat",
        "--interface",
        "ecat_master",
        "-o",
        log,
        "--quiet",
        *options,
    ]
    return epa("bus", "run", "--rig", rig, *options, "--", *run)


@pytest.mark.parametrize(
    "rig",
    [
        "bench_analog",
        "knee",
        pytest.param("bench", marks=pytest.mark.slow),
        pytest.param("mass", marks=pytest.mark.slow),
    ],
)
def test_in_lock_step_every_rig_completes_and_its_log_replays_to_the_byte(rig, tmp_path):
    rig_path = ROOT / f"config/rigs/{rig}.yaml"
    if rig == "bench_analog":  # with an offset that the log must carry
        rig_path = rig_file(Scenario((), "", "", 0, rig=rig), tmp_path)
        write_zero(zero_path(rig_path, emulated=True), ZeroFile(**AT_ZERO, rig=rig, offset=1000))
    files = rig_path, experiment_file(Scenario((), "", "", 0, rig=rig), tmp_path)
    done = on_the_bus(*files, tmp_path / "run.mcap", "--lock-step")
    warned = [line for line in done.stderr.splitlines() if not line.startswith("UNPROTECTED")]
    assert done.returncode == 0 and done.stdout.startswith("completed\n") and not warned, (
        done.stdout,
        done.stderr,
    )
    replayed = epa("replay", tmp_path / "run.mcap")
    assert replayed.returncode == 0 and "every output byte identical" in replayed.stdout, (
        replayed.stdout
    )
    with LogReader(tmp_path / "run.mcap") as reader:
        assert (reader.missing, reader.outcome) == ([], "completed")
        assert reader.metadata["run"]["backend"] == "ethercat"
        assert rig != "bench_analog" or "+1000 counts" in reader.metadata["run"]["zero"]


@REAL_TIME
def test_in_real_time_a_run_completes_and_its_log_replays_to_the_byte(tmp_path):
    patient = Scenario(
        (),
        "",
        "",
        0,
        real_time=True,
        settings={"safety": {"watchdog": "1 s"}, "master": {"frame_timeout": "100 ms"}},
    )
    done = on_the_bus(
        rig_file(patient, tmp_path), experiment_file(patient, tmp_path), tmp_path / "run.mcap"
    )
    assert done.returncode == 0 and done.stdout.startswith("completed\n"), (
        done.stdout,
        done.stderr,
    )
    replayed = epa("replay", tmp_path / "run.mcap")
    assert replayed.returncode == 0 and "every output byte identical" in replayed.stdout, (
        replayed.stdout
    )
    with LogReader(tmp_path / "run.mcap") as reader:
        assert (reader.missing, reader.outcome) == ([], "completed")
