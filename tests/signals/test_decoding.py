"""Bytes to SI: what is believed, what is not, and when a sample is old."""

import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_image import NAMES, bit_places, edited, put, rig

from epa_rt.signals.codec import Decoder

PRESSURE = "muscle_pressure_pa"
UNDER, OVER, ERROR, INVALID, TOGGLE = 1, 2, 0x40, 0x4000, 0x8000
V = 3276.8  # counts of a volt


class Bench:
    """The bench's decoder fed one channel at a time; every other channel sound."""

    def __init__(self, on=None):
        self.rig = on or rig("bench")
        self.decoder = Decoder(self.rig)
        self.places, size = bit_places(self.rig, False)
        self.image = bytearray(size)
        self.set("analog_in.ch1", volt=2.0)
        self.set("analog_in.ch2", volt=1.0)

    def set(
        self, entry: str, volt: float | None = None, counts: int = 0, status: int | None = None
    ) -> "Bench":
        put(self.image, self.places[entry], counts if volt is None else round(volt * V))
        if status is not None:
            put(self.image, self.places[f"{entry}_status"], status)
        return self

    def decode(self) -> dict[str, float]:
        return self.decoder.decode(bytes(self.image))


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=60)
@given(data=st.data())
def test_any_bytes_give_finite_numbers_or_nan(name, data):
    decoder = Decoder(rig(name))
    for image in data.draw(
        st.lists(st.binary(min_size=decoder.size, max_size=decoder.size), min_size=1, max_size=3)
    ):
        measured = decoder.decode(image)
        assert tuple(measured) == decoder.names
        for i, value in enumerate(measured.values()):
            assert math.isnan(value) == bool(decoder.invalid >> i & 1) and not math.isinf(value)
        assert (decoder.invalid | decoder.stale) < 1 << len(decoder.names)


def test_before_the_first_image_nothing_is_known_and_nothing_wrong():
    decoder = Decoder(rig("bench"))
    assert decoder.reason(0) == "no longer invalid"
    assert decoder.invalid == decoder.stale == 0 and all(
        math.isnan(value) for value in decoder.measured.values()
    )


def test_another_size_is_an_error():
    decoder = Decoder(rig("bench"))
    for size in (0, decoder.size - 1, decoder.size + 1):
        with pytest.raises(struct.error):
            decoder.decode(bytes(size))


def test_known_voltages_are_known_values():
    bench = (
        Bench()
        .set("analog_in.ch1", volt=3.0)
        .set("analog_in.ch2", volt=5.0)
        .set("drive.position", counts=-77824)
    )
    bench.set("drive.current", counts=-4060).set("drive.status_word", counts=0x0237).set(
        "drive.torque", counts=-1000
    )
    measured = bench.decode()
    assert measured[PRESSURE] == pytest.approx(500e3 + 101_325, abs=0.5 * 250e3 / V)
    assert measured["muscle_force_n"] == pytest.approx(250.0, abs=0.5 * 50 / V)
    assert measured["motor_travel_m"] == pytest.approx(-0.06283185307, rel=1e-12)
    assert measured["motor_current_a"] == pytest.approx(-4.06) and measured[
        "motor_torque_nm"
    ] == pytest.approx(-0.17)
    assert (
        measured["drive_status_raw"] == 0x0237 and bench.decoder.invalid == bench.decoder.stale == 0
    )


def test_gauge_and_absolute_differ_by_the_rigs_atmosphere():
    gauge = Bench(edited("bench", ("101.325 kPa abs", "95 kPa abs"))).decode()[PRESSURE]
    absolute = Bench(edited("bench", ("reads: gauge", "reads: absolute"))).decode()[PRESSURE]
    assert gauge == pytest.approx(absolute + 95e3, abs=1e-6) and absolute == pytest.approx(
        250e3, abs=0.5 * 250e3 / V
    )


@pytest.mark.parametrize(
    ("volt", "status", "words"),
    [
        (0.0, 0, "below the sensor's range, broken wire"),
        (0.69, 0, "valid from 2294"),
        (5.21, 0, "above the sensor's range"),
        (9.9, 0, "valid to 17039"),
        (2.0, UNDER, "terminal under-range"),
        (2.0, OVER, "terminal over-range"),
        (2.0, ERROR, "terminal reports an error"),
        (2.0, INVALID, "terminal says the value is invalid"),
        (9.9, OVER | ERROR, "terminal reports an error (status 0x0042, 32440 counts)"),
        (0.0, INVALID | UNDER | ERROR, "says the value is invalid (status 0x4041, 0 counts)"),
    ],
)
def test_a_broken_sensor_is_nan_and_says_why(volt, status, words):
    bench = Bench().set("analog_in.ch1", volt=volt, status=status)
    measured = bench.decode()
    assert (
        math.isnan(measured[PRESSURE])
        and bench.decoder.invalid == 1
        and not math.isnan(measured["muscle_force_n"])
    )
    assert words in bench.decoder.reason(0)
    assert bench.decoder.reason(1) == bench.decoder.reason(5) == "no longer invalid"
    bench.set("analog_in.ch1", volt=2.0, status=0).decode()
    assert bench.decoder.invalid == 0 and bench.decoder.reason(0) == "no longer invalid"


