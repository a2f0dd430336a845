"""The EEPROM through its registers, read by a reader written apart from the writer."""

import struct

import pytest

from tests.bus.emulator.small_master import SmallMaster

COUPLER, VALVES, ANALOG_IN, ANALOG_OUT, DRIVE = range(0x1001, 0x1006)


@pytest.fixture
def master(bench):
    master = SmallMaster(bench)
    master.number_slaves()
    return master


def words(master, station, address, count):
    data = b""
    while len(data) < 2 * count:
        master.write(station, 0x0502, struct.pack("<HI", 0x0100, address + len(data) // 2))
        status = master.number(station, 0x0502)
        assert status & 0x8000 == 0 and status & 0x7800 == 0
        data += master.read(station, 0x0508, 8 if status & 0x40 else 4)
    return data[: 2 * count]


def categories(master, station):
    found, at = {}, 0x40
    while True:
        kind, size = struct.unpack("<HH", words(master, station, at, 2))
        if kind == 0xFFFF:
            return found
        found[kind] = words(master, station, at + 2, size)
        at += 2 + size


@pytest.mark.parametrize(
    ("station", "vendor", "product"),
    [
        (COUPLER, 0x2, 0x044C2C52),
        (VALVES, 0x2, 0x084C3052),
        (ANALOG_IN, 0x2, 0x0BBC3052),
        (ANALOG_OUT, 0x2, 0x0FC23052),
        (DRIVE, 0xFB, 0x65520000),
    ],
)
def test_identity(master, station, vendor, product):
    assert struct.unpack("<II", words(master, station, 8, 4)) == (vendor, product)


@pytest.mark.parametrize("station", range(0x1001, 0x1006))
def test_every_read_has_the_width_that_the_status_announces(master, station):
    widths = set()
    for address in (0, 8, 0x40, 0x3FF, 0x5000):
        master.write(station, 0x0502, struct.pack("<HI", 0x0100, address))
        widths.add(master.number(station, 0x0502) & 0x40)
    assert widths == {0x40}


def test_checksum(master):
    head = words(master, DRIVE, 0, 8)
    remainder = 0xFF
    for byte in head[:14]:  # bit by bit, as a division
        for bit in range(7, -1, -1):
            high = (remainder >> 7) ^ (byte >> bit & 1)
            remainder = (remainder << 1 & 0xFF) ^ (0x07 if high else 0)
    assert head[14] == remainder


def test_strings_general_and_mailbox(master):
    found = categories(master, ANALOG_IN)
    length = found[10][1]
    assert found[10][2 : 2 + length] == b"EL3004"
    assert (
        found[30][5] == 0x01 | 0x02 | 0x04
    )  # SDO, SDO information, PDO assignment; no complete access
    assert struct.unpack("<5H", words(master, ANALOG_IN, 0x18, 5)) == (
        0x1000,
        128,
        0x1080,
        128,
        0x0004,
    )
    assert words(master, VALVES, 0x1C, 1) == b"\0\0"


def test_sync_managers_and_fmmus(master):
    managers = [
        struct.unpack("<HHBBBB", row) for row in zip_rows(categories(master, ANALOG_IN)[41], 8)
    ]
    assert [(start, length, control) for start, length, control, *_ in managers] == [
        (0x1000, 128, 0x26),
        (0x1080, 128, 0x22),
        (0x1100, 0, 0x04),
        (0x1180, 16, 0x20),
    ]
    assert struct.unpack("<HHBBBB", categories(master, VALVES)[41]) == (0x0F00, 0, 0x44, 0, 0x09, 3)
    assert 40 not in categories(master, COUPLER) and 41 not in categories(master, COUPLER)


def zip_rows(data, size):
    return [data[i : i + size] for i in range(0, len(data), size)]


@pytest.mark.parametrize(
    ("station", "category", "bits"),
    [(VALVES, 51, [1] * 4), (ANALOG_OUT, 51, [16] * 4), (ANALOG_IN, 50, [32, 16] * 4)],
)
def test_pdos(master, station, category, bits):
    data, found = categories(master, station)[category], []
    while len(data) >= 8:
        count = data[2]
        found.append(sum(data[8 + 8 * n + 5] for n in range(count)))
        data = data[8 + 8 * count :]
    assert found == bits


def test_clock_modes_of_the_drive(master):
    rows = zip_rows(categories(master, DRIVE)[60], 24)
    assert [struct.unpack_from("<H", row, 14)[0] for row in rows] == [0x0000, 0x0300]


def test_a_write_needs_its_enable_bit(master):
    master.write(DRIVE, 0x0508, b"\x77\x66")
    master.write(DRIVE, 0x0502, struct.pack("<HI", 0x0200, 0x04))
    assert master.number(DRIVE, 0x0502) & 0x4000
    master.write(DRIVE, 0x0502, struct.pack("<HI", 0x0100, 0x0E))
    assert master.number(DRIVE, 0x0502) & 0x7800 == 0


def test_a_write_that_breaks_the_checksum_is_seen(master):
    master.write(DRIVE, 0x0508, b"\x77\x66")
    master.write(DRIVE, 0x0502, struct.pack("<HI", 0x0201, 0x04))
    assert master.number(DRIVE, 0x0502) & 0x0800
