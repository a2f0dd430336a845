"""Layout of the process image: where each entry of each slave stands, in bytes and bits.

The image is the slaves' data in bus order, each slave on a byte boundary of its own, little-endian,
outputs and inputs apart. A driver whose bus packs narrower (EL2124 takes four bits) cuts it up
slave by slave.
"""

from dataclasses import dataclass

from epa_rt.config.devices import Entry
from epa_rt.config.rig import Rig
from epa_rt.config.rig_checks import entries_of
from epa_rt.config.terminal import GAP


@dataclass(frozen=True)
class Place:
    """An entry's place in the image: byte, bit within it (0 unless the entry is one bit)."""

    slave: str
    entry: Entry
    byte: int
    bit: int


@dataclass(frozen=True)
class Image:
    """One direction of the process image: places by 'slave.entry', bytes in all, (start, length)
    per slave.
    """

    places: dict[str, Place]
    size: int
    slices: dict[str, tuple[int, int]]


def image_of(rig: Rig, outputs: bool) -> Image:
    """The layout that a rig's slaves give, in one direction."""
    places: dict[str, Place] = {}
    slices: dict[str, tuple[int, int]] = {}
    position = 0
    for slave in rig.slaves:
        bits = 0
        for entry in entries_of(slave, outputs):
            if entry.code != GAP:
                places[f"{slave.name}.{entry.name}"] = Place(
                    slave.name, entry, position + bits // 8, bits % 8
                )
            bits += entry.bits
        size = (bits + 7) // 8
        slices[slave.name] = (position, size)
        position += size
    return Image(places, position, slices)


def struct_format(image: Image, digital_bytes: dict[int, int]) -> tuple[str, dict[str, int]]:
    """struct format of a whole image and the field index of each multi-bit entry.

    Bytes that hold bits become one 'B' field each; ``digital_bytes`` is filled with byte -> field
    index.
    """
    format_text, index, fields, expected = "<", 0, {}, 0
    for key, place in image.places.items():
        if place.entry.code == "?" and place.byte in digital_bytes:
            continue
        if place.byte != expected:
            format_text += f"{place.byte - expected}x"
        if place.entry.code == "?":
            digital_bytes[place.byte] = index
            format_text += "B"
            expected = place.byte + 1
        else:
            fields[key] = index
            format_text += place.entry.code
            expected = place.byte + place.entry.bits // 8
        index += 1
    if expected < image.size:
        format_text += f"{image.size - expected}x"
    return format_text, fields
