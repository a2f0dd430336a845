"""FMMUs to the bit, and logical working counters."""

import pytest

from epa_rt.config.rig import rig_from
from epa_rt.config.source import parse_yaml
from epa_rt.models.plant_file import load_plant
from sim_backend.bus.emulated_bus import EmulatedBus
from tests.bus.emulator.conftest import RIGS
from tests.bus.emulator.small_master import LRD, LRW, LWR, OP, PREOP, SAFEOP, SmallMaster

BYTE = 0x40000


@pytest.fixture
def two_valve_terminals():
    """A bench with a second EL2124 beside the first: both take half of one logical byte."""
    text = (RIGS / "bench.yaml").read_text()
    line = "  - {name: valves, device: EL2124}\n"
    assert line in text
    rig = rig_from(
        parse_yaml(
            text.replace(line, line + "  - {name: more_valves, device: EL2124}\n"), "two.yaml"
        )
    )
    bus = EmulatedBus(rig, load_plant(RIGS / rig.plant))
    master = SmallMaster(bus)
    master.number_slaves()
    for station, first in ((0x1002, 0), (0x1003, 4)):
        master.sync_manager(station, 0, 0x0F00, 1, 0x44, 9)
        master.fmmu(station, 0, BYTE, 1, first, first + 3, 0x0F00, 0, 2)
        for state in (PREOP, SAFEOP, OP):
            assert master.request(station, state) == (state, 0)
    return master


@pytest.mark.parametrize("value", [0x00, 0x0F, 0xF0, 0x5A, 0xA5, 0xFF])
def test_two_terminals_in_one_byte_keep_their_bits_apart(two_valve_terminals, value):
    master = two_valve_terminals
    assert master.one(LRW, BYTE, bytes([value]))[1] == 4
    slaves = master.bus.slaves
    assert slaves["valves"].esc.memory[0x0F00] & 0x0F == value & 0x0F
    assert slaves["more_valves"].esc.memory[0x0F00] & 0x0F == value >> 4
    master.wait(2)
    assert master.bus.coupling.outputs[0] == value & 0x0F
    assert master.bus.coupling.outputs[1] == value >> 4


def test_a_bit_fmmu_leaves_the_other_bits_of_memory(two_valve_terminals):
    master = two_valve_terminals
    memory = master.bus.slaves["more_valves"].esc.memory
    memory[0x0F00] = 0xC0
    master.one(LWR, BYTE, b"\x30")
    assert memory[0x0F00] == 0xC3


def test_a_bit_fmmu_that_reads_leaves_the_other_bits_of_the_datagram(two_valve_terminals):
    master = two_valve_terminals
    master.fmmu(0x1003, 1, BYTE + 8, 1, 2, 4, 0x1200, 5, 1)
    master.bus.slaves["more_valves"].esc.memory[0x1200] = 0b1010_0000
    assert master.one(LRD, BYTE + 8, b"\xff") == (bytes([0b1111_0111]), 1)


def test_a_bit_run_may_cross_bytes(two_valve_terminals):
    master = two_valve_terminals
    master.fmmu(
        0x1003, 1, BYTE + 16, 2, 6, 1, 0x1200, 3, 2
    )  # bits 6, 7 of one byte and 0, 1 of the next
    master.one(LWR, BYTE + 16, bytes([0b1000_0000, 0b0000_0001]))
    assert master.bus.slaves["more_valves"].esc.memory[0x1200] == 0b0011_0000


def test_part_of_an_fmmu_counts_like_the_whole(wire):
    assert wire.master.one(LRD, wire.logical + wire.output_size, bytes(3))[1] == 1


def test_logical_counters(wire):
    data = bytes(wire.output_size + wire.input_size)
    assert wire.master.one(LRW, wire.logical, data)[1] == 8
    assert wire.master.one(LWR, wire.logical, data)[1] == 3
    assert wire.master.one(LRD, wire.logical, data)[1] == 2
    assert wire.master.one(LRW, wire.logical + 0x1000, data)[1] == 0


def test_a_switched_off_fmmu_counts_no_more(wire):
    data = bytes(wire.output_size + wire.input_size)
    wire.master.write(wire.at["analog_in"], 0x0600 + 16 + 12, b"\0")
    assert wire.master.one(LRW, wire.logical, data)[1] == 7


def test_outputs_stay_closed_below_safeop(wire):
    data = bytes(wire.output_size + wire.input_size)
    wire.master.request(wire.at["drive"], PREOP)
    assert wire.master.one(LRW, wire.logical, data)[1] == 5
