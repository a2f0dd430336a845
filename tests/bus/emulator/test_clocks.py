"""Distributed clocks: latched times, delays by the wiring, offset, drift, and slaves that follow
the reference.
"""

import struct

import pytest

from tests.bus.emulator.small_master import FRMW, SmallMaster

COUPLER, VALVES, ANALOG_IN, ANALOG_OUT, DRIVE = range(0x1001, 0x1006)


def clocked(make_bus, **more):
    bus = make_bus("bench", **more)
    master = SmallMaster(bus)
    master.number_slaves()
    return master


def system_time(master, station):
    return int.from_bytes(master.read(station, 0x0910, 8), "little")


def test_who_has_a_clock(make_bus):
    master = clocked(make_bus)
    assert [bool(master.number(station, 0x0008) & 4) for station in range(0x1001, 0x1006)] == [
        True,
        False,
        False,
        False,
        True,
    ]


def test_links_by_the_wiring(make_bus):
    """Coupler: in, internal bus, copper out. Last terminal and drive are ends."""
    master = clocked(make_bus)
    status = [master.number(station, 0x0110) for station in range(0x1001, 0x1006)]
    links = [[bool(word >> 4 + port & 1) for port in range(4)] for word in status]
    assert links == [
        [True, True, True, False],
        [True, True, False, False],
        [True, True, False, False],
        [True, False, False, False],
        [True, False, False, False],
    ]
    for word in status:
        for port in range(4):
            loop = word >> 8 + 2 * port & 3
            assert loop == (2 if word >> 4 + port & 1 else 1)


def test_latched_port_times_show_the_round_trips(make_bus):
    master = clocked(make_bus, offset_ns={"coupler": 5_000_000_000, "drive": 77})
    master.one(8, 0x0900 << 16, bytes(4))
    ports = struct.unpack("<4I", master.read(COUPLER, 0x0900, 16))
    terminals, whole = ports[1] - ports[0], ports[2] - ports[0]
    assert 0 < terminals < whole < 5000
    delay = (struct.unpack("<Q", master.read(DRIVE, 0x0918, 8))[0] - 77) - (
        struct.unpack("<Q", master.read(COUPLER, 0x0918, 8))[0] - 5_000_000_000
    )
    assert 0 < delay < whole
    assert struct.unpack("<Q", master.read(COUPLER, 0x0918, 8))[0] & 0xFFFFFFFF == ports[0]


def test_system_time_is_local_time_and_offset(make_bus):
    master = clocked(make_bus, offset_ns={"coupler": 123})
    before = system_time(master, COUPLER)
    master.write(COUPLER, 0x0920, struct.pack("<q", -before))
    assert abs(system_time(master, COUPLER) - 2 * master.step_ns) < 10


@pytest.mark.parametrize("ppm", [-80.0, 0.0, 50.0])
def test_drift(make_bus, ppm):
    master = clocked(make_bus, drift_ppm={"coupler": ppm})
    before, began_ns = system_time(master, COUPLER), master.now_ns
    master.wait(1000)
    passed = system_time(master, COUPLER) - before
    assert abs(passed - (master.now_ns - began_ns) * (1 + ppm * 1e-6)) <= 2


def test_a_slave_follows_the_reference_within_a_microsecond(make_bus):
    master = clocked(
        make_bus, drift_ppm={"coupler": 50.0, "drive": -30.0}, offset_ns={"drive": 20_000}
    )
    for _ in range(3000):
        master.one(FRMW, COUPLER | 0x0910 << 16, bytes(8))
    difference = struct.unpack("<I", master.read(DRIVE, 0x092C, 4))[0]
    assert difference & 0x7FFFFFFF < 1000
    assert abs(system_time(master, DRIVE) - system_time(master, COUPLER) + master.step_ns) < 2000


def test_without_a_reference_the_clocks_run_apart(make_bus):
    master = clocked(make_bus, drift_ppm={"coupler": 50.0, "drive": -30.0})
    before = system_time(master, DRIVE) - system_time(master, COUPLER)
    master.wait(1000)
    after = system_time(master, DRIVE) - system_time(master, COUPLER)
    assert abs(before - after - 80_000) < 100


def test_the_drift_may_be_changed_without_a_jump(make_bus):
    master = clocked(make_bus)
    before = system_time(master, COUPLER)
    master.bus.faults.add("clock_drift", value=100.0)
    assert abs(system_time(master, COUPLER) - before - master.step_ns) < 20
    before = system_time(master, COUPLER)
    master.wait(1000)
    assert abs(system_time(master, COUPLER) - before - 1_000_200_010) < 200


def test_in_real_time_the_plant_runs_by_the_reference_clock(make_bus):
    master = clocked(make_bus, drift_ppm={"coupler": 1000.0})
    before = master.bus.cycle
    for _ in range(2000):
        master.wait(5)
    assert abs(master.bus.cycle - before - 10_010) <= 1


def test_a_slave_without_clock_has_no_clock_registers(make_bus):
    master = clocked(make_bus)
    assert master.write(VALVES, 0x0910, bytes(8)) == 0
    assert master.write(COUPLER, 0x0910, bytes(8)) == 1
