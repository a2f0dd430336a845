"""The process image read and written bit by bit, from the terminals' manuals; shares no code with
epa_rt.signals.
"""

from functools import cache
from pathlib import Path

from epa_rt.config.rig import Rig, load_rig

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("bench", "bench_analog", "knee", "mass")

# entry, bits, signed; bus order of a terminal's own process data
OUT = {
    "EK1100": [],
    "EL3004": [],
    "EL2124": [(f"ch{n}", 1, False) for n in (1, 2, 3, 4)],
    "EL4034": [(f"ch{n}", 16, True) for n in (1, 2, 3, 4)],
    "EPOS4": [
        ("control_word", 16, False),
        ("mode", 8, True),
        ("target_position", 32, True),
        ("target_speed", 32, True),
        ("target_torque", 16, True),
    ],
}
IN = {
    "EK1100": [],
    "EL2124": [],
    "EL4034": [],
    "EL3004": [
        e for n in (1, 2, 3, 4) for e in ((f"ch{n}_status", 16, False), (f"ch{n}", 16, True))
    ],
    "EPOS4": [
        ("status_word", 16, False),
        ("mode_display", 8, True),
        ("position", 32, True),
        ("speed", 32, True),
        ("torque", 16, True),
        ("current", 32, True),
        ("error_code", 16, False),
    ],
}


@cache
def rig(name: str) -> Rig:
    return load_rig(ROOT / "config" / "rigs" / f"{name}.yaml")


def edited(name: str, *edits: tuple[str, str]) -> Rig:
    """A rig read from an edited copy of a delivered file."""
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import parse_yaml

    text = (ROOT / "config" / "rigs" / f"{name}.yaml").read_text(encoding="utf-8")
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new, 1)
    return rig_from(parse_yaml(text, f"{name}.yaml"))


def bit_places(on: Rig, outputs: bool) -> tuple[dict[str, tuple[int, int, bool]], int]:
    """'slave.entry' to (first bit, bits, signed), and the image's size in bytes."""
    places, start = {}, 0
    for slave in on.bus:
        if slave.device == "EL9011":
            continue
        chosen = slave.outputs if outputs else slave.inputs
        table = (OUT if outputs else IN)[slave.device]
        if chosen is not None:
            table = [next(row for row in table if row[0] == name) for name in chosen]
        bit = start
        for entry, bits, signed in table:
            places[f"{slave.name}.{entry}"] = (bit, bits, signed)
            bit += bits
        start = (bit + 7) // 8 * 8
    return places, start // 8


def get(image: bytes, place: tuple[int, int, bool]) -> int:
    first, bits, signed = place
    value = sum((image[(first + i) // 8] >> (first + i) % 8 & 1) << i for i in range(bits))
    return value - (1 << bits) if signed and value >> bits - 1 else value


def put(image: bytearray, place: tuple[int, int, bool], value: int) -> None:
    first, bits, _ = place
    for i in range(bits):
        mask = 1 << (first + i) % 8
        image[(first + i) // 8] = image[(first + i) // 8] & ~mask | (mask if value >> i & 1 else 0)
