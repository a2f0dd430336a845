"""What slaves tell beside the process data: clocks and emergencies, in words; without a bus, then
on the emulated one.
"""

import pysoem
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.diagnosis import FAR_NS, Diagnosis, difference_ns
from drivers.words import error_class_words, error_register_words
from epa_rt.backend import BackendError
from tests.bus.driver.test_driver_bus import bus_case
from tests.bus.own_network import REAL_TIME


class Telling:
    """A slave whose clock and mailbox say what they are told to."""

    def __init__(self, mailbox=None):
        self.differences: list[int] = []
        self.waiting: list[str] = []
        self.mailbox, self.is_gone, self.asked = mailbox, False, 0

    def _fprd(self, register: int, size: int) -> bytes:
        self.asked += 1
        if self.is_gone:
            raise pysoem.WkcError
        if register == 0x080D:
            return bytes([0x08 if self.waiting else 0x00])
        difference = self.differences.pop(0) if len(self.differences) > 1 else self.differences[0]
        return (abs(difference) | (difference < 0) << 31).to_bytes(size, "little")

    def mbx_receive(self) -> int:
        self.mailbox.emergencies.append((self.waiting.pop(0), {"code": 1}))
        return 1


class Box:
    label = "drive"

    def __init__(self, numbers: dict[int, int] | None = None):
        self.emergencies: list = []
        self.numbers = numbers

    def number_if_there(self, index: int, subindex: int = 0) -> int | None:
        if self.numbers is None:
            raise BackendError("gone")
        return self.numbers.get(subindex)


def bench(numbers: dict[int, int] | None = None, differences=(0,)):
    box, events = Box(numbers), []
    slave = Telling(box)
    slave.differences = list(differences)
    bus = type("Slaves", (), {"slaves": [slave]})()
    return slave, Diagnosis(bus, {0: box}, [0], ("drive",), events), events


@given(st.integers(-(2**31) + 1, 2**31 - 1))
def test_a_difference_is_a_size_and_a_sign(difference):
    assert difference_ns(abs(difference) | (difference < 0) << 31) == difference


def test_each_step_asks_one_slave_one_thing():
    slave, diagnosis, events = bench({})
    for k in range(1, 9):
        diagnosis.step()
        assert slave.asked == k
    assert events == []


def test_a_clock_that_is_far_off_is_said_once_and_the_worst_at_the_end():
    far = -FAR_NS - 1
    _slave, diagnosis, events = bench({}, (40, far, far, 20, 30))
    for _ in range(8):
        diagnosis.step()
    assert [(kind, data["last_ns"]) for kind, _text, data in events] == [("clock", far)]
    events.clear()
    diagnosis.finish()
    assert events[-1] == (
        "clock",
        f"the clock of drive stands 30 ns from the reference clock, at worst {far} ns in 5 readings"
        " (0x092C)",
        {"last_ns": 30, "worst_ns": far, "readings": 5},
    )


def test_emergencies_become_events_within_a_round():
    slave, diagnosis, events = bench({})
    slave.waiting = ["first", "second"]
    diagnosis.step()
    assert events == [("emergency", "first", {"code": 1}), ("emergency", "second", {"code": 1})]
    slave.is_gone = True
    for _ in range(4):
        diagnosis.step()
    assert len(events) == 2


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({0x0B: 0, 0x0C: 0, 0x20: 0}, None),
        ({}, None),
        (None, None),
        ({0x0B: 3}, "drive counted 3 missed and 0 too short cycles (0x1C32)"),
        ({0x0C: 2, 0x20: 1}, "2 too short cycles, and says that it is not synchronous (0x1C32)"),
    ],
)
def test_what_a_drive_says_of_its_synchronisation_is_told_at_the_end(numbers, words):
    _slave, diagnosis, events = bench(numbers)
    diagnosis.finish()
    assert len(events) == (1 if words is None else 2)
    assert words is None or words in events[-1][1]


def test_nobody_to_ask_is_nothing_to_do():
    events: list = []
    nobody = Diagnosis(type("Slaves", (), {"slaves": []})(), {}, [], (), events)
    nobody.step()
    nobody.finish()
    assert events == []


def test_error_codes_and_registers_in_words():
    assert error_class_words(0x4210) == "0x4210 temperature"
    assert error_class_words(0xFF01) == "0xFF01 additional functions"
    assert error_class_words(0xA000) == "0xA000 a class that is not in the table"
    assert error_register_words(0x21) == "0x21 (generic, device profile)"
    assert error_register_words(0) == "0x00 (no error)"


@pytest.mark.network
@pytest.mark.timeout(900)
@REAL_TIME
def test_on_the_bus_both_stand_in_the_log_and_no_cycle_is_lost():
    result = bus_case("diagnosed", cycles=1500)
    (clock,) = [data for kind, _text, data in result["events"] if kind == "clock"]
    assert clock["readings"] >= 3 and abs(clock["worst_ns"]) < FAR_NS
    assert [text for kind, text, _data in result["running"] if kind == "emergency"] == [
        "drive (slave 5, EPOS4): emergency 0x8611 following error, error register 0x01 (generic)"
    ]
    assert result["bad"] == 0
