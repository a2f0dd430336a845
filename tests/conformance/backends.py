"""The backends that are held to the protocol. A new one joins with one line in FACTORIES.

A factory takes a rig and a scenario and gives a backend that is not open yet. The scenario says
what the test will send; only a backend that cannot answer freely (a recorded log) needs to know it
beforehand.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path

from epa_rt.backend import Backend
from epa_rt.config.rig import Rig, load_rig
from epa_rt.control.analog_drive import OutputEnabler
from epa_rt.control.cia402 import DriveEnabler
from epa_rt.logs.layout import FLAG_WORKING_COUNTER_OK
from epa_rt.logs.replay import RecordedCycles, ReplayBackend
from epa_rt.models.plant_file import load_plant
from epa_rt.signals.codec import Decoder, Encoder
from sim_backend.backend import SimBackend
from tests.other_terminals import EDITS, rig_of

ROOT = Path(__file__).resolve().parents[2]
RIGS = ("bench", "bench_analog", "knee", "mass", *EDITS)  # with every terminal that is known
CYCLES = 200  # of every scenario


@cache
def rig(name: str) -> Rig:
    if name in EDITS:
        return rig_of(name)
    return load_rig(ROOT / "config" / "rigs" / f"{name}.yaml")


class Rest:
    """Sends the safe outputs."""

    def __init__(self, on: Rig):
        self.decoder, self.encoder = Decoder(on), Encoder(on)
        self.outputs_raw = self.encoder.safe_raw

    def step(self, inputs_raw: bytes) -> bytes:
        self.measured = self.decoder.decode(inputs_raw)
        return self.outputs_raw


class Walk(Rest):
    """Enables the drive in speed mode at rest, valves de-energised; ``control`` and ``status`` are
    what passed.
    """

    def __init__(self, on: Rig):
        super().__init__(on)
        self.on, self.status, self.control = on, [], []
        self.enabler = OutputEnabler(50) if on.drive.interface == "analog" else DriveEnabler(150)
        self.enabler.enable()

    def step(self, inputs_raw: bytes) -> bytes:
        measured, command, drive = (
            self.decoder.decode(inputs_raw),
            dict(self.encoder.safe),
            self.on.drive,
        )
        self.measured = measured
        if drive.interface == "analog":
            command[drive.enable] = float(self.enabler.step())
            self.control.append(command[drive.enable])
        else:
            self.status.append(measured[drive.status_word])
            command[drive.control_word] = self.enabler.step(measured[drive.status_word])
            command[drive.mode] = 9
            self.control.append(command[drive.control_word])
            command[self.on.motor.position_target] = measured[self.on.motor.position]
        return self.encoder.encode(command)


SCENARIOS = {"rest": Rest, "walk": Walk}


def simulated(on: Rig, scenario: str, seed: int = 1, speed: float | None = None) -> SimBackend:
    return SimBackend(on, load_plant(ROOT / "config" / "rigs" / on.plant), seed, speed)


def recorded(on: Rig, scenario: str) -> ReplayBackend:
    """What the simulated rig answered to the scenario, as a log has it."""
    source, operator = simulated(on, scenario), SCENARIOS[scenario](on)
    outputs, rows, sent = operator.outputs_raw, [], b""
    source.open()
    for _ in range(CYCLES):
        rows.append(source.exchange(outputs))
        outputs = operator.step(rows[-1].inputs_raw)
        sent += outputs
    source.close()
    zeros = [0] * CYCLES
    cycles = RecordedCycles(
        [r.cycle for r in rows],
        [r.t_ns for r in rows],
        [FLAG_WORKING_COUNTER_OK] * CYCLES,
        zeros,
        zeros,
        zeros,
        zeros,
        b"".join(r.inputs_raw for r in rows),
        sent,
        operator.decoder.size,
        operator.encoder.size,
    )
    return ReplayBackend(cycles, on.period_s, simulated=True)


FACTORIES: dict[str, Callable[[Rig, str], Backend]] = {
    "sim": simulated,
    "sim paced": lambda on, scenario: simulated(on, scenario, speed=20.0),
    "replay": recorded,
}
