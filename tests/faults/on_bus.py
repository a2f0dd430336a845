"""One run on the emulated bus, in lock step, with one fault at one moment, and what the rig went
through. The twin of trial.py, for faults that the simulated backend has not got.
"""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.config.rig import load_rig
from sim_backend.bus.fault_kinds import FRAME_FAULTS
from tests.bus.faults.runs import epa_run, rig_file
from tests.bus.faults.scenarios import Scenario
from tests.bus.faults.traced import traced
from tests.bus.own_network import LOCK_STEP_STALL_S, call, repeated
from tests.faults.moments import experiment_text
from tests.faults.trial import AFTERWARDS_S, Fault, Figures, figures_of

if TYPE_CHECKING:
    from tests.bus.faults.traced import TracedBus

LOST_FRAME_S = 0.1  # how long the master waits for a frame that does not come; no time of the plant
CATEGORY = "stop category "  # how the line of the closing text begins


def run_on_bus(rig_name: str, fault: Fault | None, moment: str) -> Figures:
    """A whole run as the command line makes it, then eight seconds more of the plant; in a network
    of its own. Raises tests.bus.own_network.CallFailed.

    ``fault``: any kind that the emulator offers, or TWO_OF_THREE of tests.bus.faults.traced; the
    value of a fault of frames is how many of them it hits.
    """
    given = None if fault is None else list(fault)
    found = repeated(
        f"{rig_name}: {fault}, {moment}",
        lambda: call("tests.faults.on_bus:trial", rig_name=rig_name, fault=given, moment=moment),
        LOCK_STEP_STALL_S,
    )
    return Figures(*found)


def trial(rig_name: str, fault: list | None, moment: str) -> list:
    """The same, inside that network; fault and figures as lists."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = rig_file(Scenario((), "", "", 0, rig=rig_name), folder)
        experiment = folder / "faults.yaml"
        experiment.write_text(experiment_text(rig_name), encoding="utf-8")
        plan = None if fault is None else _plan(Fault(*fault), moment)
        with traced(load_rig(path), True, plan) as bus:
            code, said = epa_run(experiment, path, folder / "run.mcap", True, LOST_FRAME_S)
            return list(bus.do(_figures, code, said))


def _plan(fault: Fault, moment: str) -> dict:
    given: dict = {"kind": fault.kind, "where": fault.where}
    if fault.value is not None:
        hits_frames = fault.kind in FRAME_FAULTS and FRAME_FAULTS[fault.kind].value is None
        given |= {"cycles": round(fault.value)} if hits_frames else {"value": fault.value}
    return {"faults": [given], "when": moment, "after": 1}


def _figures(bus: "TracedBus", code: int, said: str) -> Figures:
    """In the emulator: the plant goes on, then its figures."""
    bus.time_goes_on(round(AFTERWARDS_S / bus.rig.period_s))
    category = next((line for line in said.splitlines() if line.startswith(CATEGORY)), "")
    return figures_of(bus.rows, bus.injected_at, bus.rig, code, category, said)
