"""Each fault of frames and slaves does what it says, when it says, and ends."""

import struct

import pytest

from sim_backend.devices import ENABLED, NOT_READY
from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.small_master import LRW, OP, SAFEOP, Abort, ethernet

ANALOG_IN, ANALOG_OUT, DRIVE = 0x1003, 0x1004, 0x1005


def frames(wire, count):
    """Which of a run of frames come back, with their counters (None: not at once)."""
    return [
        None if (answer := wire.exchange(bytes(wire.output_size))) is None else answer[1]
        for _ in range(count)
    ]


def start(wire):
    wire.exchange(bytes(wire.output_size))
    wire.bus.rewind()
    return wire


def test_frames_lost_at_a_cycle_for_some(wire):
    start(wire).bus.faults.add("frames_lost", at_cycle=3, cycles=2)
    assert frames(wire, 8) == [8, 8, 8, None, None, 8, 8, 8]
    assert wire.bus.cycle == 8  # time has passed all the same
    assert wire.master.late == []


@pytest.mark.parametrize(("leg", "seen"), [("out", 0), ("back", 1)])
def test_a_lost_frame_may_have_reached_the_slaves(wire, leg, seen):
    start(wire).bus.faults.add("frames_lost", leg=leg)
    assert wire.exchange(b"\x01" + bytes(wire.output_size - 1)) is None
    assert wire.bus.coupling.outputs[0] == seen


def test_other_frames_are_spared_unless_asked_for(wire):
    wire.bus.faults.add("frames_lost", cycles=5)
    assert wire.master.number(DRIVE, 0x0130) == OP
    wire.bus.faults.clear()
    wire.bus.faults.add("frames_lost", cycles=1, frames="all")
    assert wire.master.frame((7, 0, bytes(2))) is None
    assert wire.master.number(DRIVE, 0x0130) == OP


def test_a_late_frame_comes_after_its_time(wire):
    start(wire).bus.faults.add("frames_late", value=0.003)
    assert frames(wire, 1) == [None]
    wire.master.wait(2.5)
    assert wire.master.late == []
    wire.master.wait(1.0)
    assert [wire.master.parse(raw)[0][2] for raw in wire.master.late] == [8]


def test_a_frame_comes_twice(wire):
    start(wire).bus.faults.add("frames_repeated")
    frames(wire, 1)
    assert len(wire.master.late) == 2 and wire.master.late[0] == wire.master.late[1]
    assert wire.bus.cycle == 1


def test_two_frames_change_places(wire):
    start(wire).bus.faults.add("frames_reordered")
    for index in (50, 51):
        raw = bytearray(ethernet((LRW, wire.logical, bytes(wire.output_size + wire.input_size))))
        raw[17] = index
        wire.master.now_ns += 100_000
        assert not wire.bus.receive(raw, wire.master.now_ns)
    assert [raw[17] for raw in wire.master.late] == [51, 50]
    assert frames(wire, 2) == [8, 8]


def test_a_damaged_frame_can_be_told_from_a_good_one(wire):
    good = start(wire).bus.faults
    for _ in range(40):
        good.add("frames_damaged")
        raw = bytearray(ethernet((LRW, wire.logical, bytes(wire.output_size + wire.input_size))))
        wire.bus.receive(raw, wire.master.now_ns)
        answer = wire.master.late.pop()
        sent = ethernet((LRW, wire.logical, bytes(wire.output_size + wire.input_size)))
        place = 26 + wire.output_size + wire.input_size
        assert (
            len(answer) < len(sent)
            or answer[14:18] != sent[14:18]
            or answer[22:24] != sent[22:24]
            or answer[place : place + 2] == b"\0\0"
        )
    assert frames(wire, 2) == [8, 8]


@pytest.mark.parametrize(("value", "counter"), [(None, 7), (-3, 5), (2, 10)])
def test_a_wrong_working_counter(wire, value, counter):
    start(wire).bus.faults.add("wrong_working_counter", value=value, cycles=2)
    assert frames(wire, 3) == [counter, counter, 8]


def test_the_cable_is_pulled_and_put_back(wire):
    start(wire).bus.faults.add("cable_pulled")
    assert frames(wire, 3) == [None] * 3 and wire.master.frame((7, 0, bytes(2))) is None
    wire.bus.faults.clear()
    assert frames(wire, 1) == [8]


