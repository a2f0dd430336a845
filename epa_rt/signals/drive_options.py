"""What the drive does by itself when it has to stop: option codes and ramps, from the rig file.

The driver writes them and reads them back; the emulated drive starts from them. Sources: CiA 402
(0x6007, 0x605A to 0x605E, 0x6084, 0x6085), maxon EPOS4 firmware specification.
"""

from typing import NamedTuple

from epa_rt.config.rig import Rig
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import scaling_of

QUICK_STOP_ON_LOST_MASTER = 3  # 0x6007
STAY_IN_QUICK_STOP = 6  # 0x605A: brake on the quick-stop ramp, then hold under power
BRAKE_THEN_OFF = 1  # 0x605B, 0x605C: brake on the profile's ramp, then power off
QUICK_STOP_THEN_FAULT = 2  # 0x605E: brake on the quick-stop ramp, then power off in fault


class DriveOptions(NamedTuple):
    """One value for each object; ramps in rpm/s of the motor's shaft."""

    lost_master: int  # 0x6007
    quick_stop: int  # 0x605A
    shutdown: int  # 0x605B
    disable: int  # 0x605C
    fault: int  # 0x605E
    deceleration_rpm_s: int  # 0x6084
    quick_stop_rpm_s: int  # 0x6085


def drive_options(rig: Rig) -> DriveOptions:
    """Brake and hold wherever the drive is able to; the ramp is the rig's ``stop_deceleration``.

    A muscle under pressure throws a motor without torque, so the drive holds after a quick stop
    while the muscles vent. Only a next master, or the drive's supply, takes that torque away.
    """
    ramp = max(1, round(rpm_per_si(rig) * rig.motor.stop_deceleration_si))
    return DriveOptions(
        QUICK_STOP_ON_LOST_MASTER,
        STAY_IN_QUICK_STOP,
        BRAKE_THEN_OFF,
        BRAKE_THEN_OFF,
        QUICK_STOP_THEN_FAULT,
        ramp,
        ramp,
    )


def rpm_per_si(rig: Rig) -> float:
    """Motor speed in rpm for one m/s (or rad/s) of the motor's axis, from its position row."""
    row = rig.row(rig.motor.position)
    place = image_of(rig, outputs=False).places[row.entry]
    slave = next(slave for slave in rig.slaves if slave.name == place.slave)
    per_count = abs(scaling_of(row, place.entry, rig).slope)
    return 60.0 / (per_count * slave.counts_per_turn)
