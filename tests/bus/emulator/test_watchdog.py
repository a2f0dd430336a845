"""The slaves' own watchdogs, in real time with the tests' clock."""

import struct

import pytest

from sim_backend.devices import ENABLED, FAULT, QUICK_STOP, SWITCH_ON_DISABLED
from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.small_master import OP, SAFEOP, Abort, ethernet

VALVES, ANALOG_IN, ANALOG_OUT, DRIVE = 0x1002, 0x1003, 0x1004, 0x1005
LOST = SAFEOP | 0x10


@pytest.fixture
def live(make_bus):
    return Wire(make_bus("bench"))


def outputs(valves=0, volts=(0, 0, 0, 0), control=0, mode=0, position=0):
    return (
        bytes([valves])
        + struct.pack("<4h", *volts)
        + struct.pack("<Hbiih", control, mode, position, 0, 0)
    )


def run(wire, data, ms):
    for _ in range(ms):
        wire.master.wait(0.9)
        wire.exchange(data)


def state(wire, station):
    return struct.unpack("<HHH", wire.master.read(station, 0x0130, 6))[::2]


def enable(wire):
    for control in (0x06, 0x07, 0x0F):
        run(wire, outputs(control=control, mode=8), 30)
    assert wire.bus.plant.machine["state"][0] == ENABLED


def test_nothing_happens_while_data_come(live):
    run(live, outputs(valves=3), 300)
    assert state(live, ANALOG_OUT) == (OP, 0)
    assert live.bus.counters.watchdogs == {}


def test_a_dead_master_is_noticed_after_100_ms(live):
    run(live, outputs(valves=3), 20)
    live.master.wait(95)
    assert state(live, ANALOG_OUT) == (OP, 0)
    live.master.wait(10)
    assert state(live, ANALOG_OUT) == state(live, DRIVE) == (LOST, 0x001B)
    assert state(live, ANALOG_IN) == (OP, 0)  # it has no outputs to guard
    assert state(live, VALVES) == (OP, 0)  # no processor: the state stays, the outputs go
    assert live.master.number(VALVES, 0x0440) & 1 == 0


def test_the_valves_go_to_their_safe_state_and_come_back_with_data(live):
    run(live, outputs(valves=3), 5)
    assert live.bus.plant.command["inlet"][0, 0] == 1.0
    live.master.wait(110)
    assert (
        live.bus.plant.command["inlet"][0, 0] == 0.0
        and live.bus.plant.command["exhaust"][0, 0] == 1.0
    )
    run(live, outputs(valves=3), 3)
    assert live.bus.plant.command["inlet"][0, 0] == 1.0


@pytest.mark.parametrize(
    ("code", "ends", "powered"),
    [(0, ENABLED, 1.0), (1, FAULT, 0.0), (2, SWITCH_ON_DISABLED, 0.0), (3, QUICK_STOP, 1.0)],
)
def test_a_drive_without_its_master_does_what_its_object_says(live, code, ends, powered):
    live.master.download(DRIVE, 0x6007, 0, struct.pack("<h", code))
    enable(live)
    live.master.wait(150)
    machine = live.bus.plant.machine
    assert machine["state"][0] == ends and live.bus.plant.command["enabled"][0] == powered
    assert machine["error_code"][0] == (0x8180 if ends == FAULT else 0)


def test_a_second_master_that_starts_anew_takes_the_outputs_away(live):
    """Its INIT leaves OP: valves are safe, the drive brakes and holds until told otherwise."""
    live.master.download(DRIVE, 0x6085, 0, struct.pack("<I", 20_000))
    for control in (0x06, 0x07, 0x0F):
        run(live, outputs(valves=3, control=control, mode=9), 30)
    data = outputs(valves=3, control=0x0F, mode=9)
    run(live, data[:-6] + struct.pack("<ih", 1000, 0), 100)
    assert live.bus.plant.sensors["motor_speed_rad_s"][0] > 50.0
    live.bus.receive(bytearray(ethernet((8, 0x0120 << 16, b"\x01\x00"))), live.master.now_ns)
    live.master.wait(100)
    command = live.bus.plant.command
    assert {slave.al.state for slave in live.bus.slaves.values()} == {1}
    assert command["inlet"][0, 0] == 0.0 and command["exhaust"][0, 0] == 1.0
    assert live.bus.plant.machine["state"][0] == QUICK_STOP
    assert abs(live.bus.plant.sensors["motor_speed_rad_s"][0]) < 1.0


@pytest.mark.parametrize(
    ("behaviour", "default", "expected"), [(0, 0, 0), (0, 1234, 1234), (2, 0, 8000)]
)
def test_analog_outputs_go_where_their_settings_say(live, behaviour, default, expected):
    live.master.download(ANALOG_OUT, 0x8000, 5, bytes([behaviour]))
    live.master.download(ANALOG_OUT, 0x8000, 0x13, struct.pack("<h", default))
    run(live, outputs(volts=(8000, 0, 0, 0)), 5)
    live.master.wait(110)
    assert struct.unpack_from("<h", live.bus.coupling.outputs, 1)[0] == expected


def test_an_analog_output_may_ramp(live):
    live.master.download(ANALOG_OUT, 0x8000, 5, b"\1")
    live.master.download(ANALOG_OUT, 0x8000, 0x14, struct.pack("<H", 100))
    run(live, outputs(volts=(8000, 0, 0, 0)), 5)
    live.master.wait(110)
    first = struct.unpack_from("<h", live.bus.coupling.outputs, 1)[0]
    live.master.wait(10)
    assert 0 < struct.unpack_from("<h", live.bus.coupling.outputs, 1)[0] <= first - 900


@pytest.mark.parametrize(
    ("divider", "counter", "ms"), [(2498, 200, 20), (998, 1000, 40), (2498, 50, 5)]
)
def test_the_time_is_what_the_registers_say(live, divider, counter, ms):
    live.exchange(outputs())
    live.master.write(DRIVE, 0x0400, struct.pack("<H", divider))
    live.master.write(DRIVE, 0x0420, struct.pack("<H", counter))
    run(live, outputs(), 3)
    live.master.wait(ms - 2)
    assert state(live, DRIVE) == (OP, 0)
    live.master.wait(5)
    assert state(live, DRIVE) == (LOST, 0x001B)


def test_zero_switches_it_off(live):
    for station in (ANALOG_OUT, DRIVE):
        live.master.write(station, 0x0420, b"\0\0")
    run(live, outputs(), 3)
    live.master.wait(500)
    assert state(live, DRIVE) == state(live, ANALOG_OUT) == (OP, 0)


def test_back_to_op_after_acknowledging(live):
    live.master.wait(120)
    for station in (ANALOG_OUT, DRIVE):
        assert live.master.request(station, SAFEOP | 0x10) == (SAFEOP, 0)
        live.exchange(outputs())
        assert live.master.request(station, OP) == (OP, 0)


def test_in_lock_step_time_is_the_plants(wire):
    wire.exchange(bytes(wire.output_size))
    wire.master.wait(1000)
    assert wire.master.number(DRIVE, 0x0130) == OP
    wire.bus.faults.add("frames_lost", cycles=120)
    for _ in range(120):
        assert wire.exchange(bytes(wire.output_size)) is None
    assert wire.master.number(DRIVE, 0x0130) == LOST


def test_the_master_cannot_write_what_acts_in_safeop(live):
    live.master.request(DRIVE, SAFEOP)
    run(live, outputs(control=0x06), 30)
    assert live.bus.coupling.outputs[9:11] == b"\0\0"
    with pytest.raises(Abort):
        live.master.download(DRIVE, 0x6041, 0, b"\0\0")
