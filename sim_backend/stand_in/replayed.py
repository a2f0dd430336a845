"""The plant's commands that a log's output bytes stand for, and the stand-in (or any physics) run
over them again.
"""

from pathlib import Path

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.logs.reader import LogReader
from epa_rt.models.ports import COMMAND, SENSORS
from sim_backend.devices import MACHINE, latch_outputs
from sim_backend.stand_in import plant
from sim_backend.wiring import wire_drive, wire_valves


def commands_of_log(rig: Rig, path: Path | str) -> np.ndarray:
    """What acted on the plant in the cycle whose end row k of a log samples, (N,) COMMAND."""
    with LogReader(path) as log:
        outputs = log.raw()[1]
    return commands_of(rig, outputs)


def commands_of(rig: Rig, outputs: np.ndarray) -> np.ndarray:
    """As ``commands_of_log`` from output images, (N, bytes) u8: row k is computed from what row k
    samples, sent with the next exchange and acts in the cycle after it.
    """
    valves, drive = wire_valves(rig), wire_drive(rig)
    machine, command = np.zeros(1, MACHINE), np.zeros(1, COMMAND)
    out = np.zeros(len(outputs), COMMAND)
    latch_outputs(np.zeros(outputs.shape[1], np.uint8), valves, drive, machine, command)
    for k in range(len(outputs)):
        out[k] = command[0]
        if k > 0:
            latch_outputs(np.ascontiguousarray(outputs[k - 1]), valves, drive, machine, command)
    return out


def run_again(
    params: np.ndarray,
    commands: np.ndarray,
    period_s: float,
    substeps: int = plant.SUBSTEPS,
    physics=plant,
) -> np.ndarray:
    """Readings, (N,) SENSORS, from the rest state."""
    out = np.zeros(len(commands), SENSORS)
    physics.run(params, physics.new_state(params), commands, period_s, substeps, out)
    return out
