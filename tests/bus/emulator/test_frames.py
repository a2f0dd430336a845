"""Commands, addresses and working counters, each against what ETG.1000.4 says."""

import struct

import pytest

from tests.bus.emulator.small_master import (
    APRD,
    APWR,
    ARMW,
    BRD,
    BWR,
    FPRD,
    FPWR,
    FRMW,
    SmallMaster,
    ethernet,
)

ALIAS = 0x0012
NOP, APRW, FPRW, BRW = 0, 3, 6, 9


@pytest.fixture
def master(bench):
    master = SmallMaster(bench)
    master.number_slaves()
    return master


def test_nop_counts_nothing_and_changes_nothing(master):
    assert master.one(NOP, 0x12345678, b"abcd") == (b"abcd", 0)


def test_broadcast_read_is_an_or_over_all_slaves(master):
    for station, value in zip(range(0x1001, 0x1006), (1, 2, 4, 8, 16), strict=False):
        master.write(station, ALIAS, struct.pack("<H", value))
    assert master.one(BRD, ALIAS << 16, bytes(2)) == (struct.pack("<H", 31), 5)


def test_broadcast_write_reaches_every_slave(master):
    assert master.one(BWR, ALIAS << 16, b"\x34\x12")[1] == 5
    assert [master.number(station, ALIAS) for station in range(0x1001, 0x1006)] == [0x1234] * 5


def test_broadcast_read_write_counts_three_per_slave(master):
    assert master.one(BRW, ALIAS << 16, b"\x01\x00")[1] == 15


@pytest.mark.parametrize("place", range(5))
def test_auto_increment_reaches_one_slave_and_counts_the_position_up(master, place):
    raw = bytearray(ethernet((APWR, (-place & 0xFFFF) | ALIAS << 16, b"\xcd\xab")))
    assert master.bus.receive(raw, master.now_ns)
    assert struct.unpack_from("<H", raw, 18)[0] == (5 - place) & 0xFFFF
    assert [master.number(0x1001 + n, ALIAS) == 0xABCD for n in range(5)] == [
        n == place for n in range(5)
    ]


def test_no_slave_at_a_position_or_station_means_counter_zero(master):
    assert master.one(APRD, (-5 & 0xFFFF) | ALIAS << 16, bytes(2))[1] == 0
    assert master.one(FPRD, 0x2222 | ALIAS << 16, bytes(2))[1] == 0


@pytest.mark.parametrize(("command", "counter"), [(FPRD, 1), (FPWR, 1), (FPRW, 3)])
def test_station_commands_count(master, command, counter):
    assert master.one(command, 0x1003 | ALIAS << 16, b"\x07\x00")[1] == counter


@pytest.mark.parametrize(("command", "counter"), [(APRD, 1), (APWR, 1), (APRW, 3)])
def test_position_commands_count(master, command, counter):
    assert master.one(command, 0xFFFE | ALIAS << 16, b"\x07\x00")[1] == counter


@pytest.mark.parametrize(("command", "address"), [(FRMW, 0x1002), (ARMW, 0xFFFF)])
def test_read_multiple_write_takes_from_one_and_gives_to_all_behind(master, command, address):
    for n in range(5):
        master.write(0x1001 + n, ALIAS, struct.pack("<H", 0x100 + n))
    assert master.one(command, address | ALIAS << 16, b"\xee\xee") == (struct.pack("<H", 0x101), 5)
    assert [master.number(0x1001 + n, ALIAS) for n in range(5)] == [
        0xEEEE,
        0x101,
        0x101,
        0x101,
        0x101,
    ]


def test_read_write_reads_before_it_writes(master):
    master.write(0x1004, ALIAS, b"\x11\x22")
    assert master.one(FPRW, 0x1004 | ALIAS << 16, b"\x33\x44") == (b"\x11\x22", 3)
    assert master.number(0x1004, ALIAS) == 0x4433


def test_read_only_registers_refuse_a_write(master):
    before = master.read(0x1001, 0x0000, 10)
    assert master.write(0x1001, 0x0000, bytes(10)) == 0
    assert master.read(0x1001, 0x0000, 10) == before


def test_datagrams_of_one_frame_act_in_order(master):
    answers = master.frame(
        (FPWR, 0x1001 | ALIAS << 16, b"\x05\x00"),
        (FPRD, 0x1001 | ALIAS << 16, bytes(2)),
        (BRD, 0, bytes(1)),
    )
    assert [(data, counter) for _, data, counter in answers] == [
        (b"\x05\x00", 1),
        (b"\x05\x00", 1),
        (answers[2][1], 5),
    ]


def test_the_counter_adds_to_what_is_there_and_wraps(master):
    raw = bytearray(ethernet((BRD, 0, bytes(2))))
    raw[28:30] = b"\xfe\xff"
    assert master.bus.receive(raw, master.now_ns)
    assert raw[28:30] == b"\x03\x00"


@pytest.mark.parametrize(
    "damage",
    [
        lambda raw: raw[:20],
        lambda raw: raw[:12] + b"\x08\x00" + raw[14:],
        lambda raw: raw[:14] + struct.pack("<H", 0x17FF) + raw[16:],  # longer than the frame
        lambda raw: (
            raw[:14] + struct.pack("<H", 0x4000 | 30) + raw[16:]
        ),  # network variables, not datagrams
        lambda raw: (
            raw[:22] + struct.pack("<H", 0x8000 | 2) + raw[24:]
        ),  # announces a datagram that is not there
        lambda raw: raw[:22] + struct.pack("<H", 0x07FF) + raw[24:],
        lambda raw: raw[:16] + b"\x0f" + raw[17:],  # no such command
    ],
)
def test_malformed_frames_are_counted_and_have_no_effect(master, damage):
    before = [bytes(slave.esc.memory) for slave in master.bus.slaves.values()]
    raw = bytearray(damage(ethernet((BWR, ALIAS << 16, b"\x99\x99"))))
    sent = bytes(raw)
    assert not master.bus.receive(raw, master.now_ns)
    assert master.bus.counters.malformed == 1 and bytes(raw) == sent
    assert [bytes(slave.esc.memory) for slave in master.bus.slaves.values()] == before
