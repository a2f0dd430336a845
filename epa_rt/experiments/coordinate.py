"""What a loop controls on a rig: which signals, in which unit, within which limits."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from epa_rt.config.rig import Axis, Rig
from epa_rt.config.rig_rows import si_unit_of


@dataclass(frozen=True)
class Coordinate:
    """One controlled quantity. ``measured`` is None where a phase starts from zero instead
    (torque).
    """

    measured: str | None
    position_key: str
    speed_key: str
    si_unit: str
    places: Mapping[str, float]
    limits: tuple[float, float]
    speed_max: float
    acceleration_max: float


def possible_loops(rig: Rig) -> tuple[str, ...]:
    """The loops that a rig's motor targets and joint allow."""
    motor = rig.motor
    loops = {
        "motor_position": motor.position_target or motor.speed_target,
        "motor_speed": motor.speed_target,
        "motor_torque": motor.torque_target,
        "joint_angle": rig.joint and (motor.position_target or motor.speed_target),
    }
    return tuple(loop for loop, can in loops.items() if can)


def coordinate_of(rig: Rig, loop: str) -> Coordinate:
    """The coordinate that a loop of this rig controls; ask ``possible_loops`` first."""
    if loop == "joint_angle":
        return _axis(rig, rig.joint, _place(rig.joint.position))
    if loop == "motor_torque":
        limits = rig.row(rig.motor.torque_target).limits
        return Coordinate(
            None,
            "ref_motor_torque_nm",
            "ref_motor_torque_rate_nm_s",
            "N*m",
            {},
            limits,
            math.inf,
            math.inf,
        )
    return _axis(rig, rig.motor, "motor")


def _axis(rig: Rig, axis: Axis, place: str) -> Coordinate:
    si_unit = si_unit_of(axis.position)
    suffix = {"m": "m_s", "rad": "rad_s"}[si_unit]
    limits = rig.row(axis.position).limits or (-math.inf, math.inf)
    return Coordinate(
        axis.position,
        f"ref_{axis.position}",
        f"ref_{place}_speed_{suffix}",
        si_unit,
        axis.places,
        limits,
        axis.speed_max,
        axis.acceleration_max,
    )


def _place(name: str) -> str:
    """'knee' of 'knee_angle_rad', 'mass' of 'mass_position_m'."""
    return name.rsplit("_", 2)[0]
