"""Runs of ``epa run`` on a traced bus, each with its fault, and what became of it.

runs.facts_of_run("sto")     from a test or a script: in a network of its own, by
tests/bus/own_network.py
"""

import contextlib
import functools
import io
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.config.zero_file import ZeroFile, write_zero, zero_path
from tests.bus.driver.homed import AT_ZERO
from tests.bus.faults.scenarios import Scenario, all_scenarios
from tests.bus.own_network import call

if TYPE_CHECKING:
    from tests.bus.faults.traced import TracedBus

ROOT = Path(__file__).resolve().parents[3]
BUSY = "a machine that tests is late by itself"
LOST_FRAME_S = (
    0.2  # lock step: how long the master waits for a frame that stays away; no time of the plant
)
PATH_CYCLES = 500  # of the plant, after a fault that a run survives

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
"""  # noqa: E501
VENT = (
    "  - {{name: vent, loop: {back}, valves: {{all: vent}}, until: valves_settled, timeout: 30"
    " s}}\n"
)
_BENCH = {
    "loop": "motor_speed",
    "back": "motor_speed",
    "pressure": "120 kPa gauge",
    "out": "{to: 4 mm, speed: 40 mm/s}",
    "motion": "random_speed: {between: [2 mm, 26 mm], speed: 50 mm/s}",
}
_JOINT = {"loop": "joint_angle", "back": "motor_position"}
WORDS = {
    "bench": _BENCH,
    "bench_analog": _BENCH,
    "knee": {
        **_JOINT,
        "pressure": "80 kPa gauge",
        "out": "{to: mean, speed: 20 deg/s}",
        "motion": "sine: {mean: mean, peak_to_peak: 10 deg, frequency: 1.5 Hz, fade: 0.5 s}",
    },
    "mass": {
        **_JOINT,
        "pressure": "580 kPa gauge",
        "out": "{to: mean, speed: 20 mm/s}",
        "motion": "sine: {mean: mean, peak_to_peak: 10 mm, frequency: 2 Hz, fade: 0.5 s}",
    },
}


def facts_of_run(name: str) -> dict:
    """A scenario's facts."""
    scenario, facts = all_scenarios()[name], call("tests.bus.faults.runs:run_one", name=name)
    if scenario.compares and facts["injected_at"] is not None:
        facts["departs_m"] = departure_m(
            facts["path_m"], _undisturbed(scenario.rig, scenario.seconds), facts["injected_at"]
        )
    return facts


def departure_m(path_m: list[float], undisturbed_m: list[float], injected_at: int) -> float:
    """How far the motor's travel departs from that of the undisturbed run, m."""
    return max(
        abs(a - b)
        for a, b in zip(path_m, undisturbed_m[injected_at : injected_at + len(path_m)], strict=True)
    )


@functools.cache
def _undisturbed(rig: str, seconds: float) -> list[float]:
    """Travel of the motor in the same run without a fault, cycle by cycle, m."""
    return call("tests.bus.faults.runs:run_undisturbed", rig=rig, seconds=seconds)


def rig_file(scenario: Scenario, folder: Path) -> Path:
    """The rig file of a scenario, with what it changes in ``safety`` and ``master``."""
    text = (
        (ROOT / f"config/rigs/{scenario.rig}.yaml")
        .read_text(encoding="utf-8")
        .replace("../plants/", f"{ROOT}/config/plants/")
    )
    for section, settings in scenario.settings.items():
        lines = "".join(f"  {key}: {value}\n" for key, value in settings.items())
        text = (
            text.replace(f"{section}:\n", f"{section}:\n{lines}", 1)
            if f"\n{section}:\n" in text
            else text + f"{section}:\n{lines}"
        )
    # a busy machine: late by whole periods one meets the same toggle bit each time, or asks for
    # half the speed, or stops because it is late all the time
    if scenario.real_time:
        for usual, patient in (
            ("stale_after: 20", "stale_after: 500"),
            ("following_error: 4 mm", "following_error: 20 mm"),
            ("overrun: {", "overrun: {late_time: 60 s, "),
        ):
            text = text.replace(usual, patient)
        text += f"unprotected:\n  reaction: {BUSY}\n"
        if "watchdog" not in scenario.settings.get(
            "safety", {}
        ):  # a longer one lets a sensor be old for longer
            text += f"  stale_after: {BUSY}\n"
    path = folder / f"{scenario.rig}.yaml"
    path.write_text(text, encoding="utf-8")
    if scenario.rig == "bench_analog":  # a wired drive: the file says where its zero is
        write_zero(zero_path(path, emulated=True), ZeroFile(**AT_ZERO, rig=scenario.rig))
    return path


