"""The emulated plant steps where SYNC0 is, whenever the emulator was started and whatever offset a
master has written.
"""

import struct

import pytest

from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.conftest import bus_of

SYSTEM_TIME, OFFSET, PERIOD_NS = 0x0910, 0x0920, 1_000_000


@pytest.mark.parametrize("offset_ns", [0, 123_456, -987_654_321, 817_000_000_000_000_001])
def test_plant_steps_at_whole_periods_of_system_time(offset_ns):
    bus = bus_of("bench")
    wire = Wire(bus)
    wire.master.write(
        wire.at["coupler"], SYSTEM_TIME, bytes(8)
    )  # as SOEM does to all: the clock gives way a little
    wire.master.write(wire.at["coupler"], OFFSET, struct.pack("<q", offset_ns))
    steps, clock = [], bus.slaves["coupler"].clock
    bus.advance_to(wire.master.now_ns + 2 * PERIOD_NS)
    now_ns, before = wire.master.now_ns + 2 * PERIOD_NS, bus.cycle
    while len(steps) < 20:
        now_ns += 1_000
        bus.advance_to(now_ns)
        if bus.cycle != before:
            assert bus.cycle == before + 1
            before = bus.cycle
            steps.append(clock.system_ns() % PERIOD_NS)
    assert max(steps) <= 1_001  # the microsecond in which it was looked at