def test_a_slave_loses_its_power_and_comes_back_in_init(make_bus):
    wire = Wire(make_bus("bench"))
    wire.bus.faults.add("slave_lost", "analog_in")
    assert (
        wire.master.one(7, 0, bytes(2))[1] == 3
    )  # the terminal behind it is out of reach, the drive is not
    assert wire.exchange(bytes(wire.output_size))[1] == 5
    wire.master.wait(150)
    wire.bus.faults.clear()
    wire.master.wait(1)
    assert wire.master.one(7, 0, bytes(2))[1] == 5
    slaves = wire.bus.slaves
    assert (slaves["analog_in"].al.state, slaves["analog_in"].station_address) == (1, 0)
    assert (slaves["analog_out"].al.state, slaves["analog_out"].al.code) == (SAFEOP, 0x001B)
    assert slaves["analog_out"].station_address == ANALOG_OUT


def test_where_the_first_slave_is_without_power_nobody_sends_a_frame_back(wire):
    start(wire).bus.faults.add("slave_lost", "coupler", cycles=3)
    assert frames(wire, 3) == [None, None, None] and wire.bus.cycle == 3
    assert frames(wire, 1) == [8]  # back, and with no process data of its own


def test_a_slave_may_go_alone(wire):
    wire.bus.faults.add("slave_lost", "analog_in", alone=True)
    assert wire.master.one(7, 0, bytes(2))[1] == 4


def test_a_slave_comes_back_by_itself_after_its_cycles(wire):
    start(wire).bus.faults.add("slave_lost", "drive", cycles=4)
    assert frames(wire, 6) == [5, 5, 5, 5, 5, 5]  # back in INIT: it does not take part
    assert wire.bus.slaves["drive"].is_present and wire.bus.slaves["drive"].al.state == 1


def test_the_link_goes_down_in_front_of_a_lost_slave(wire):
    before = wire.master.number(0x1002, 0x0110)
    wire.bus.faults.add("slave_lost", "analog_in")
    after = wire.master.number(0x1002, 0x0110)
    assert before & 0x20 and not after & 0x20


def test_a_drive_without_supply_has_no_torque_and_starts_anew(make_bus):
    wire = Wire(make_bus("bench"))
    for control in (6, 7, 15):
        for _ in range(30):
            wire.master.wait(0.9)
            wire.exchange(bytes(9) + struct.pack("<Hbiih", control, 8, 0, 0, 0))
    assert wire.bus.plant.machine["state"][0] == ENABLED
    wire.bus.faults.add("slave_lost", "drive")
    wire.master.wait(3)
    assert (
        wire.bus.plant.machine["state"][0] == NOT_READY
        and wire.bus.plant.command["enabled"][0] == 0.0
    )


def test_a_slave_falls_to_safeop(wire):
    wire.bus.faults.add("slave_falls", "analog_out", value=0x0032)
    assert struct.unpack("<HHH", wire.master.read(ANALOG_OUT, 0x0130, 6))[::2] == (
        SAFEOP | 0x10,
        0x0032,
    )
    assert wire.exchange(bytes(wire.output_size))[1] == 8  # the counter does not show it
    assert wire.master.request(ANALOG_OUT, SAFEOP | 0x10) == (SAFEOP, 0)
    assert wire.master.request(ANALOG_OUT, OP) == (OP, 0)


def test_an_object_is_refused_or_forgotten(wire):
    wire.bus.faults.add("sdo_refused", "drive", value=0x60C2)
    with pytest.raises(Abort, match="0x08000000"):
        wire.master.upload(DRIVE, 0x60C2, 1)
    wire.bus.faults.clear()
    wire.bus.faults.add("sdo_forgotten", "drive", value=0x60C2)
    wire.master.download(DRIVE, 0x60C2, 1, b"\x07")
    assert wire.master.upload(DRIVE, 0x60C2, 1) == b"\x01"
    wire.bus.faults.clear()
    wire.master.download(DRIVE, 0x60C2, 1, b"\x07")
    assert wire.master.upload(DRIVE, 0x60C2, 1) == b"\x07"


@pytest.mark.parametrize(
    ("kind", "where", "options", "words"),
    [
        ("sdo_refused", "valves", {}, "mailbox"),
        ("nonsense", "", {}, "expected one of"),
        ("slave_lost", "nobody", {}, "'nobody'"),
        ("slave_lost", "", {}, "where"),
        ("clock_drift", "valves", {}, "clock"),
        ("frames_lost", "", {"leg": "up"}, "leg"),
        ("frames_lost", "", {"cycles": 0}, "cycles"),
        ("valve_stuck_open", "muscle9", {}, "cmd_muscle_inlet_open"),
        ("wire_broken", "motor_travel_m", {}, "analog"),
        ("toggle_frozen", "drive", {}, "EL3004"),
        ("leak", "calf", {}, "muscle"),
    ],
)
def test_a_fault_that_cannot_be_is_refused_by_one_sentence(wire, kind, where, options, words):
    with pytest.raises(ValueError, match=words) as refused:
        wire.bus.faults.add(kind, where, **options)
    assert "\n" not in str(refused.value)
    assert wire.bus.faults.listed() == []
