"""SI to bytes: within half a step there and back, saturating and counted, and never a NaN."""

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_image import NAMES, bit_places, edited, get, put, rig

from epa_rt.signals.codec import Decoder, Encoder
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import scaling_of

ROWS = [
    (name, row.name)
    for name in NAMES
    for row in rig(name).signals
    if not row.name.endswith(("_raw", "_open", "_enable"))
]


@pytest.mark.parametrize(("name", "row_name"), ROWS)
@settings(max_examples=60)
@given(part=st.floats(0.0, 1.0))
def test_there_and_back_within_half_a_step(name, row_name, part):
    on = rig(name)
    row = on.row(row_name)
    entry = image_of(on, row.is_output).places[row.entry].entry
    scaling, place = scaling_of(row, entry, on), bit_places(on, row.is_output)[0][row.entry]
    low, high = (scaling.to_si(c) for c in (scaling.valid_low, scaling.valid_high))
    value = low + part * (high - low)
    if row.is_output:
        encoder = Encoder(on)
        back = scaling.to_si(get(encoder.encode({**encoder.safe, row_name: value}), place))
        assert encoder.saturated == 0
    else:
        decoder, image = Decoder(on), bytearray(bit_places(on, False)[1])
        put(
            image,
            place,
            min(max(round(scaling.to_counts(value)), scaling.valid_low), scaling.valid_high),
        )
        back = decoder.decode(bytes(image))[row_name]
    assert abs(back - value) <= abs(scaling.slope) * (0.5 + 1e-6) + 1e-12 * abs(value)


@pytest.mark.parametrize("name", NAMES)
def test_words_and_bits_come_out_as_they_went_in(name):
    on = rig(name)
    encoder, places = Encoder(on), bit_places(on, True)[0]
    words = [row for row in on.outputs if row.name.endswith("_raw")]
    bits = [row for row in on.outputs if row.name.endswith(("_open", "_enable"))]
    for pattern in range(1 << len(bits)):
        command = (
            encoder.safe
            | {row.name: float(pattern >> i & 1) for i, row in enumerate(bits)}
            | {row.name: 9 + i for i, row in enumerate(words)}
        )
        image = encoder.encode(command)
        assert [get(image, places[row.entry]) ^ row.inverted for row in bits] == [
            pattern >> i & 1 for i in range(len(bits))
        ]
        assert [get(image, places[row.entry]) for row in words] == [
            9 + i for i in range(len(words))
        ]


@pytest.mark.parametrize("name", NAMES)
def test_safe_outputs_are_what_a_dead_bus_gives(name):
    """All zero but where a drive's target is safe elsewhere: the watchdog of every terminal drops
    to the same.
    """
    encoder = Encoder(rig(name))
    assert encoder.safe_raw == bytes(encoder.size) and encoder.saturated == 0
    assert encoder.safe == {row.name: row.safe for row in rig(name).outputs}


@pytest.mark.parametrize("name", NAMES)
def test_nan_never_becomes_bytes(name):
    encoder = Encoder(rig(name))
    for row in rig(name).outputs:
        with pytest.raises(
            ValueError, match="NaN" if row.name.endswith("_raw") else f"{row.name} is not a number"
        ):
            encoder.encode(encoder.safe | {row.name: math.nan})
    assert encoder.encode(encoder.safe) == encoder.safe_raw


def test_a_missing_signal_and_a_word_too_large_are_errors():
    encoder = Encoder(rig("bench"))
    with pytest.raises(KeyError):
        encoder.encode({})
    with pytest.raises(struct.error):
        encoder.encode(encoder.safe | {"cmd_drive_control_raw": 0x10000})


def test_a_target_may_have_its_zero_elsewhere():
    on = edited(
        "bench",
        (
            (
                "entry: drive.target_position\n    calibration: {native: [0 count, 77824 count],"
                " value: [0 mm,"
            ),
            (
                "entry: drive.target_position\n    calibration: {native: [1000 count, 77824 count],"
                " value: [0 mm,"
            ),
        ),
    )
    encoder, place = Encoder(on), bit_places(on, True)[0]["drive.target_position"]
    assert encoder.names == tuple(encoder.safe)
    assert get(encoder.safe_raw, place) == 1000
    assert get(encoder.encode(encoder.safe | {"cmd_motor_travel_m": 0.06283185307}), place) == 77824


def test_half_a_count_beyond_the_end_is_counted():
    on = edited(
        "bench",
        (
            (
                "entry: drive.target_torque\n    calibration: {native: [0 permille, 1000 permille],"
                " value: [0 mNm, 170 mNm]}"
            ),
            (
                "entry: drive.target_torque\n    calibration: {native: [0 permille, 1 permille],"
                " value: [0 Nm, 1 Nm]}"
            ),
        ),
    )
    for value, sent, saturated in (
        (32767.0, 32767, 0),
        (32767.25, 32767, 0),
        (32767.5, 32767, 1),
        (-32768.25, -32768, 0),
        (-32768.5, -32768, 1),
    ):
        encoder, place = Encoder(on), bit_places(on, True)[0]["drive.target_torque"]
        assert get(encoder.encode(encoder.safe | {"cmd_motor_torque_nm": value}), place) == sent
        assert encoder.saturated == saturated, value


def test_saturation_is_counted_once_per_value_and_goes_to_the_end():
    on = edited(
        "bench_analog",
        (
            "value: [0 mm/s, 62.83185307 mm/s]}\n    limits: [-80",
            "value: [0 mm/s, 4.56 mm/s]}\n    limits: [-8",
        ),
        ("-8 mm/s, 80 mm/s]", "-8 mm/s, 8 mm/s]"),
    )  # 1 V is 1 mm/s
    encoder, place = Encoder(on), bit_places(on, True)[0]["analog_out.ch1"]
    step = 1e-3 / 3276.8
    for counts, sent, saturated in (
        (0.0, 0, 0),
        (0.4, 0, 0),
        (0.6, 1, 0),
        (-0.6, -1, 0),
        (32767.0, 32767, 0),
        (32767.4, 32767, 0),
        (32767.6, 32767, 1),
        (1e9, 32767, 1),
        (-32768.0, -32768, 0),
        (-32768.4, -32768, 0),
        (-32768.6, -32768, 1),
        (-1e30, -32768, 1),
        (math.inf, 32767, 1),
        (-math.inf, -32768, 1),
    ):
        before = encoder.saturated
        image = encoder.encode(encoder.safe | {"cmd_motor_speed_m_s": counts * step})
        assert (get(image, place), encoder.saturated - before) == (sent, saturated), counts
