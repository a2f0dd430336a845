"""Where the driver asks a second time before it believes: states, registers, and whether a watchdog
is armed at all.
"""

import pysoem
import pytest

from drivers.bus import State
from drivers.registers import OUTPUTS, OUTPUTS_BARE, arm_watchdog, set_watchdog, switch_off
from drivers.states import StateWatch
from drivers.wire import WireImage
from epa_rt.backend import BackendError
from epa_rt.config.rig import load_rig

OP, SAFEOP_ERROR, GONE = State(8, 0), State(0x14, 0x1B), State(0, 0)
RIG = load_rig("config/rigs/bench.yaml")


class Says:
    """A bus whose slaves are in OP but for one, which is as the looks say, one after the other."""

    def __init__(self, looks, slave=2):
        self.slaves = [None] * 5
        self.looks = [[state if i == slave else OP for i in range(5)] for state in looks]

    def states(self):
        return self.looks.pop(0)


def watch(bus):
    return StateWatch(bus, RIG, WireImage(RIG), {}, [])


def test_an_answer_that_was_another_questions_ends_no_run():
    bus = Says([SAFEOP_ERROR, OP])
    assert watch(bus).look() and bus.looks == []
    assert watch(Says([GONE, OP])).look()


@pytest.mark.parametrize(
    ("state", "words"), [(SAFEOP_ERROR, "left OP"), (GONE, "does not answer any more")]
)
def test_what_is_read_twice_is_true(state, words):
    with pytest.raises(BackendError, match=words):
        watch(Says([state, state])).look()


def test_where_all_are_silent_no_second_look_is_wasted():
    bus = Says([])
    bus.looks = [[GONE] * 5]
    assert watch(bus).look() is False and bus.looks == []


class Deaf:
    """A slave that misses the first so many questions."""

    def __init__(self, misses):
        self.misses, self.registers = misses, {}

    def _fpwr(self, address, data, timeout_us):
        self.registers[address] = data

    def _fprd(self, address, size, timeout_us):
        self.misses -= 1
        if self.misses >= 0:
            raise pysoem.WkcError
        return self.registers[address]


def test_a_register_is_asked_again_but_not_for_ever():
    slave = Deaf(2)
    set_watchdog(slave, "valves", 0.1)
    assert slave.registers[0x0420] == (1000).to_bytes(2, "little")
    with pytest.raises(BackendError, match="valves does not answer at register 0x0400"):
        set_watchdog(Deaf(3), "valves", 0.1)


class Controller:
    """A slave controller of one byte per register, whose sync managers' control and length can be
    written only while they are off.
    """

    def __init__(self, registers, stuck=()):
        self.registers, self.stuck, self.writes = dict(registers), stuck, []

    def _fpwr(self, address, data, timeout_us=0):
        self.writes.append((address, bytes(data)))
        for at, byte in enumerate(data, address):
            is_on = self.registers.get(at - at % 8 + 6, 0) & 1
            if at not in self.stuck and (at % 8 == 6 or not is_on):
                self.registers[at] = byte

    def _fprd(self, address, size, timeout_us=0):
        return bytes(self.registers.get(at, 0) for at in range(address, address + size))


def test_a_watchdog_that_the_sii_leaves_out_is_armed_and_the_sync_manager_is_on_again():
    slave = Controller({0x0814: 0x24, 0x0816: 0x01})
    arm_watchdog(slave, "analog_out", OUTPUTS)
    assert (slave.registers[0x0814], slave.registers[0x0816]) == (0x64, 0x01)


def test_an_armed_watchdog_is_left_alone():
    slave = Controller({0x0804: 0x44, 0x0806: 0x09})
    arm_watchdog(slave, "valves", OUTPUTS_BARE)
    assert slave.writes == []


def test_a_watchdog_that_cannot_be_armed_is_refused():
    slave = Controller({0x0814: 0x24, 0x0816: 0x01}, stuck={0x0814})
    with pytest.raises(
        BackendError,
        match=(
            "found 0x24 in register 0x0814 of analog_out, expected 0x64: its outputs cannot arm its"
            " watchdog"
        ),
    ):
        arm_watchdog(slave, "analog_out", OUTPUTS)


def test_an_unused_sync_manager_is_off_before_its_length_is_written():
    slave = Controller({0x0812: 6, 0x0816: 0x01})
    switch_off(slave, "drive", OUTPUTS)
    assert (slave.registers[0x0812], slave.registers[0x0816]) == (0, 0)


@pytest.mark.parametrize(
    ("name", "slave", "taken_back"),
    [
        ("bench_analog", 1, False),
        ("bench_analog", 2, True),
        ("bench_analog", 3, False),
        ("bench_analog", 4, False),
        ("bench", 1, True),
        ("bench", 3, True),
        ("bench", 4, False),
    ],
)
def test_what_makes_a_drive_move_is_not_taken_back(name, slave, taken_back):
    """bench_analog: the enable on slave 2, the target on slave 4."""
    rig = load_rig(f"config/rigs/{name}.yaml")
    rig = rig.model_copy(update={"master": rig.master.model_copy(update={"recovery": "continue"})})
    bus, events = Says([SAFEOP_ERROR, SAFEOP_ERROR], slave), []
    bus.slaves = [Controller({0x0130: 0x14}) for _ in rig.slaves]
    looked = StateWatch(bus, rig, WireImage(rig), {}, events)
    if taken_back:
        assert looked.look() is False and len(events) == 1
    else:
        with pytest.raises(
            BackendError,
            match=(
                r"left OP: .*; a drive(, whose enable or target comes from there,)? is not taken"
                r" back within a run"
            ),
        ):
            looked.look()
