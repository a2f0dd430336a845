"""Which column of a recording is which instrument of the plant: scale to the plant's port, size of
a count, rounding.
"""

import math
from typing import NamedTuple

import numpy as np

from epa_rt.config.ports import DRIVE_SPEED_PORT
from epa_rt.config.rig import Rig, Slave
from epa_rt.config.rig_checks import entries_of
from epa_rt.config.rig_protection_rule import entry_of
from epa_rt.signals.scaling import scaling_of

_DRIVE_ENTRIES = {
    "position": "motor_angle_rad",
    "speed": "motor_speed_rad_s",
    "current": "motor_current_a",
    "torque": "motor_torque_nm",
}


class Channel(NamedTuple):
    """One measured column. Reading of the plant's port = ``scale`` x column + ``offset``; ``step``
    is the quantum of the port (0 where none); ``floors`` where the device cuts downward (a counter)
    instead of rounding; ``anchor`` is a port value that lies on the grid.
    """

    port: str
    column: str
    scale: float
    offset: float
    step: float
    floors: bool
    anchor: float
    low: float
    high: float

    def quantised(self, values: np.ndarray) -> np.ndarray:
        """(N,) port values as the device presents them."""
        if self.step == 0.0:
            return values
        steps = (values - self.anchor) / self.step
        counts = np.floor(steps) if self.floors else np.floor(steps + 0.5)
        return np.clip(counts * self.step + self.anchor, self.low, self.high)

    def to_column(self, port_values: np.ndarray) -> np.ndarray:
        """(N,) the way back: port values as the column has them."""
        return (port_values - self.offset) / self.scale


def channels_of(rig: Rig) -> dict[str, Channel]:
    """Port name of the plant to the channel that shows it, for every port that the rig has a row
    for.
    """
    entries = {
        f"{slave.name}.{entry.name}": (slave, entry)
        for slave in rig.slaves
        for entry in entries_of(slave, outputs=False)
    }
    found = {}
    for row in rig.inputs:
        slave, entry = entries[row.entry]
        if row.name.endswith("_raw") or entry.code == "?":
            continue
        line = scaling_of(row, entry, rig)
        if slave.device == "EPOS4":
            port, unit_per_count = _drive_port(entry.name, slave)
            if port is None:
                continue
            scale = unit_per_count / line.slope
            offset = -line.intercept * scale
            step, floors = unit_per_count, entry.name == "position"
        elif row.port is not None:
            port, scale, step, floors = row.port, 1.0, abs(line.slope) * _step(slave), False
            offset = -rig.atmosphere_pa if row.reads in ("gauge", "absolute") else 0.0
        else:
            continue
        if port in found and not slave.description.is_drive:
            continue  # a second sensor of what the drive measures too
        ends = sorted(scale * line.to_si(count) + offset for count in entry.counts)
        found[port] = Channel(
            port, row.name, scale, offset, step, floors, scale * line.to_si(0) + offset, *ends
        )
    return found


def _step(slave: Slave) -> int:
    """Counts of a terminal's converter."""
    sampling = slave.description.sampling
    return 1 if sampling is None else sampling.step


def _drive_port(name: str, slave) -> tuple[str | None, float]:
    """Port behind an entry of the drive, and what one count of it is there."""
    sizes = {
        "position": 2 * math.pi / slave.counts_per_turn,
        "speed": 2 * math.pi / 60.0,
        "current": 1e-3,
        "torque": 1e-3 * slave.rated_torque,
    }
    return _DRIVE_ENTRIES.get(name), sizes.get(name, 0.0)


def analog_speed_step(rig: Rig) -> float:
    """rad/s of the motor per presented count of the voltage that commands its speed; 0 where the
    bus commands it.
    """
    row = next((row for row in rig.outputs if row.port == DRIVE_SPEED_PORT), None)
    for slave in rig.slaves:
        if slave.device == "EPOS4" and slave.analog_command is not None and row is not None:
            volt_per_count = entry_of(rig, row).per_count
            return slave.analog_command.speed_per_volt * volt_per_count
    return 0.0
