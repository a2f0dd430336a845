"""What each device on the bus carries: identity and process data entries, bit by bit.

Terminals stand in terminals/, one file each; the drive stands here. Sources: maxon EPOS4 firmware
specification (object dictionary) and CiA 402. Identity numbers as seen in public captures.
"""

from epa_rt.config.terminal import (
    STATUS_ERROR,
    STATUS_INVALID,
    STATUS_OVER_RANGE,
    STATUS_TOGGLE,
    STATUS_UNDER_RANGE,
    Device,
    Entry,
)
from epa_rt.config.terminals import TERMINALS

__all__ = [
    "ANALOG_V_PER_COUNT",
    "DEVICES",
    "EPOS4_INPUTS",
    "EPOS4_OUTPUTS",
    "STATUS_ERROR",
    "STATUS_INVALID",
    "STATUS_OVER_RANGE",
    "STATUS_TOGGLE",
    "STATUS_UNDER_RANGE",
    "Device",
    "Entry",
]

ANALOG_V_PER_COUNT = 10.0 / 32768.0  # EL4034, EL4004, EL4104: 0x7FFF = 10 V, signed presentation

EPOS4_OUTPUTS = (
    Entry("control_word", "H", index=0x6040),
    Entry("mode", "b", index=0x6060),
    Entry("target_position", "i", "count", 1.0, 0x607A),
    Entry("target_speed", "i", "rpm", 1.0, 0x60FF),
    Entry("target_torque", "h", "permille", 1.0, 0x6071),
)
EPOS4_INPUTS = (
    Entry("status_word", "H", index=0x6041),
    Entry("mode_display", "b", index=0x6061),
    Entry("position", "i", "count", 1.0, 0x6064),
    Entry("speed", "i", "rpm", 1.0, 0x606C),
    Entry("torque", "h", "permille", 1.0, 0x6077),
    Entry("current", "i", "mA", 1.0, 0x30D1, 0x02),
    Entry("error_code", "H", index=0x603F),
)

_DRIVE = Device(
    "EPOS4",
    0xFB,
    (
        0x60500000,
        0x61500000,
        0x63500000,
        0x64500000,
        0x65510000,
        0x65520000,
        0x65530000,
        0x69500000,
    ),
    (0x01400000, 0x01800000),
    outputs=EPOS4_OUTPUTS,
    inputs=EPOS4_INPUTS,
    is_drive=True,
)
DEVICES = TERMINALS  # one table: what is registered later is known here too
DEVICES[_DRIVE.name] = _DRIVE
