"""CoE against the tests' own little client: transfers of every kind, aborts, information, mapping,
emergencies.
"""

import struct

import pytest

from sim_backend.bus import dictionary as od
from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.small_master import PREOP, SAFEOP, Abort

ANALOG_IN, ANALOG_OUT, DRIVE = 0x1003, 0x1004, 0x1005


@pytest.fixture
def master(bench):
    return Wire(bench, states=(PREOP,)).master


def abort_code(action, *arguments, **more):
    with pytest.raises(Abort) as refused:
        action(*arguments, **more)
    return refused.value.code


def with_text(master, station, length):
    """A writable object of a length that no real one has."""
    slave = next(slave for slave in master.bus.slaves.values() if slave.station_address == station)
    item = od.Item("Text", od.STRING, b"x" * length, od.READ | od.WRITE)
    slave.dictionary.variable(0x2F00, item)
    return item


@pytest.mark.parametrize("station", [ANALOG_IN, DRIVE])
@pytest.mark.parametrize("length", [1, 3, 4, 5, 31, 32, 33, 39, 40, 47, 112, 113, 119, 120, 500])
def test_uploads_of_any_length(master, station, length):
    item = with_text(master, station, length)
    item.value = bytes(n & 0xFF for n in range(length))
    assert master.upload(station, 0x2F00, 0) == item.value


@pytest.mark.parametrize("station", [ANALOG_IN, DRIVE])
@pytest.mark.parametrize("length", [1, 4, 5, 32, 33, 39, 40, 46, 47, 112, 113, 500])
def test_downloads_of_any_length(master, station, length):
    item = with_text(master, station, 1)
    data = bytes(3 * n & 0xFF for n in range(length))
    master.download(station, 0x2F00, 0, data)
    assert item.value == data


def test_identity_and_name(master):
    assert [struct.unpack("<I", master.upload(DRIVE, 0x1018, n))[0] for n in (1, 2, 3)] == [
        0xFB,
        0x65520000,
        0x01600000,
    ]
    assert master.upload(ANALOG_IN, 0x1008, 0) == b"EL3004"


@pytest.mark.parametrize(
    ("station", "index", "subindex", "code"),
    [
        (DRIVE, 0x5555, 0, 0x06020000),
        (DRIVE, 0x1018, 9, 0x06090011),
        (ANALOG_IN, 0x8000, 0x0C, 0x06090011),
    ],
)
def test_what_is_not_there(master, station, index, subindex, code):
    assert abort_code(master.upload, station, index, subindex) == code


@pytest.mark.parametrize(
    ("index", "subindex", "data", "code"),
    [
        (0x6041, 0, b"\0\0", 0x06010002),
        (0x6060, 0, b"\x05", 0x06090030),
        (0x6040, 0, b"\0\0\0", 0x06070012),
        (0x607A, 0, b"\0\0", 0x06070013),
        (0x1C12, 1, b"\x00\x16", 0x06010003),
        (0x1A00, 1, b"\x10\x00\x64\x60", 0x06010003),
    ],
)
def test_writes_that_are_refused(master, index, subindex, data, code):
    assert abort_code(master.download, DRIVE, index, subindex, data) == code


def test_mapping_refuses_what_cannot_be_mapped(master):
    master.download(DRIVE, 0x1A00, 0, b"\0")
    assert (
        abort_code(master.download, DRIVE, 0x1A00, 1, struct.pack("<I", 0x55550010)) == 0x06020000
    )
    assert abort_code(master.download, DRIVE, 0x1A00, 1, struct.pack("<I", 0x60400010)) in (
        0x06040041,
    )
    assert (
        abort_code(master.download, DRIVE, 0x1A00, 1, struct.pack("<I", 0x60410020)) == 0x06040041
    )


def test_complete_access_is_not_supported(master):
    answer = master.talk(DRIVE, struct.pack("<HBHB4x", 0x2000, 0x50, 0x1018, 1))
    assert answer[2] == 0x80 and struct.unpack_from("<I", answer, 6)[0] == 0x06010004


def test_a_segment_with_the_wrong_toggle_is_refused(master):
    with_text(master, DRIVE, 200)
    master.talk(DRIVE, struct.pack("<HBHB4x", 0x2000, 0x40, 0x2F00, 0))
    answer = master.talk(DRIVE, struct.pack("<HB7x", 0x2000, 0x70))
    assert answer[2] == 0x80 and struct.unpack_from("<I", answer, 6)[0] == 0x05030000


def test_a_segment_out_of_the_blue_is_refused(master):
    answer = master.talk(DRIVE, struct.pack("<HB7x", 0x2000, 0x60))
    assert answer[2] == 0x80 and struct.unpack_from("<I", answer, 6)[0] == 0x05040001


def test_mapping_is_written_in_preop_only(wire):
    assert abort_code(wire.master.download, DRIVE, 0x1C12, 0, b"\0") == 0x08000022


def test_settings_are_each_slaves_own(master):
    master.download(ANALOG_IN, 0x8010, 0x15, b"\x02\x00")
    assert master.upload(ANALOG_IN, 0x8010, 0x15) == b"\x02\x00"
    assert master.upload(ANALOG_IN, 0x8000, 0x15) == b"\x00\x00"


def test_motor_data_come_from_rig_and_plant(master):
    assert struct.unpack("<I", master.upload(DRIVE, 0x6076, 0))[0] == 170_000
    assert struct.unpack("<I", master.upload(DRIVE, 0x3001, 5))[0] == 44_800
    assert struct.unpack("<I", master.upload(DRIVE, 0x3001, 2))[0] == 8000


