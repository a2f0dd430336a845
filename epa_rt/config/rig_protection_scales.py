"""Rules on signs and sizes that must agree: travel and speed per turn of the motor."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from epa_rt.config.rig_protection_rule import (
    Breach,
    Rule,
    entry_of,
    line_of,
    of_row,
    shown,
    slave_of,
)
from epa_rt.config.rig_rows import SignalRow

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig

SAME = 0.01  # spool and gear are written with three or four digits
SAME_ZERO = 0.01  # of the row's range: where travel and its command put their zero


def _per_turn(rig: "Rig", row: SignalRow) -> float | None:
    """Travel for one turn of the motor's shaft (SI); None where the entry is no count, rpm or
    voltage of the drive.
    """
    entry, slave, slope = entry_of(rig, row), slave_of(rig, row), line_of(rig, row)[0]
    drive = next((s for s in rig.slaves if s.device == "EPOS4"), None)
    if slave.device == "EPOS4" and entry.unit == "count":
        return slope * slave.counts_per_turn
    if slave.device == "EPOS4" and entry.unit == "rpm":
        return slope * 60.0
    if entry.unit == "V" and drive is not None and drive.analog_command is not None:
        turns_per_s_v = float(drive.analog_command.speed_per_volt) / (2.0 * math.pi)
        return slope / turns_per_s_v
    return None


def _scales(rig: "Rig") -> Iterator[Breach]:
    """A command whose sign or size differs from what is measured runs away, or runs too far."""
    motor = rig.motor
    position = rig.row(motor.position)
    base = _per_turn(rig, position)
    if base is None:
        return
    for name in (motor.speed, motor.position_target, motor.speed_target):
        if name is None:
            continue
        row = rig.row(name)
        found = _per_turn(rig, row)
        if found is None or abs(found - base) <= SAME * abs(base):
            continue
        what = "the other way" if found * base < 0.0 else "another size"
        unit = position.si_unit
        yield of_row(
            rig,
            row,
            "calibration",
            f"{shown(found, unit)} per turn of the motor, {what}",
            f"{shown(base, unit)} per turn, as {position.name} has it",
        )


def _zeros(rig: "Rig") -> Iterator[Breach]:
    motor = rig.motor
    if motor.position_target is None:
        return
    target, position = rig.row(motor.position_target), rig.row(motor.position)
    if slave_of(rig, target).name != slave_of(rig, position).name or position.limits is None:
        return
    zeros = line_of(rig, target)[1], line_of(rig, position)[1]
    if abs(zeros[0] - zeros[1]) > SAME_ZERO * (position.limits[1] - position.limits[0]):
        yield of_row(
            rig,
            target,
            "calibration",
            f"{shown(zeros[0], target.si_unit)} at 0 counts",
            f"{shown(zeros[1], position.si_unit)}, as {position.name} has it",
        )


SCALE_RULES = (
    Rule(
        "scale",
        _scales,
        "travel, speed and their commands agree per turn of the motor, sign and size, to 1 %",
    ),
    Rule("same_zero", _zeros, "travel and its command have one zero, to 1 % of the range"),
)