def experiment_file(scenario: Scenario, folder: Path) -> Path:
    """Fill, move, vent: short, and with a motion of the rig's own kind."""
    path = folder / "faults.yaml"
    text = EXPERIMENT + (VENT if scenario.vents else "")  # otherwise disabling vents, unwatched
    words = WORDS[scenario.rig]
    if scenario.pressure:
        words = {**words, "pressure": scenario.pressure}
    path.write_text(text.format(**words, seconds=scenario.seconds), encoding="utf-8")
    return path


def run_one(name: str) -> dict:
    """One run, as the command line does it; what it said, what the log says, what the plant went
    through.
    """
    from epa_rt.config.rig import load_rig
    from tests.bus.faults.judged import facts_of
    from tests.bus.faults.traced import traced

    scenario = all_scenarios()[name]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        rig_path, experiment, log = (
            rig_file(scenario, folder),
            experiment_file(scenario, folder),
            folder / "run.mcap",
        )
        rig = load_rig(rig_path)
        with traced(rig, not scenario.real_time, scenario.plan()) as bus:
            code, said = epa_run(experiment, rig_path, log, not scenario.real_time)
            bus.do(_go_on, scenario.alone_cycles)
            rows, injected_at, _ = bus.do(_trace)
            facts = facts_of(scenario, rig, code, said, log, rows, injected_at)
            if scenario.again:
                bus.do(_clear)
                facts["again"] = epa_run(
                    experiment, rig_path, folder / "again.mcap", not scenario.real_time
                )
    if scenario.compares and injected_at is not None:
        facts["path_m"] = [row.travel_m for row in rows[injected_at : injected_at + PATH_CYCLES]]
    return facts


def run_undisturbed(rig: str, seconds: float) -> list[float]:
    """Travel of the motor, cycle by cycle, of a run in lock step without a fault, m."""
    from epa_rt.config.rig import load_rig
    from tests.bus.faults.traced import traced

    scenario = Scenario((), "", "", 0, rig=rig, seconds=seconds)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        rig_path = rig_file(scenario, folder)
        with traced(load_rig(rig_path), True, None) as bus:
            epa_run(experiment_file(scenario, folder), rig_path, folder / "run.mcap", True)
            return [row.travel_m for row in bus.do(_trace)[0]]


def epa_run(
    experiment: Path, rig: Path, log: Path, lock_step: bool, lost_frame_s: float = LOST_FRAME_S
) -> tuple[int, str]:
    """``epa run`` on the bus: its exit code, and what it said."""
    import drivers.backend
    from epa_rt.cli.main import main
    from tests.bus.driver.emulated import MASTER_END

    drivers.backend._LOCK_STEP_TIMEOUT_S = lost_frame_s
    said = io.StringIO()
    options = ["--lock-step"] if lock_step else []
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = main(
            [
                "run",
                str(experiment),
                "--rig",
                str(rig),
                "--backend",
                "ethercat",
                "--interface",
                MASTER_END,
                "-o",
                str(log),
                "--quiet",
                *options,
            ]
        )
    return code, said.getvalue()


def _go_on(bus: "TracedBus", cycles: int) -> None:
    bus.time_goes_on(cycles)


def _clear(bus: "TracedBus") -> None:
    bus.faults.clear()


def _trace(bus: "TracedBus") -> tuple:
    return bus.rows, bus.injected_at, bus.last_frame_cycle
