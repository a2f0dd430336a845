"""The bench with the terminals of other labs: two rigs that hold each one once, and what is wrong
with none of them.
"""

from functools import cache
from pathlib import Path

from epa_rt.config.rig import Rig, rig_from
from epa_rt.config.source import parse_yaml

ROOT = Path(__file__).resolve().parents[1]
BENCH = ROOT / "config/rigs/bench.yaml"

ENCODER = """  - {name: encoder, device: EL5101}
"""
SPOOL = """  - name: spool_angle_rad
    entry: encoder.counter
    port: motor_angle_rad
    calibration: {native: [0 count, 4096 count], value: [0 rev, 1 rev]}
    limits: [-40 rad, 40 rad]
    stale_after: 20
"""
SPARE = """  - {name: cmd_spare_v, entry: analog_out.ch1, limits: [0 V, 10 V], slew: 100 V/s}
"""
# an EL3164 (0 to 10 V, 16 bits) that no file of terminals/ knows, and a filter of its own
GENERIC = """  - name: analog_b
    device: generic
    terminal:
      product: 0x0C5C3052
      revisions: [0x00120000, 0x00140000]
      conversion: 0.625 ms
      inputs:
        - pdo: 0x1A00
          entries:
            - {object: "0x6000:01", name: a_status, type: u16}
            - {object: "0x6000:11", name: a, type: i16, native: [0 V, 10 V], counts: [0, 32768]}
    startup: [{object: "0x8000:06", type: u8, value: 0}]
"""
_PRESSURE = (
    "    calibration: {native: [1 V, 5 V], value: [0 kPa, 1000 kPa]}\n    valid: [0.7 V, 5.2 V]\n"
)
_FORCE = "    calibration: {native: [0 V, 10 V], value: [0 N, 500 N]}\n    valid: [-0.8 V, 9.8 V]\n"
_VOLTS = "    calibration: {native: [1 V, 9 V], value: [0 N, 400 N]}\n    valid: [0.2 V, 9.8 V]\n"
_ROWS, _DRIVE = "  - {name: drive_status_raw,", "  - {name: drive, device"
_COMMANDS = "  - {name: cmd_drive_control_raw"
LIMITS = ("    limits: [-40 N, 350 N]\n", "    limits: [-30 N, 350 N]\n")
EDITS: dict[str, tuple[tuple[str, str], ...]] = {
    "others": (
        ("device: EL2124", "device: EL2008"),
        ("device: EL3004", "device: EL3064"),
        ("device: EL4034", "device: EL4004"),
        (_DRIVE, ENCODER + _DRIVE),
        (_FORCE, _VOLTS),
        LIMITS,
        (_ROWS, SPOOL + _ROWS),
        (_COMMANDS, SPARE + _COMMANDS),
    ),
    "others_ma": (
        ("device: EL2124", "device: EL2024"),
        ("device: EL3004", "device: EL3154"),
        ("device: EL4034", "device: EL4104"),
        (_DRIVE, GENERIC + _DRIVE),
        (
            _PRESSURE,
            "    calibration: {native: [4 mA, 20 mA], value: [0 kPa, 1000 kPa]}\n"
            "    valid: [3.6 mA, 21 mA]\n",
        ),
        ("limits: [60 kPa abs, 800 kPa gauge]", "limits: [80 kPa abs, 800 kPa gauge]"),
        ("entry: analog_in.ch2", "entry: analog_b.a"),
        (_FORCE, _VOLTS),
        LIMITS,
        (_COMMANDS, SPARE + _COMMANDS),
    ),
}


def text_of(name: str, *more: tuple[str, str]) -> str:
    """The rig file, with further edits."""
    text = BENCH.read_text(encoding="utf-8")
    for old, new in (*EDITS[name], *more):
        assert old in text, f"{BENCH.name} no longer has {old!r}"
        text = text.replace(old, new, 1)
    return text


@cache
def rig_of(name: str, *more: tuple[str, str]) -> Rig:
    return rig_from(parse_yaml(text_of(name, *more), f"{name}.yaml"))
