"""One run on the emulated bus, in lock step, with one fault of the bus at one moment, and what the
rig went through. The twin of trial.py, for faults that the simulated backend has not got.
"""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from epa_rt.config.rig import load_rig
from tests.bus.faults.runs import epa_run, rig_file
from tests.bus.faults.scenarios import Scenario
from tests.bus.faults.traced import TWO_OF_THREE, traced
from tests.bus.own_network import LOCK_STEP_STALL_S, call, repeated
from tests.faults.moments import experiment_text
from tests.faults.trial import AFTERWARDS_S, Figures, figures_of

if TYPE_CHECKING:
    from tests.bus.faults.traced import TracedBus

ROOT = Path(__file__).resolve().parents[2]
LOST_FRAME_S = 0.1  # how long the master waits for a frame that does not come; no time of the plant


class BusFault(NamedTuple):
    """A kind of fault of the bus or the drive, what it hits, and for how many cycles or frames;
    None takes the kind's usual length.
    """

    kind: str
    where: str = ""
    cycles: int | None = None


def bus_faults(rig_name: str) -> dict[str, BusFault]:
    """Every fault of the bus that a rig is tried with, by its name in a table."""
    slaves = [slave.name for slave in load_rig(ROOT / f"config/rigs/{rig_name}.yaml").slaves]
    return {
        "cable_pulled": BusFault("cable_pulled"),
        "frames_lost, 3": BusFault("frames_lost", cycles=3),
        "two of three frames lost": BusFault(TWO_OF_THREE),
        **{f"slave_lost, {name}": BusFault("slave_lost", name) for name in slaves},
        **{f"slave_falls, {name}": BusFault("slave_falls", name) for name in slaves},
        "drive_supply_lost": BusFault("drive_supply_lost"),
        "sto": BusFault("sto"),
    }


def run_on_bus(rig_name: str, fault: BusFault | None, moment: str) -> Figures:
    """A whole run as the command line makes it, then eight seconds more of the plant; in a network
    of its own. Raises tests.bus.own_network.CallFailed.
    """
    found = repeated(
        f"{rig_name}: {fault} {moment}",
        lambda: call(
            "tests.faults.on_bus:trial",
            rig_name=rig_name,
            fault=fault and list(fault),
            moment=moment,
        ),
        LOCK_STEP_STALL_S,
    )
    return Figures(*found)


def trial(rig_name: str, fault: list | None, moment: str) -> list:
    """The same, inside that network; figures and fault as lists."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = rig_file(Scenario((), "", "", 0, rig=rig_name), folder)
        experiment = folder / "faults.yaml"
        experiment.write_text(experiment_text(rig_name), encoding="utf-8")
        with traced(load_rig(path), True, _plan(fault, moment)) as bus:
            code, said = epa_run(experiment, path, folder / "run.mcap", True, LOST_FRAME_S)
            return list(bus.do(_figures, code, said))


def _plan(fault: list | None, moment: str) -> dict | None:
    if fault is None:
        return None
    kind, where, cycles = BusFault(*fault)
    given = {"kind": kind, "where": where, **({} if cycles is None else {"cycles": cycles})}
    return {"faults": [given], "when": moment, "after": 1}


def _figures(bus: "TracedBus", code: int, said: str) -> Figures:
    """In the emulator: the plant goes on, then its figures."""
    bus.time_goes_on(round(AFTERWARDS_S / bus.rig.period_s))
    return figures_of(bus.rows, bus.injected_at, bus.rig, code, said)
