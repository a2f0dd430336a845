"""Sensors that lie, one by one: which fault, on which rig, from which moment, and what a run does.
The truth comes from the simulated plant.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.cli.inputs import Inputs, load_inputs
from epa_rt.loop.assembly import assemble
from epa_rt.loop.run import run
from sim_backend.backend import SimBackend
from sim_backend.faults import PLANT_FAULTS, FaultyRigModel, make_fault
from tests.loop.rigging import Memory, Quiet

ROOT = Path(__file__).resolve().parents[2]
EXPERIMENT = {
    "bench": "identification_short",
    "bench_analog": "identification_short",
    "knee": "knee_chirp_short",
    "knee_geared": "knee_chirp_short",
    "mass": "mass_sine",
}
MOMENTS = ("before the run", "while filling", "in the trial")
AFTER_S = 0.020  # the reaction that rig files ask for: until then the truth counts


@dataclass(frozen=True)
class Lie:
    """One fault: its name, its kind and value, what it does to, and where it is tried."""

    name: str
    kind: str
    row: str  # "pressure", "force", "current", "joint", "travel", "muscle", ""
    value: float | None = None
    moments: tuple[str, ...] = MOMENTS
    rigs: tuple[str, ...] = tuple(EXPERIMENT)


BEFORE = MOMENTS[:1]
KNEES = ("knee", "knee_geared")
LIES = (
    Lie("pressure x 0.8", "sensor_gain", "pressure", 0.8),
    Lie("pressure x 0.5", "sensor_gain", "pressure", 0.5),
    Lie("pressure -40 kPa", "sensor_offset", "pressure", -40e3),
    Lie("pressure frozen", "sensor_stuck", "pressure"),
    Lie("force +100 N", "sensor_offset", "force", 100.0),
    Lie("force x 0.5", "sensor_gain", "force", 0.5),
    Lie("force frozen", "sensor_stuck", "force"),
    Lie("force constant 0 V", "wire_broken", "force", 0.0),
    Lie("force constant 2.5 V", "wire_broken", "force", 2.5),
    Lie("force constant 5 V", "wire_broken", "force", 5.0),
    Lie("current dead", "sensor_gain", "current", 0.0),
    Lie("joint x 0.5", "sensor_gain", "joint", 0.5, BEFORE, (*KNEES, "mass")),
    Lie("joint frozen", "sensor_stuck", "joint", None, MOMENTS, (*KNEES, "mass")),
    Lie("hoses exchanged", "hoses_exchanged", "", None, BEFORE, KNEES),
    Lie("pressure wires exchanged", "pressures_exchanged", "", None, BEFORE, KNEES),
    Lie("count short by 9000", "count_offset", "", -9000.0, BEFORE),
    Lie("count over by 9000", "count_offset", "", 9000.0, BEFORE),
    Lie("muscle burst", "burst", "muscle", None, MOMENTS[1:]),
)


def inputs_of(rig: str) -> Inputs:
    """The rig's own plant with the experiment that it is tried with."""
    return load_inputs(
        ROOT / f"config/experiments/{EXPERIMENT[rig]}.yaml",
        ROOT / f"config/rigs/{rig}.yaml",
        None,
        with_plant=True,
    )


def row_of(inputs: Inputs, role: str) -> str:
    """The rig's name for a role of a fault."""
    rig = inputs.rig
    if role == "force":
        return next(m.law.force for m in rig.muscles if m.law and m.law.force)
    return {
        "pressure": rig.muscles[0].pressure,
        "muscle": rig.muscles[0].name,
        "current": rig.motor.current,
        "joint": rig.joint.position if rig.joint else "",
        "travel": rig.motor.position,
        "": "",
    }[role]


