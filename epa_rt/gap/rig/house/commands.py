"""What the drive and the valves were told, cycle by cycle, from a recording's sent commands."""

import math

import numpy as np

from epa_rt.config.devices import EPOS4_OUTPUTS
from epa_rt.config.ports import DRIVE_SPEED_PORT, VALVE_PORTS
from epa_rt.config.rig import Rig
from epa_rt.config.rig_checks import entries_of
from epa_rt.gap.rig.house.channels import analog_speed_step
from epa_rt.gap.rig.house.smooth import bridged
from epa_rt.logs.layout import ANSWERED_AFTER
from epa_rt.models.blocks.bus import POSITION_MODE
from epa_rt.models.blocks.drive import SPEED_MODE, TORQUE_MODE
from epa_rt.models.ports import COMMAND
from epa_rt.signals.scaling import scaling_of

_STATE, _RUNNING, _QUICK_STOP = 0x6F, 0x27, 0x07  # CiA 402 status word
_TARGETS = {
    "target_position": "target_angle_rad",
    "target_speed": "target_speed_rad_s",
    "target_torque": "target_torque_nm",
}
_MODES = {
    "target_position": POSITION_MODE,
    "target_speed": SPEED_MODE,
    "target_torque": TORQUE_MODE,
}


def commands_of(rig: Rig, columns: dict[str, np.ndarray]) -> np.ndarray:
    """(N,) COMMAND: row k is what acted on the plant in the cycle whose end row k samples.

    ``columns``: of a gapless recording. Enabled and mode are the drive's own word on them, sampled
    at the end of that cycle.
    """
    count = len(next(iter(columns.values())))
    commands = np.zeros(count, COMMAND)
    status = _integers(columns, status_row(rig), count)
    commands["enabled"] = is_on(status)
    commands["mode"] = SPEED_MODE
    if rig.drive.interface == "cia402":
        commands["mode"] = _integers(columns, rig.drive.mode_display, count)
    _write_targets(rig, columns, commands)
    stopping = status & _STATE == _QUICK_STOP
    commands["mode"][stopping], commands["target_speed_rad_s"][stopping] = SPEED_MODE, 0.0
    return commands


def is_on(status: np.ndarray) -> np.ndarray:
    """(N,) bool: whether status words, whole numbers, say operation enabled or quick stop."""
    state = status.astype(np.int64) & _STATE
    return (state == _RUNNING) | (state == _QUICK_STOP)


def status_row(rig: Rig) -> str | None:
    """The row of the drive's status word; None for a drive that has none."""
    return next((row.name for row in rig.inputs if row.entry.endswith(".status_word")), None)


def read_rows(rig: Rig, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """(N,) bool by name: where the diagnosis reads a command, or the drive's word on its state and
    mode. Raises KeyError where that word has no column.
    """
    count = len(next(iter(columns.values())))
    status, always = status_row(rig), np.ones(count, bool)
    on = _integers(columns, status, count) & _STATE == _RUNNING
    found = {} if status is None else {status: always}
    mode = np.full(count, SPEED_MODE)
    if rig.drive.interface == "cia402":
        found[rig.drive.mode_display], mode = on, _integers(columns, rig.drive.mode_display, count)
    for row in rig.outputs:
        asked = row.entry.split(".")[-1]
        if row.port in VALVE_PORTS or row.port == DRIVE_SPEED_PORT:
            found[row.name] = always
        elif asked in _MODES:
            found[row.name] = on & (mode == _MODES[asked])
    return found


def untold(rig: Rig, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """(N,) bool by name: where a command or a word is missing that is read, though something was
    recorded. KeyError as ``read_rows``, and for a row without a column.
    """
    lost = lost_rows(rig, columns)
    return {
        name: read & np.isnan(columns[name]) & ~lost
        for name, read in read_rows(rig, columns).items()
    }


def _integers(columns, name: str | None, count: int) -> np.ndarray:
    if name is None:
        return np.full(count, _RUNNING)
    return _held(columns[name], 0.0).astype(np.int64)


def _held(values: np.ndarray, first: float) -> np.ndarray:
    """Gaps (NaN) keep the value before them; ``first`` where there is none."""
    good = np.isfinite(values)
    if good.all():
        return values
    last = np.maximum.accumulate(np.where(good, np.arange(len(values)), -1))
    return np.where(last >= 0, values[np.maximum(last, 0)], first)


def _between(values: np.ndarray, lost: np.ndarray) -> np.ndarray:
    """A target where rows are lost and it was filled in, or where it is missing: on from the one
    before to the one after, for what a recorder loses the drive has had.

    In a cycle without sound process data the row is there, and says what was sent.
    """
    missing = np.isnan(values)
    filled = (missing & (lost | np.logical_or.accumulate(~missing))) | (
        lost & (values == np.concatenate([[np.nan], values[:-1]]))
    )
    return (
        np.where(filled, bridged(np.where(filled, np.nan, values)), values)
        if filled.any()
        else values
    )


def _aged(values: np.ndarray, first: float) -> np.ndarray:
    return np.concatenate(
        [np.full(min(ANSWERED_AFTER, len(values)), first), _held(values, first)[:-ANSWERED_AFTER]]
    )


def lost_rows(rig: Rig, columns: dict[str, np.ndarray]) -> np.ndarray:
    """(N,) bool: rows of which nothing was recorded, whatever has been filled in for what was
    sent.
    """
    found = np.ones(len(next(iter(columns.values()))), bool)
    for row in rig.inputs:
        if row.name in columns:
            found &= np.isnan(columns[row.name])
            if not found.any():
                break
    return found


def _write_targets(rig: Rig, columns, commands: np.ndarray) -> None:
    lost = lost_rows(rig, columns)
    entries = {
        f"{slave.name}.{entry.name}": (slave, entry)
        for slave in rig.slaves
        for entry in entries_of(slave, outputs=True)
    }
    position = next((row for row in rig.outputs if row.entry.endswith(".target_position")), None)
    for row in rig.outputs:
        slave, entry = entries[row.entry]
        if row.port in VALVE_PORTS:
            muscle, is_exhaust = VALVE_PORTS[row.port]
            commands["exhaust" if is_exhaust else "inlet"][:, muscle] = (
                _aged(columns[row.name], row.safe) > 0.5
            )
            continue
        values = _aged(_between(columns[row.name], lost), row.safe)
        if slave.device == "EPOS4" and entry.name in _TARGETS:
            line = scaling_of(row, entry, rig)
            counts = np.rint((values - line.intercept) / line.slope)
            size = {
                "target_position": 2 * math.pi / slave.counts_per_turn,
                "target_speed": 2 * math.pi / 60.0,
                "target_torque": 1e-3 * slave.rated_torque,
            }[entry.name]
            commands[_TARGETS[entry.name]] = counts * size
        elif row.port == DRIVE_SPEED_PORT:
            line = scaling_of(row, entry, rig)
            counts = np.rint((values - line.intercept) / line.slope)
            step = slave.description.output_step
            commands["target_speed_rad_s"] = np.floor(counts / step) * step * analog_speed_step(rig)
    if position is None:
        commands["target_angle_rad"] = 0.0


assert {"target_position", "target_speed", "target_torque"} <= {
    entry.name for entry in EPOS4_OUTPUTS
}
