"""kill -9 of the master mid-motion, in real time; in a network of its own."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.bus.faults.judged import first_safe
from tests.bus.faults.runs import _trace, experiment_file, rig_file
from tests.bus.faults.scenarios import Scenario

SCENARIO = Scenario((), "", "", 0, real_time=True, settings={"master": {"frame_timeout": "100 ms"}})
_MOVING, _SILENT = 200, 300  # cycles
_LONGEST_S = 60.0  # a bound for a hung test, not a figure


def kill_the_master() -> dict:
    """What the plant went through after the kill, and what the log says. Raises RuntimeError where
    the run ended before.
    """
    from epa_rt.config.rig import load_rig
    from epa_rt.logs.reader import LogReader
    from tests.bus.driver.emulated import MASTER_END
    from tests.bus.faults.traced import traced

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rig, log = rig_file(SCENARIO, folder), folder / "run.mcap"
        command = [
            "run",
            str(experiment_file(SCENARIO, folder)),
            "--rig",
            str(rig),
            "--backend",
            "ethercat",
            "--interface",
            MASTER_END,
            "-o",
            str(log),
            "--quiet",
        ]
        with traced(load_rig(rig), False, None) as bus:
            master = subprocess.Popen(
                [sys.executable, "-W", "error", "-m", "epa_rt", *command], stdout=subprocess.DEVNULL
            )
            try:
                _until(lambda: master.poll() is not None or bus.do(_cycles_moving) > _MOVING)
            finally:
                master.kill()
                code = master.wait()
            if code != -9:
                raise RuntimeError(f"the run ended with exit code {code} before it moved")
            killed_at = bus.do(_cycle)
            _until(lambda: bus.do(_cycle) > killed_at + _SILENT)
            rows, _, last_frame_cycle = bus.do(_trace)
        _until(lambda: _ending(log) is not None)
        with LogReader(log) as reader:
            ending, missing = reader.ending, reader.missing
            texts = [event.text for event in reader.events()]
    before = [row for row in rows if row.cycle == last_frame_cycle][0]
    return {
        "was_on": before.enabled,
        "was_moving": abs(before.speed_rad_s) > 1.0,
        "was_holding": not any(before.exhaust_open),
        "last_frame_cycle": last_frame_cycle,
        "safe_at": first_safe(rows, ()),
        "missing": missing,
        "outcome": ending.outcome,
        "cause": ending.cause,
        "texts": texts[-3:],
    }


def _until(condition: "object") -> None:
    end = time.monotonic() + _LONGEST_S
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError("waited in vain")
        time.sleep(0.02)


def _ending(log: Path) -> "object":
    from epa_rt.logs.reader import LogError, LogReader

    try:
        with LogReader(log) as reader:
            return reader.ending
    except LogError:
        return None


def _cycle(bus: "object") -> int:
    return bus.cycle


def _cycles_moving(bus: "object") -> int:
    """For how many cycles the motor has moved under power, with the air shut in, up to now."""
    count = 0
    for row in reversed(bus.rows[-2 * _MOVING :]):
        if (
            not row.enabled
            or any(row.exhaust_open)
            or any(row.inlet_open)
            or abs(row.travel_m) < 4e-3
            or abs(row.speed_rad_s) < 5.0
            and not count
        ):
            break
        count += 1
    return count
