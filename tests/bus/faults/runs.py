"""Runs of ``epa run`` on a traced bus, each with its fault; inside a network of its own.

    runs.results(["sto", ...])     from a test or a script: one process, one network, a result per scenario
    python -m tests.bus.faults.runs NAME ...     what that starts
"""

import contextlib
import functools
import io
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from sim_backend.bus.namespace import refusal
from tests.bus.faults.scenarios import Scenario, all_scenarios

if TYPE_CHECKING:
    from tests.bus.faults.traced import Row, TracedBus

ROOT = Path(__file__).resolve().parents[3]
UNSHARE = ("unshare", "--user", "--map-root-user", "--net")
FREE_CYCLES = 150  # after the run, for the slaves' watchdogs
_LONGEST_S = 900
_TRIES = 3
_LOST_FRAME_S = 0.25  # lock step: how long the master waits for a frame that does not come; no time of the plant

EXPERIMENT = """
experiment: faults
loop: {loop}
seed: 1
phases:
  - {{name: go_to_no_load, loop: {back}, move: {{to: no_load, speed: 20 mm/s}}}}
  - {{name: fill, loop: {back}, valves: {{all: {{set: {pressure}}}}}, until: valves_settled, timeout: 30 s}}
  - {{name: out, move: {out}, valves: {{all: hold}}}}
  - {{name: trial, trial: true, {motion}, for: {seconds:g} s, valves: {{all: hold}}}}
  - {{name: return, loop: {back}, move: {{to: no_load, speed: 40 mm/s}}}}
"""
VENT = "  - {{name: vent, loop: {back}, valves: {{all: vent}}, until: valves_settled, timeout: 30 s}}\n"
_BENCH = {"loop": "motor_speed", "back": "motor_speed", "pressure": "250 kPa gauge", "out": "{to: 4 mm, speed: 40 mm/s}",
          "motion": "random_speed: {between: [2 mm, 26 mm], speed: 50 mm/s}"}
_JOINT = {"loop": "joint_angle", "back": "motor_position"}
WORDS = {
    "bench": _BENCH, "bench_analog": _BENCH,
    "knee": {**_JOINT, "pressure": "80 kPa gauge", "out": "{to: mean, speed: 20 deg/s}",
             "motion": "sine: {mean: mean, peak_to_peak: 10 deg, frequency: 1.5 Hz, fade: 0.5 s}"},
    "mass": {**_JOINT, "pressure": "580 kPa gauge", "out": "{to: mean, speed: 20 mm/s}",
             "motion": "sine: {mean: mean, peak_to_peak: 10 mm, frequency: 2 Hz, fade: 0.5 s}"},
}


@functools.cache
def results(names: tuple[str, ...]) -> dict[str, dict]:
    """What became of each scenario. Raises RuntimeError with the output where the process failed."""
    done = subprocess.run([*UNSHARE, sys.executable, "-W", "error", "-m", "tests.bus.faults.runs", *names], cwd=ROOT, capture_output=True,
                          text=True, timeout=_LONGEST_S, check=False, env={**os.environ, "PYTHONPATH": str(ROOT)})
    if done.returncode:
        raise RuntimeError(f"{names}:\n{done.stdout[-3000:]}\n{done.stderr[-6000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def why_not() -> str | None:
    """Why no network of one's own can be had here; None where it can."""
    return refusal()


def rig_file(scenario: Scenario, folder: Path) -> Path:
    """The rig file of a scenario, with what it changes in ``safety`` and ``master``."""
    text = (ROOT / f"config/rigs/{scenario.rig}.yaml").read_text(encoding="utf-8").replace("../plants/", f"{ROOT}/config/plants/")
    for section, settings in scenario.settings.items():
        lines = "".join(f"  {key}: {value}\n" for key, value in settings.items())
        text = text.replace(f"{section}:\n", f"{section}:\n{lines}", 1) if f"\n{section}:\n" in text else text + f"{section}:\n{lines}"
    if scenario.real_time and scenario.goes_on:  # on a busy machine a master late by whole periods may meet the same toggle bit each time
        text = text.replace("stale_after: 20", "stale_after: 500")
    path = folder / f"{scenario.rig}.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def experiment_file(scenario: Scenario, folder: Path) -> Path:
    """Fill, move, vent: short, and with a motion of the rig's own kind."""
    path = folder / "faults.yaml"
    text = EXPERIMENT + (VENT if scenario.vents else "")  # otherwise disabling vents, unwatched
    path.write_text(text.format(**WORDS[scenario.rig], seconds=scenario.seconds), encoding="utf-8")
    return path


def run_one(scenario: Scenario) -> dict:
    """A scenario's facts. In real time a busy machine may end a run before its fault comes: then once more, twice at most."""
    for _ in range(_TRIES if scenario.real_time else 1):
        facts = _run_once(scenario)
        if facts["injected_at"] is not None:
            break
    return facts


def _run_once(scenario: Scenario) -> dict:
    """One run, as the command line does it; what it said, what the log says, what the plant went through."""
    from epa_rt.config.rig import load_rig
    from tests.bus.faults.judged import departure_m, facts_of
    from tests.bus.faults.traced import traced

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rig_path, experiment, log = rig_file(scenario, folder), experiment_file(scenario, folder), folder / "run.mcap"
        with traced(load_rig(rig_path), not scenario.real_time, scenario.plan()) as bus:
            code, said = _epa_run(experiment, rig_path, log, not scenario.real_time)
            bus.do(_go_on, FREE_CYCLES)
            rows, injected_at, last_frame_cycle = bus.do(_trace)
            facts = facts_of(scenario, code, said, log, rows, injected_at, last_frame_cycle)
            if scenario.again:
                bus.do(_clear)
                facts["again"] = _epa_run(experiment, rig_path, folder / "again.mcap", not scenario.real_time)
    if scenario.goes_on and scenario.faults and not scenario.real_time:
        facts["departs_m"] = departure_m(rows, _undisturbed(scenario.rig, scenario.seconds), injected_at)
    return facts


@functools.cache
def _undisturbed(rig: str, seconds: float) -> "list[Row]":
    """The same run without a fault, cycle by cycle."""
    from epa_rt.config.rig import load_rig
    from tests.bus.faults.traced import traced

    scenario = Scenario((), "", "", 0, rig=rig, seconds=seconds)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rig_path = rig_file(scenario, folder)
        with traced(load_rig(rig_path), True, None) as bus:
            _epa_run(experiment_file(scenario, folder), rig_path, folder / "run.mcap", True)
            return bus.do(_trace)[0]


def _epa_run(experiment: Path, rig: Path, log: Path, lock_step: bool) -> tuple[int, str]:
    import drivers.backend
    from epa_rt.cli.main import main
    from tests.bus.faults.traced import MASTER_END

    drivers.backend._LOCK_STEP_TIMEOUT_S = _LOST_FRAME_S
    said = io.StringIO()
    options = ["--lock-step"] if lock_step else []
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = main(["run", str(experiment), "--rig", str(rig), "--backend", "ethercat", "--interface", MASTER_END, "-o", str(log),
                     "--quiet", *options])
    return code, said.getvalue()


def _go_on(bus: "TracedBus", cycles: int) -> None:
    bus.time_goes_on(cycles)


def _clear(bus: "TracedBus") -> None:
    bus.faults.clear()


def _trace(bus: "TracedBus") -> tuple:
    return bus.rows, bus.injected_at, bus.last_frame_cycle


if __name__ == "__main__":
    print(json.dumps({name: run_one(all_scenarios()[name]) for name in sys.argv[1:]}))
