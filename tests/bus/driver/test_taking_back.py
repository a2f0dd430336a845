"""A terminal that is taken back holds nothing up: every step asks once, within the reaction time,
and one that is gone again starts anew.
"""

from types import SimpleNamespace

import pysoem
import pytest

from drivers.backend import answer_s
from drivers.bus import Bus, State
from drivers.mailbox import Mailbox
from drivers.registers import set_watchdog_once
from drivers.states import StateWatch
from drivers.wire import WireImage
from epa_rt.backend import BackendError
from epa_rt.config.rig import StartupSdo, load_rig
from tests.bus.driver.test_driver_doubts import Controller

OP, INIT = State(8, 0), State(1, 0)
ANALOG_IN = 2
RIG = load_rig("config/rigs/bench.yaml")
SLAVES = [
    (
        slave.model_copy(update={"startup": (StartupSdo(object="0x8000:15", type="u16", value=3),)})
        if i == ANALOG_IN
        else slave
    )
    for i, slave in enumerate(RIG.bus)
]
RIG = RIG.model_copy(
    update={"bus": tuple(SLAVES), "master": RIG.master.model_copy(update={"recovery": "continue"})}
)
RIG.__dict__.pop("slaves", None)


class Terminal(Controller):
    """A controller with a mailbox that gives no answer to the first so many questions, and counts
    them; it obeys AL control at once.
    """

    def __init__(self, silent=0, error=pysoem.WkcError):
        super().__init__({0x0130: 0x01})
        self.silent, self.error, self.questions, self.objects, self.inits = silent, error, 0, {}, 0

    def _fpwr(self, address, data, timeout_us=0):
        super()._fpwr(address, data, timeout_us)
        if address == 0x0120:
            self.registers[0x0130] = data[0] & 0x0F
            self.inits += data[0] & 0x0F == 1

    def _ask(self):
        self.questions += 1
        if self.questions <= self.silent:
            raise self.error

    def sdo_write(self, index, subindex, data):
        self._ask()
        self.objects[index, subindex] = data

    def sdo_read(self, index, subindex):
        self._ask()
        return self.objects[index, subindex]

    def add_emergency_callback(self, callback):
        pass


class Looks:
    """A bus of which one terminal is where its own AL status says."""

    def __init__(self, terminal):
        self.slaves = [
            terminal if i == ANALOG_IN else Controller({0x0130: 8}) for i in range(len(RIG.slaves))
        ]

    def states(self):
        return [State(slave.registers[0x0130], 0) for slave in self.slaves]


def taken_back(terminal, most=200):
    """Looks until it is in OP; gives how many questions were asked in the look that asked most."""
    bus, events, asked = Looks(terminal), [], [0]
    watch = StateWatch(
        bus, RIG, WireImage(RIG), {ANALOG_IN: Mailbox(terminal, "analog_in")}, events
    )
    for _ in range(most):
        before = terminal.questions
        if watch.look():
            return max(asked)
        asked.append(terminal.questions - before)
    raise AssertionError(f"not in OP after {most} looks: {events}")


def test_each_step_asks_one_question():
    terminal = Terminal()
    assert taken_back(terminal) == 1
    assert terminal.objects[0x8000, 0x15] == b"\x03\x00" and terminal.objects[0x1C13, 0] != b"\x00"


@pytest.mark.parametrize("error", [pysoem.WkcError, pysoem.PacketError("", 3)])
@pytest.mark.parametrize("silent", [1, 2, 5])
def test_a_terminal_that_is_gone_again_starts_anew_and_the_run_goes_on(silent, error):
    terminal = Terminal(silent, error)
    assert taken_back(terminal) == 1
    assert terminal.objects[0x8000, 0x15] == b"\x03\x00"
    assert terminal.inits >= 1


def test_a_refusal_is_an_answer_and_ends_the_run():
    with pytest.raises(
        BackendError,
        match=(
            "object 0x8000:15 of analog_in could not be set to 0x0003: 0x06090031 value too large"
        ),
    ):
        taken_back(Terminal(1, pysoem.SdoError(1, 0x8000, 0x15, 0x06090031, "")))


def test_watchdog_times_are_asked_for_once():
    slave = Controller({})
    set_watchdog_once(slave, "valves", 0.1)
    assert [address for address, _data in slave.writes] == [0x0400, 0x0420]

    def gone(*arguments):
        raise pysoem.WkcError

    slave._fprd = gone
    with pytest.raises(pysoem.WkcError):
        set_watchdog_once(slave, "valves", 0.1)
    slave._fprd = lambda address, size: bytes(size)
    with pytest.raises(
        BackendError, match="found 0x0000 in register 0x0400 of valves, expected 0x09C2"
    ):
        set_watchdog_once(slave, "valves", 0.1)


def test_what_is_waited_for_within_a_run_fits_into_the_reaction_time():
    timeouts = pysoem.settings.timeouts
    bus, before = object.__new__(Bus), (timeouts.ret, timeouts.tx_mailbox)
    bus.master, bus._answer_us = SimpleNamespace(), round(1e6 * answer_s(RIG))
    try:
        bus.be_patient(True)
        assert (
            bus.master.sdo_read_timeout == bus.master.sdo_write_timeout == 700_000
            and timeouts.tx_mailbox == 20_000
        )
        bus.be_patient(False)
        assert (
            bus.master.sdo_read_timeout
            == bus.master.sdo_write_timeout
            == timeouts.tx_mailbox
            == 5_000
        )
        assert 1e-6 * (bus.master.sdo_read_timeout + timeouts.tx_mailbox) <= RIG.safety.reaction / 2
    finally:
        timeouts.ret, timeouts.tx_mailbox = before
