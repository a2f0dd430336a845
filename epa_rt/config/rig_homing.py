"""The drive's own homing: what is written into its objects, and how far that may move the motor.

The driver writes it and reads it back; the simulated drive takes the same. Sources: CiA 402
(0x6098, 0x6099, 0x609A), maxon EPOS4 firmware specification (0x30B0).
"""

import math
from typing import TYPE_CHECKING, NamedTuple

from epa_rt.config.rig_row_checks import reading_line

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig, Zero

INDEX_AT_NEGATIVE, INDEX_AT_POSITIVE, HERE = 33, 34, 37  # 0x6098
RETREAT_SHARE = 0.1  # of distance_max: between two approaches, beyond backlash and overshoot
RAMP_S = 0.1  # from rest to the homing speed, as the other methods take it
BRAKE_FACTOR = 2.0  # of the ramp's own braking distance: a speed loop overshoots
LATE_S = 0.020  # the longest that a drive takes to heed a pulse or a word
RETURN_S = 0.5  # to settle at the pulse again, once braked


class HomingOptions(NamedTuple):
    """One value for each object. ``speed_rpm`` 0: a method that moves nothing needs no speed."""

    method: int  # 0x6098
    home_counts: int  # 0x30B0
    speed_rpm: int = 0  # 0x6099
    acceleration_rpm_s: int = 0  # 0x609A

    @property
    def moves(self) -> bool:
        """Whether the drive moves its motor in homing mode."""
        return self.method != HERE


class IndexWay(NamedTuple):
    """How a homing on the index pulse may move the motor, in the SI unit of its position.

    ``landing``: from the pulse, while it brakes and comes back. ``most``: from the start, where no
    pulse comes. ``longest_s``: until it must be there.
    """

    speed: float
    turn: float
    landing: float
    most: float
    longest_s: float
    confirm_s: float  # from the count set to bit 15
    home: float


def room_behind(rig: "Rig", zero: "Zero") -> float:
    """From the place of zero back to the limit of travel that an approach comes from, in SI."""
    low, high = rig.row(rig.motor.position).limits or (-math.inf, math.inf)
    return high - zero.at if zero.direction == "decreasing" else zero.at - low


def homing_here(rig: "Rig") -> HomingOptions:
    """The count becomes ``motor.zero.at`` where the motor stands; nothing moves."""
    return HomingOptions(HERE, _home_counts(rig))


def homing_by_index(rig: "Rig") -> HomingOptions:
    """At ``motor.zero.speed`` at most, in its direction; the encoder's counts say which is
    positive.
    """
    zero = rig.motor.zero
    counts_grow = (zero.direction == "increasing") == (_counting(rig)[0] > 0.0)
    rpm = 60.0 / travel_per_motor_turn(rig)  # for one m/s (or rad/s)
    speed_rpm = int(rpm * (zero.speed or 0.0))  # downwards: never faster
    acceleration = min(speed_rpm / RAMP_S, rpm * _acceleration_max(rig))
    return HomingOptions(
        INDEX_AT_POSITIVE if counts_grow else INDEX_AT_NEGATIVE,
        _home_counts(rig),
        speed_rpm,
        max(1, int(acceleration)),
    )


def index_way(rig: "Rig") -> IndexWay:
    """One motor turn from the start and what the drive needs to stop, or ``distance_max`` where
    that is less.
    """
    options, zero, turn = homing_by_index(rig), rig.motor.zero, travel_per_motor_turn(rig)
    per_rpm = turn / 60.0
    speed, acceleration = per_rpm * options.speed_rpm, per_rpm * options.acceleration_rpm_s
    landing = BRAKE_FACTOR * 0.5 * speed * speed / acceleration + speed * LATE_S + zero.tolerance
    given = zero.distance_max
    most = min(turn + landing, math.inf if given is None else given)
    settle_s = 2.0 * speed / acceleration + RETURN_S
    # twice the time of the way: a motor that takes longer does not move as it was told
    longest_s = 2.0 * most / speed + settle_s if speed > 0.0 else 0.0
    return IndexWay(
        speed, turn, landing, most, longest_s, settle_s + landing / max(speed, 1e-9), zero.at
    )


def travel_per_motor_turn(rig: "Rig") -> float:
    """Distance between two index pulses of the encoder on the motor's shaft, in SI."""
    slave = rig.row(rig.motor.position).entry.partition(".")[0]
    turn = next(each.counts_per_turn for each in rig.slaves if each.name == slave)
    return abs(_counting(rig)[0]) * turn


def _acceleration_max(rig: "Rig") -> float:
    return min(rig.motor.acceleration_max, rig.motor.stop_deceleration_si)


def _home_counts(rig: "Rig") -> int:
    slope, intercept = _counting(rig)
    counts: int = round((rig.motor.zero.at - intercept) / slope)
    return counts


def _counting(rig: "Rig") -> tuple[float, float]:
    """Slope and intercept from the drive's own counts to the motor's position in SI."""
    row = rig.row(rig.motor.position)
    name, _, place = row.entry.partition(".")
    slave = next(each for each in rig.slaves if each.name == name)
    entry = next(each for each in slave.description.inputs if each.name == place)
    slope, intercept = reading_line(row, entry, rig)
    return slope * entry.per_count, intercept + slope * entry.offset