class Truth:
    """The largest true values so far as shares of the rig's limits."""

    def __init__(self, inputs: Inputs):
        rig = self.rig = inputs.rig
        self.largest: dict[str, float] = {}
        self._limits = {}
        for row in rig.inputs:
            if row.limits is not None and not row.name.endswith("_raw"):
                self._limits[row.name] = row.limits
        self._force = next((m.law.force for m in rig.muscles if m.law and m.law.force), None)

    def take(self, model: Any) -> None:
        truth, rig = model.state["truth"][0], self.rig
        for i, muscle in enumerate(rig.muscles):
            high = self._limits[muscle.pressure][1] - rig.atmosphere_pa
            self._keep("pressure", (truth["pressure_pa"][i] - rig.atmosphere_pa) / high)
        if self._force:
            self._keep("force", truth["muscle_force_n"][0] / self._limits[self._force][1])
        self._keep("travel", _share(truth["travel_m"], self._limits[rig.motor.position]))
        self._keep("speed", _share(truth["travel_speed_m_s"], self._limits[rig.motor.speed]))
        self._keep("current", _share(truth["motor_current_a"], self._limits[rig.motor.current]))
        if rig.joint:
            field = "joint_angle_rad" if rig.joint.position.endswith("rad") else "load_position_m"
            self._keep("joint", _share(truth[field], self._limits[rig.joint.position]))

    def _keep(self, name: str, share: float) -> None:
        self.largest[name] = max(self.largest.get(name, 0.0), float(share))


def _share(value: float, limits: tuple[float, float]) -> float:
    return value / limits[1] if value > 0.0 else value / limits[0]


class Watched(SimBackend):
    """The simulated rig with faults; remembers the truth of every cycle until ``closed_at``."""

    def __init__(self, inputs: Inputs, truth: Truth, seed: int = 1):
        super().__init__(inputs.rig, inputs.plant, seed)
        self._model = FaultyRigModel(inputs.rig, inputs.plant, seed)
        self.truth, self.until = truth, lambda: True

    def exchange(self, outputs_raw: bytes) -> Any:
        found = super().exchange(outputs_raw)
        if self.until():
            self.truth.take(self.model)
        return found


def moment_cycles(inputs: Inputs) -> dict[str, int]:
    """The cycle of each moment, from a run without a fault."""
    memory, _, _ = run_with(inputs, None, 0)
    names = inputs.experiment.phase_names
    fill = next(s[0] for s in memory.samples if s[3] >= 0 and "fill" in names[s[3]])
    trial = next(s[0] for s in memory.samples if s[3] >= 0 and names[s[3]].startswith("trial"))
    return {MOMENTS[0]: 0, MOMENTS[1]: fill + 300, MOMENTS[2]: trial + 700}


def run_with(inputs: Inputs, lie: Lie | None, at_cycle: int) -> tuple[Memory, Any, Truth]:
    """One run with one fault from a cycle on: recording, result, true shares until the trip."""
    assembly, truth, memory = assemble(inputs.rig, inputs.experiment), Truth(inputs), Memory()
    backend = Watched(inputs, truth)
    after = round(AFTER_S / inputs.rig.period_s)
    envelope = assembly.envelope
    backend.until = lambda: (
        envelope.tripped is None or len(memory.samples) - envelope.tripped.cycle <= after
    )
    if lie is not None:
        backend.model.faults.add(
            make_fault(PLANT_FAULTS, lie.kind, row_of(inputs, lie.row), lie.value, at_cycle)
        )
    result = run(
        inputs.rig,
        backend,
        assembly.supervisor,
        envelope,
        assembly.decoder,
        assembly.encoder,
        memory,
        Quiet(),
    )
    return memory, result, truth


def facts_of(rig: str, lie: Lie, moment: str, at_cycle: int) -> dict[str, Any]:
    """One row of the table."""
    inputs = inputs_of(rig)
    _, result, truth = run_with(inputs, lie, at_cycle)
    trip = result.trip
    worst = max(truth.largest, key=lambda name: truth.largest[name])
    return {
        "fault": lie.name,
        "rig": rig,
        "moment": moment,
        "outcome": result.outcome,
        "found_after_s": (trip.cycle - at_cycle) * inputs.rig.period_s if trip else None,
        "check": trip.cause if trip else "",
        "signal": trip.signal if trip else "",
        "sentence": result.cause,
        "worst": worst,
        "largest_share": float(np.round(truth.largest[worst], 3)),
        "shares": {name: round(share, 3) for name, share in truth.largest.items()},
    }
