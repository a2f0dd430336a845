"""Where the driver asks a second time before it believes: states, registers."""

import pysoem
import pytest

from drivers.bus import State
from drivers.registers import set_watchdog
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


@pytest.mark.parametrize(("state", "words"), [(SAFEOP_ERROR, "left OP"), (GONE, "does not answer any more")])
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
