"""One run on the simulated rig with one fault at one moment, and what the rig went through."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from epa_rt.backend import Exchange
from epa_rt.cli.inputs import Inputs, load_inputs
from epa_rt.cli.run import closing_text, exit_code, run_recorded
from epa_rt.config.rig import Rig
from epa_rt.loop.requests import AGAIN_S, OperatorRequests
from epa_rt.models.plant_file import PlantFile
from sim_backend.backend import SimBackend
from sim_backend.faults import PLANT_FAULTS, FaultyRigModel, make_fault
from tests.faults.moments import MomentWatch, Row, experiment_text, row_of

ROOT = Path(__file__).resolve().parents[2]
AFTERWARDS_S = 8.0  # the plant goes on for this long after the run, as a rig does
STANDS_M_S = 0.002  # slower than this is at rest
VENTED_PA = 8000.0  # gauge, as safety.sensors.vented
CTRL_C, CTRL_C_TWICE = "Ctrl-C", "Ctrl-C twice"


class Fault(NamedTuple):
    """A kind of fault, what it hits and how hard; None takes the kind's usual value."""

    kind: str
    where: str = ""
    value: float | None = None

    def __str__(self) -> str:
        value = "" if self.value is None else f"{self.value:g}"
        return ", ".join(filter(None, (self.kind, self.where, value)))


class Figures(NamedTuple):
    """From the fault on, of the plant itself; times in s after the fault, None for never."""

    injected: bool
    fastest_m_s: float
    lowest_m: float
    highest_m: float
    highest_pa: float
    highest_force_n: float
    power_off_s: float | None
    speed_at_power_off_m_s: float
    rest_s: float | None
    vented_s: float | None
    code: int
    category: str
    said: str


class FaultyBackend(SimBackend):
    """The simulated backend with a fault that comes at a moment, and a trace of the plant."""

    def __init__(self, rig: Rig, plant: PlantFile, faults: tuple[Fault, ...], moment: str):
        super().__init__(rig, plant, 1, None, model=FaultyRigModel(rig, plant, 1))
        self.rows: list[Row] = []
        self.injected_at: int | None = None
        self.requests = OperatorRequests(rig.period_s)
        self._faults, self._watch = faults, MomentWatch(rig, moment)
        self._muscles = len(rig.muscles)
        self._again: int | None = None

    def exchange(self, outputs_raw: bytes) -> Exchange:
        found = super().exchange(outputs_raw)
        row = row_of(self._model, self._muscles)
        self.rows.append(row)
        if self._watch.step(row) and self._faults:
            self.injected_at = len(self.rows)
            for fault in self._faults:
                self._inject(fault)
        if self._again == len(self.rows):
            self.requests.ask()
        return found

    def _inject(self, fault: Fault) -> None:
        if fault.kind in (CTRL_C, CTRL_C_TWICE):
            self.requests.ask()
            if fault.kind == CTRL_C_TWICE:
                self._again = len(self.rows) + round(1.1 * AGAIN_S / self.period_s)
            return
        at = self._model.cycle_number
        self._model.faults.add(make_fault(PLANT_FAULTS, fault.kind, fault.where, fault.value, at))

    def time_goes_on(self) -> None:
        """After the run: outputs as ``close`` left them."""
        safe = bytes(self._size)
        for _ in range(round(AFTERWARDS_S / self.period_s)):
            self._model.cycle(safe)
            self.rows.append(row_of(self._model, self._muscles))


def inputs_of(rig_name: str, folder: Path) -> Inputs:
    """Rig, plant and the experiment with all four moments."""
    experiment = folder / "faults.yaml"
    experiment.write_text(experiment_text(rig_name), encoding="utf-8")
    return load_inputs(experiment, ROOT / f"config/rigs/{rig_name}.yaml", None, with_plant=True)


def run_trial(rig_name: str, fault: Fault, moment: str, *more: Fault) -> Figures:
    """A whole run as the command line makes it, then eight seconds more of the plant. ``more``:
    what comes in the same cycle.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        inputs = inputs_of(rig_name, folder)
        backend = FaultyBackend(inputs.rig, inputs.plant, (fault, *more), moment)
        summary, result = run_recorded(
            inputs,
            backend,
            folder / "run.mcap",
            {"backend": "sim"},
            paced=False,
            progress=False,
            requests=backend.requests,
        )
        backend.time_goes_on()
        said = closing_text(summary, result, inputs.rig)
    return figures_of(
        backend.rows,
        backend.injected_at,
        inputs.rig,
        exit_code(summary, result),
        result.category,
        said,
    )


def figures_of(
    rows: list[Row], injected_at: int | None, rig: Rig, code: int, category: str, said: str
) -> Figures:
    """The figures of a trace; without an injection of the whole of it."""
    after = rows[injected_at or 0 :]
    off = next((i for i, row in enumerate(after) if not row.powered), None)
    vented_pa = rig.atmosphere_pa + VENTED_PA
    return Figures(
        injected_at is not None,
        max(abs(row.speed_m_s) for row in after),
        min(row.travel_m for row in after),
        max(row.travel_m for row in after),
        max(max(row.pressure_pa) for row in after),
        max(row.force_n for row in after),
        None if off is None else off * rig.period_s,
        0.0 if off is None else abs(after[off].speed_m_s),
        _since(after, rig.period_s, lambda row: abs(row.speed_m_s) < STANDS_M_S),
        _since(after, rig.period_s, lambda row: max(row.pressure_pa) < vented_pa),
        code,
        category,
        said,
    )


def _since(rows: list[Row], period_s: float, holds: Callable[[Row], bool]) -> float | None:
    """From when on it holds to the end; None where it does not at the end."""
    for back, row in enumerate(reversed(rows)):
        if not holds(row):
            return None if back == 0 else (len(rows) - back) * period_s
    return 0.0