def test_the_ends_of_the_valid_range_are_valid():
    for counts, invalid in ((2294, False), (2293, True), (17039, False), (17040, True)):
        bench = Bench().set("analog_in.ch1", counts=counts)
        bench.decode()
        assert bool(bench.decoder.invalid) == invalid, counts
        assert ("below" in bench.decoder.reason(0)) == (counts == 2293) and (
            "above" in bench.decoder.reason(0)
        ) == (counts == 17040)


@pytest.mark.parametrize("status", [1 << bit for bit in (2, 3, 4, 5, 7, 8, 13, 15)])
def test_limit_bits_and_the_toggle_make_nothing_invalid(status):
    bench = Bench().set("analog_in.ch1", volt=2.0, status=status)
    bench.decode()
    assert bench.decoder.invalid == 0


@pytest.mark.parametrize("status", [UNDER, OVER, ERROR, INVALID])
def test_a_terminal_is_believed_about_a_row_without_a_valid_range(status):
    bench = Bench(edited("bench", ("    valid: [-0.8 V, 9.8 V]\n", "")))
    assert not math.isnan(bench.decode()["muscle_force_n"])
    bench.set("analog_in.ch2", volt=1.0, status=status)
    assert math.isnan(bench.decode()["muscle_force_n"]) and bench.decoder.invalid == 0b10


def test_an_encoder_may_have_its_zero_elsewhere():
    bench = Bench(
        edited(
            "bench",
            (
                "native: [0 count, 77824 count], value: [0 mm,",
                "native: [-77824 count, 77824 count], value: [0 mm,",
            ),
        )
    )
    assert bench.decode()["motor_travel_m"] == pytest.approx(0.031415926535)
    assert bench.set("drive.position", counts=77824).decode()["motor_travel_m"] == pytest.approx(
        0.06283185307
    )


def test_the_last_invalid_row_has_its_own_bit():
    bench = Bench().set("analog_in.ch2", volt=9.9)
    bench.decode()
    assert (
        bench.decoder.invalid == 0b10
        and "above" in bench.decoder.reason(1)
        and bench.decoder.reason(0) == "no longer invalid"
    )


def test_a_valid_range_on_an_encoder_is_watched_too():
    bench = Bench(
        edited(
            "bench",
            (
                "limits: [-10 mm, 31 mm]",
                "limits: [-10 mm, 31 mm]\n    valid: [-100 count, 50000 count]",
            ),
        )
    )
    for counts, invalid in ((-100, 0), (-101, 4), (50000, 0), (50001, 4)):
        bench.set("drive.position", counts=counts).decode()
        assert bench.decoder.invalid == invalid and bench.decoder.stale == 0
        assert (
            bench.decoder.reason(2)
            == {
                -100: "no longer invalid",
                -101: "below the sensor's range, broken wire (-101 counts, valid from -100)",
                50000: "no longer invalid",
                50001: "above the sensor's range (50001 counts, valid to 50000)",
            }[counts]
        )


LAW = (
    "    law: {braid_length: 207.8 mm, braid_turns: 3.05, rest_length: 120 mm,"
    " lock_length: 145 mm, force: muscle_force_n}\n"
)


def test_a_digital_input_is_zero_or_one_as_wired():
    # no delivered rig has one: the entries of a digital input are those of EL2124 turned round
    from dataclasses import replace

    from epa_rt.config import devices

    terminal = devices.DEVICES["EL2124"]
    turned = replace(terminal, outputs=(), inputs=terminal.outputs)
    devices.DEVICES["EL2124"] = turned
    try:
        on = edited(
            "bench",
            (
                "  - {name: analog_in,",
                "  - {name: switches, device: EL2124}\n  - {name: analog_in,",
            ),
            (
                "  - {name: drive_status_raw,",
                (
                    "  - {name: door_open, entry: switches.ch2}\n  - {name: stop_enable, entry:"
                    " switches.ch3, inverted: true}\n  - {name: drive_status_raw,"
                ),
            ),
            ("  - {name: cmd_muscle_inlet_open, entry: valves.ch1, port: muscle0_inlet}\n", ""),
            (
                (
                    "  - {name: cmd_muscle_exhaust_open, entry: valves.ch2, port: muscle0_exhaust,"
                    " inverted: true, safe: 1}\n"
                ),
                "",
            ),
            (
                (
                    "muscles:\n  - name: muscle\n    pressure: muscle_pressure_pa\n    inlet:"
                    " cmd_muscle_inlet_open\n    exhaust: cmd_muscle_exhaust_open\n   "
                    " pressure_max: 780 kPa gauge\n    valves: {supply: 850 kPa gauge}\n"
                ),
                "muscles: []\n",
            ),
            ("    # as built: what it pulls at a pressure and a length\n", ""),
            (LAW, ""),
            ("method: taut_strap", "method: here"),
        )
        decoder = Decoder(on)
        for first, door, stop in (
            (0b0000, 0.0, 1.0),
            (0b0010, 1.0, 1.0),
            (0b0110, 1.0, 0.0),
            (0b1101, 0.0, 0.0),
        ):
            measured = decoder.decode(bytes([0, first]) + bytes(decoder.size - 2))
            assert (measured["door_open"], measured["stop_enable"]) == (door, stop)
    finally:
        devices.DEVICES["EL2124"] = terminal
