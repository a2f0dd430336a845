"""Rules on signs and sizes that must agree: travel and speed per turn of the motor, limits of
motion and the length of a muscle.
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from epa_rt.config.rig_protection_rule import (
    Breach,
    Rule,
    entry_of,
    line_of,
    of_row,
    range_shown,
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


def _drive_units(rig: "Rig") -> Iterator[Breach]:
    """A drive says itself what its currents and torques are: mA, and permille of rated_torque."""
    for row in rig.signals:
        slave = slave_of(rig, row)
        if slave.device != "EPOS4" or row.si_unit not in ("A", "N*m"):
            continue
        native = entry_of(rig, row).unit
        if (native, row.si_unit) not in (("mA", "A"), ("permille", "N*m")):
            continue
        expected = 1.0 if native == "mA" else slave.rated_torque
        found = 1e3 * abs(line_of(rig, row)[0])
        if abs(found - expected) > SAME * expected:
            means = "1 A" if native == "mA" else f"rated_torque, {shown(expected, 'N*m')}"
            yield of_row(
                rig,
                row,
                "calibration",
                f"{shown(found, row.si_unit)} at 1000 {native} of {slave.name}",
                means,
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


def _muscle_lengths(rig: "Rig") -> Iterator[Breach]:
    """Where a muscle would be longer than the thread of its braid, or shorter than nothing, no
    limit of motion is ever reached. The other axis of the rig may stand where it suits best.
    """
    motor, joint = rig.row(rig.motor.position), rig.joint and rig.row(rig.joint.position)
    still = (0.0, 0.0)
    travels, angles = motor.limits or still, joint.limits or still if joint else still
    for muscle in rig.muscles:
        if (law := muscle.law) is None:
            continue
        by_travel = sorted(law.per_travel * end for end in travels)
        by_joint = sorted(law.per_joint * end for end in angles)
        for row, own, other in ((motor, by_travel, by_joint), (joint, by_joint, by_travel)):
            if row is None or row.limits is None or own[0] == own[1]:
                continue
            shortest_high = law.rest_length + own[1] + other[0]
            longest_low = law.rest_length + own[0] + other[1]
            if shortest_high >= law.braid_length or longest_low <= 0.0:
                end = shortest_high if shortest_high >= law.braid_length else longest_low
                yield of_row(
                    rig,
                    row,
                    "limits",
                    f"limits of {range_shown(row.limits, row.si_unit)}, at which {muscle.name}"
                    f" would be {shown(end, 'm')} long",
                    f"limits at which {muscle.name} is longer than 0 mm and shorter than its"
                    f" braid_length, {shown(law.braid_length, 'm')}",
                )


SCALE_RULES = (
    Rule(
        "scale",
        _scales,
        "travel, speed and their commands agree per turn of the motor, sign and size, to 1 %",
    ),
    Rule(
        "drive_units",
        _drive_units,
        "currents of a drive are its mA, torques its permille of `rated_torque`, to 1 %",
    ),
    Rule("same_zero", _zeros, "travel and its command have one zero, to 1 % of the range"),
    Rule(
        "muscle_length",
        _muscle_lengths,
        "limits of travel and joint end before a muscle is as long as its braid, or has no length",
    ),
)
