"""AL states: what is allowed, what is refused with which status code, and how errors are
acknowledged.
"""

import struct

import pytest

from sim_backend.bus import registers as reg
from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.small_master import INIT, OP, PREOP, SAFEOP, SmallMaster

BOOT, ACK, ERROR = 3, 0x10, 0x10
ANALOG_IN, ANALOG_OUT, DRIVE = 0x1003, 0x1004, 0x1005


@pytest.fixture
def master(bench):
    master = SmallMaster(bench)
    master.number_slaves()
    return master


@pytest.fixture
def in_preop(bench):
    return Wire(bench, states=(PREOP,))


@pytest.mark.parametrize(
    ("wanted", "code"),
    [(SAFEOP, 0x0011), (OP, 0x0011), (BOOT, 0x0013), (7, 0x0012), (PREOP, 0x0016)],
)
def test_refused_from_init(master, wanted, code):
    assert master.request(ANALOG_IN, wanted) == (INIT | ERROR, code)


def test_an_error_stands_until_it_is_acknowledged(in_preop):
    master = in_preop.master
    assert master.request(ANALOG_IN, OP) == (PREOP | ERROR, 0x0011)
    assert master.request(ANALOG_IN, PREOP) == (PREOP | ERROR, 0x0011)
    assert master.request(ANALOG_IN, PREOP | ACK) == (PREOP, 0)


def test_states_change_a_little_late(in_preop):
    master = in_preop.master
    master.write(ANALOG_IN, 0x0120, struct.pack("<H", INIT))
    assert master.number(ANALOG_IN, 0x0130) == PREOP
    master.wait(5)
    assert master.number(ANALOG_IN, 0x0130) == INIT


@pytest.mark.parametrize(
    ("station", "settings", "code"),
    [
        (ANALOG_IN, (3, 0x1180, 15, 0x20), 0x001E),
        (ANALOG_IN, (3, 0x1180, 16, 0x24), 0x001E),
        (ANALOG_OUT, (2, 0x1100, 6, 0x64), 0x001D),
        (ANALOG_OUT, (2, 0x1100, 8, 0x26), 0x001D),
    ],
)
def test_wrong_sync_manager_for_process_data(in_preop, station, settings, code):
    in_preop.configure()
    in_preop.master.sync_manager(station, *settings)
    assert in_preop.master.request(station, SAFEOP) == (PREOP | ERROR, code)


def test_a_mapping_that_does_not_fit_the_sync_manager(in_preop):
    in_preop.configure()
    in_preop.master.sync_manager(DRIVE, 2, 0x1060, 12, 0x64)
    assert in_preop.master.request(DRIVE, SAFEOP) == (PREOP | ERROR, 0x001D)


@pytest.mark.parametrize(
    ("activation", "cycle_ns", "code"), [(0x02, 1_000_000, 0x0030), (0x03, 0, 0x0035)]
)
def test_sync_signals_that_cannot_run(in_preop, activation, cycle_ns, code):
    in_preop.configure()
    in_preop.master.write(DRIVE, 0x09A0, struct.pack("<I", cycle_ns))
    in_preop.master.write(DRIVE, 0x0981, bytes([activation]))
    assert in_preop.master.request(DRIVE, SAFEOP) == (PREOP | ERROR, code)


@pytest.mark.parametrize(
    ("ahead_ns", "expected"), [(100_000_000, (OP, 0)), (-1000, (SAFEOP | ERROR, 0x002D))]
)
def test_a_sync_signal_that_was_to_start_in_the_past_never_does(in_preop, ahead_ns, expected):
    in_preop.configure()
    master = in_preop.master
    now_ns = int.from_bytes(master.read(DRIVE, 0x0910, 8), "little")
    master.write(DRIVE, 0x0990, struct.pack("<Q", now_ns + ahead_ns))
    master.write(DRIVE, 0x09A0, struct.pack("<I", 1_000_000))
    master.write(DRIVE, 0x0981, b"\x03")
    assert master.request(DRIVE, SAFEOP) == (SAFEOP, 0)
    assert master.request(DRIVE, OP) == expected


def test_down_from_op_at_once_or_step_by_step(wire):
    for state in (SAFEOP, PREOP, INIT):
        assert wire.master.request(wire.at["analog_out"], state) == (state, 0)
    assert wire.master.request(wire.at["drive"], INIT) == (INIT, 0)


def test_a_terminal_without_processor_copies_what_is_asked(master):
    assert master.request(0x1002, OP) == (OP, 0)


def test_broadcast_status_is_an_or(wire):
    wire.bus.slaves["analog_in"].al.fail(reg.SAFEOP, 0x001A)
    data, counter = wire.master.one(7, 0x0130 << 16, bytes(2))
    assert (data[0], counter) == (OP | SAFEOP | ERROR, 5)


def test_init_resets_the_mailbox(in_preop):
    master = in_preop.master
    master.write(DRIVE, 0x1000, struct.pack("<HHBBH", 10, 0, 0, 0x13, 0x2000) + bytes(40))
    assert master.request(DRIVE, INIT) == (INIT, 0)
    assert master.number(DRIVE, 0x080D, 1) & 8 == 0