@pytest.mark.parametrize("station", [ANALOG_IN, ANALOG_OUT, DRIVE])
def test_object_list_and_descriptions(master, station):
    answer = master.talk(station, struct.pack("<HBBHH", 0x8000, 1, 0, 0, 1))
    data, left = answer[6:], struct.unpack_from("<H", answer, 4)[0]
    while left:
        answer = master.listen(station)
        assert struct.unpack_from("<H", answer, 4)[0] == left - 1
        data, left = data + answer[6:], left - 1
    indices = struct.unpack(f"<{len(data) // 2}H", data)[1:]
    slave = next(slave for slave in master.bus.slaves.values() if slave.station_address == station)
    assert list(indices) == sorted(slave.dictionary.objects)
    for index in indices:
        answer = master.talk(station, struct.pack("<HBBHH", 0x8000, 3, 0, 0, index))
        found, data_type, last, code = struct.unpack_from("<HHBB", answer, 6)
        entry = slave.dictionary.objects[index]
        assert (found, last, code, answer[12:].decode()) == (
            index,
            max(entry.items),
            entry.code,
            entry.name,
        )
    answer = master.talk(station, struct.pack("<HBBHHBB", 0x8000, 5, 0, 0, 0x1018, 1, 0))
    assert (
        struct.unpack_from("<HBBHHH", answer, 6) == (0x1018, 1, 0, 7, 32, 7)
        and answer[16:] == b"Vendor ID"
    )


def test_description_of_nothing_is_an_error(master):
    answer = master.talk(DRIVE, struct.pack("<HBBHH", 0x8000, 3, 0, 0, 0x5555))
    assert answer[2] == 7 and struct.unpack_from("<I", answer, 6)[0] == 0x06020000


def test_another_protocol_is_refused_by_a_mailbox_error(master):
    answer = master.talk(DRIVE, b"\x01\x00\x00\x00\x00\x00", protocol=4)
    assert master.kind == 0 and struct.unpack("<HH", answer) == (1, 2)


def test_a_full_mailbox_takes_nothing_more(master):
    message = struct.pack("<HHBBHBHB4x", 10, 0, 0, 0x13, 0x2000, 0x40, 0x1000, 0).ljust(48, b"\0")
    assert master.write(DRIVE, 0x1000, message) == 1
    raw = bytearray(message)
    assert master.bus.slaves["drive"].esc.write(0x1000, raw) is False


def test_the_last_message_is_shown_again_on_request(master):
    first = master.upload(DRIVE, 0x1000, 0)
    master.write(DRIVE, 0x080E, b"\x03")
    assert master.number(DRIVE, 0x080F, 1) & 2
    assert master.listen(DRIVE)[6:10] == first


def test_a_drive_fault_comes_as_an_emergency(wire):
    wire.bus.faults.add("drive_fault", value=0x2310)
    wire.exchange(bytes(wire.output_size))
    answer = wire.master.listen(DRIVE)
    assert struct.unpack_from("<HH", answer) == (0x1000, 0x2310)


def test_another_order_of_mapped_objects_carries_the_same_values(bench):
    wire = Wire(bench, states=(PREOP,))
    wire.configure()
    entries = (0x60410010, 0x60640020, 0x603F0010, 0x606C0020)[::-1]
    wire.master.download(DRIVE, 0x1C13, 0, b"\0")
    wire.master.download(DRIVE, 0x1A00, 0, b"\0")
    for n, entry in enumerate(entries):
        wire.master.download(DRIVE, 0x1A00, n + 1, struct.pack("<I", entry))
    wire.master.download(DRIVE, 0x1A00, 0, b"\4")
    wire.master.download(DRIVE, 0x1C13, 0, b"\1")
    wire.master.sync_manager(DRIVE, 3, 0x10F0, 12, 0x20)
    assert wire.master.request(DRIVE, SAFEOP) == (SAFEOP, 0)
    bench.plant.machine["error_code"], bench.plant.machine["state"] = 0x1234, 7
    bench.coupling.give(bench.plant.present_inputs())
    speed, error, position, status = struct.unpack("<iHiH", wire.master.read(DRIVE, 0x10F0, 12))
    assert (error, status & 0x4F) == (0x1234, 0x08)


def test_compact_process_data_of_the_analog_inputs(bench):
    wire = Wire(bench, states=(PREOP,))
    wire.configure()
    wire.master.download(ANALOG_IN, 0x1C13, 0, b"\0")
    for n in range(4):
        wire.master.download(ANALOG_IN, 0x1C13, n + 1, struct.pack("<H", 0x1A01 + 2 * n))
    wire.master.download(ANALOG_IN, 0x1C13, 0, b"\4")
    assert wire.master.request(ANALOG_IN, SAFEOP) == (0x12, 0x001E)
    wire.master.sync_manager(ANALOG_IN, 3, 0x1180, 8, 0x20)
    assert wire.master.request(ANALOG_IN, SAFEOP | 0x10) == (SAFEOP, 0)
    bench.coupling.give(bench.plant.present_inputs())
    values = struct.unpack("<4h", wire.master.read(ANALOG_IN, 0x1180, 8))
    image = struct.unpack("<HhHhHhHh", bench.coupling.inputs[:16])
    assert values == image[1::2] and values[0] > 3000
