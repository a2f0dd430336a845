"""Layout of the process image, against bits counted one by one."""

import random

import pytest
from plain_image import NAMES, bit_places, edited, get, rig

from epa_rt.signals.codec import Decoder, Encoder
from epa_rt.signals.image import image_of, struct_format
from epa_rt.signals.scaling import scaling_of


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("outputs", [False, True])
def test_every_entry_stands_where_the_bits_say(name, outputs):
    image = image_of(rig(name), outputs)
    places, size = bit_places(rig(name), outputs)
    assert image.size == size and list(image.places) == list(places)
    assert {
        key: (8 * place.byte + place.bit, place.entry.bits) for key, place in image.places.items()
    } == {key: (bit, bits) for key, (bit, bits, _) in places.items()}
    assert [start for start, _ in image.slices.values()] == sorted(
        start for start, _ in image.slices.values()
    )
    assert sum(length for _, length in image.slices.values()) == size


@pytest.mark.parametrize("name", NAMES)
def test_decoding_agrees_with_bits_read_one_by_one(name):
    on, random_bytes = rig(name), random.Random(1)
    decoder, places = Decoder(on), bit_places(on, False)[0]
    for _ in range(200):
        image = random_bytes.randbytes(decoder.size)
        measured = decoder.decode(image)
        for i, row in enumerate(on.inputs):
            counts = get(image, places[row.entry])
            if row.name.endswith("_raw"):
                assert measured[row.name] == counts and type(measured[row.name]) is int
            elif not decoder.invalid >> i & 1:
                scaling = scaling_of(row, image_of(on, False).places[row.entry].entry, on)
                assert measured[row.name] == scaling.slope * counts + scaling.intercept


def test_two_valve_terminals_side_by_side_keep_their_bits_apart():
    on = edited(
        "knee",
        ("  - {name: analog_in,", "  - {name: valves2, device: EL2124}\n  - {name: analog_in,"),
        ("cmd_ppam_inlet_open, entry: valves.ch3", "cmd_ppam_inlet_open, entry: valves2.ch1"),
        ("cmd_ppam_exhaust_open, entry: valves.ch4", "cmd_ppam_exhaust_open, entry: valves2.ch2"),
    )
    encoder, places = Encoder(on), bit_places(on, True)[0]
    valves = [row for row in on.outputs if row.name.endswith("_open")]
    assert image_of(on, True).slices["valves"] == (0, 1) and image_of(on, True).slices[
        "valves2"
    ] == (1, 1)
    for pattern in range(16):
        command = dict(encoder.safe) | {
            row.name: float(pattern >> i & 1) for i, row in enumerate(valves)
        }
        image = encoder.encode(command)
        for i, row in enumerate(valves):
            assert get(image, places[row.entry]) == (pattern >> i & 1) ^ row.inverted
        assert image[0] & 0xF0 == image[1] & 0xF0 == 0 and encoder.size == bit_places(on, True)[1]


def test_bytes_that_nobody_uses_are_skipped_and_stay_zero():
    on = edited(
        "bench",
        ("entry: valves.ch1, port: muscle0_inlet", "entry: valves.ch3, port: muscle0_inlet"),
    )
    encoder = Encoder(on)
    assert encoder.encode(dict(encoder.safe) | {"cmd_muscle_inlet_open": 1.0})[0] == 0b100
    text, _ = struct_format(image_of(on, True), {})
    assert text == "<BhhhhHbiih"


def test_an_image_of_bits_alone_ends_with_its_last_byte():
    on = edited(
        "bench",
        (
            "  - {name: drive, device: EPOS4",
            "  - {name: valves2, device: EL2124}\n  - {name: drive, device: EPOS4",
        ),
    )
    image = image_of(on, True)
    assert image.places["valves2.ch4"].byte == 9 and image.places["valves2.ch4"].bit == 3
    assert image.places["drive.control_word"].byte == 10 and image.slices["drive"] == (10, 13)
