"""kill -9 of the master at speed, in real time: what the rig goes through by itself.

killed.figures_of_kill("knee")     from a test or a script: in a network of its own
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from tests.bus.faults.judged import rig_facts
from tests.bus.faults.runs import rig_file
from tests.bus.faults.scenarios import Scenario
from tests.bus.own_network import STALL_S, call, repeated
from tests.faults.moments import MOTIONS, experiment_text
from tests.faults.trial import VENTED_PA, Figures, figures_of

if TYPE_CHECKING:
    from epa_rt.logs.recording import Ending
    from tests.bus.driver.emulated import Remote
    from tests.bus.faults.traced import TracedBus

MASTER_IS_PATIENT = {"master": {"frame_timeout": "100 ms"}}
KILLED = -9
_SILENT, _VENTS = 300, 8000  # cycles after the kill: watched for, at least and at most
_LONGEST_S = 60.0  # a bound for a hung test, not a figure


def figures_of_kill(rig_name: str, pressure: str = "") -> Figures:
    """The rig's figures from the last frame of its master on; ``code`` is -9. A drive that holds
    has no ``power_off_s``. Raises tests.bus.own_network.CallFailed.
    """
    facts = repeated(
        f"kill -9, {rig_name}",
        lambda: call("tests.bus.faults.killed:kill_the_master", rig=rig_name, pressure=pressure),
        STALL_S,
    )
    return Figures(*facts["figures"])


def kill_the_master(rig: str = "bench", pressure: str = "") -> dict:
    """What the plant went through after the kill, and what the log says. ``pressure``: of the
    muscles, empty for the one of tests.faults.moments. Raises RuntimeError where the run ended
    before.
    """
    from epa_rt.config.rig import load_rig
    from epa_rt.logs.reader import LogReader
    from tests.bus.faults.traced import traced

    scenario = Scenario((), "", "", 0, rig=rig, real_time=True, settings=MASTER_IS_PATIENT)
    at_speed = {"faults": (), "when": "at speed", "after": 1}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rig_path, log = rig_file(scenario, folder), folder / "run.mcap"
        experiment = folder / "faults.yaml"
        usual = MOTIONS[rig].words["pressure"]
        experiment.write_text(
            experiment_text(rig).replace(usual, pressure or usual), encoding="utf-8"
        )
        loaded = load_rig(rig_path)
        with traced(loaded, False, at_speed) as bus:
            _run_and_kill(bus, experiment, rig_path, log)
            killed_at = bus.do(_cycle)
            _until(lambda: bus.do(_is_over, killed_at))
            rows, _, last_frame_cycle = bus.do(_trace)
        _until(lambda: _ending(log) is not None)
        with LogReader(log) as reader:
            ending, missing = reader.ending, reader.missing
            texts = [event.text for event in reader.events()]
    before = next(row for row in rows if row.cycle == last_frame_cycle)
    after = [row for row in rows if row.cycle >= last_frame_cycle]
    return {
        "was_on": before.powered,
        "was_holding": not any(before.exhaust_open),
        "speed_m_s": abs(before.speed_m_s),
        "last_frame_cycle": last_frame_cycle,
        **rig_facts(after, loaded),
        "figures": list(figures_of(after, 0, loaded, KILLED, "", ending.cause)),
        "missing": missing,
        "cause": ending.cause,
        "texts": texts[-3:],
    }


def _run_and_kill(bus: "Remote", experiment: Path, rig: Path, log: Path) -> None:
    """``epa run`` in a process of its own, killed once the rig is at speed."""
    from tests.bus.driver.emulated import MASTER_END

    words = ["run", experiment, "--rig", rig, "--backend", "ethercat", "--interface", MASTER_END]
    command = [sys.executable, "-W", "error", "-m", "epa_rt", *map(str, words)]
    master = subprocess.Popen([*command, "-o", str(log), "--quiet"], stdout=subprocess.DEVNULL)
    try:
        _until(lambda: master.poll() is not None or bus.do(_is_at_speed))
    finally:
        master.kill()
        code = master.wait()
    if code != KILLED:
        ending = _ending(log)
        cause = ending.cause if ending else "no log says why"
        raise RuntimeError(f"the run ended with exit code {code} before it was at speed: {cause}")


def _until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + _LONGEST_S
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError("waited in vain")
        time.sleep(0.005)


NEAR = 0.7  # of the speed that tells the moment


def _ending(log: Path) -> "Ending | None":
    from epa_rt.logs.reader import LogError, LogReader

    try:
        with LogReader(log) as reader:
            return reader.ending
    except LogError:
        return None


def _cycle(bus: "TracedBus") -> int:
    return bus.cycle


def _is_at_speed(bus: "TracedBus") -> bool:
    """A busy machine is late, and its motor slower than asked: near the speed will do."""
    if not bus.rows:
        return False
    row = bus.rows[-1]
    holding = row.powered and not any(row.inlet_open) and not any(row.exhaust_open)
    return holding and abs(row.speed_m_s) > NEAR * MOTIONS[bus.rig.name].fast_m_s


def _is_over(bus: "TracedBus", killed_at: int) -> bool:
    """Whether nothing more is to come: the muscles are vented, or have had their time."""
    vented = max(bus.rows[-1].pressure_pa) < bus.rig.atmosphere_pa + VENTED_PA
    return bus.cycle > killed_at + (_SILENT if vented else _VENTS)


def _trace(bus: "TracedBus") -> tuple:
    return bus.rows, bus.injected_at, bus.last_frame_cycle
