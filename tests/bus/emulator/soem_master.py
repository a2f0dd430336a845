"""A plain pysoem master, run beside the emulated bus: prints one JSON object about what it saw.

usage: soem_master.py RIG [compare CYCLES | die]
"""

import json
import os
import random
import signal
import struct
import sys

import pysoem

from epa_rt.config.rig import load_rig
from epa_rt.config.rig_checks import entries_of
from epa_rt.signals.image import image_of
from sim_backend.bus.control import ControlClient
from tests.bus.emulator.bring_up import settings_of


def map_drive(slave, rig_slave):
    """Writes the rig's mapping, in the order that the drive asks for."""
    for index, pdo, outputs in ((0x1C12, 0x1600, True), (0x1C13, 0x1A00, False)):
        entries = entries_of(rig_slave, outputs)
        slave.sdo_write(index, 0, b"\0")
        slave.sdo_write(pdo, 0, b"\0")
        for n, entry in enumerate(entries):
            slave.sdo_write(
                pdo, n + 1, struct.pack("<I", entry.index << 16 | entry.subindex << 8 | entry.bits)
            )
        slave.sdo_write(pdo, 0, bytes([len(entries)]))
        if entries:
            slave.sdo_write(index, 1, struct.pack("<H", pdo))
            slave.sdo_write(index, 0, b"\1")


class Soem:
    def __init__(self, rig):
        self.rig = rig
        self.outputs, self.inputs = image_of(rig, outputs=True), image_of(rig, outputs=False)
        self.master = pysoem.Master()
        self.master.open(os.environ["EPA_BUS_INTERFACE"])

    def set_up(self, slave, rig_slave):
        if rig_slave.device == "EPOS4":
            map_drive(slave, rig_slave)
        for index, subindex, data in settings_of(self.rig, rig_slave):
            slave.sdo_write(index, subindex, data)

    def bring_up(self):
        master = self.master
        found = next(count for _ in range(5) if (count := master.config_init()) > 0)
        for slave, rig_slave in zip(master.slaves, self.rig.slaves, strict=False):
            slave.config_func = lambda _, slave=slave, rig_slave=rig_slave: self.set_up(
                slave, rig_slave
            )
        master.manual_state_change = True
        master.config_overlap_map()
        has_clock = master.config_dc()
        for slave, rig_slave in zip(master.slaves, self.rig.slaves, strict=False):
            if rig_slave.device == "EPOS4" and not entries_of(rig_slave, True):
                slave._fpwr(
                    0x0816, b"\0"
                )  # SOEM leaves the unused sync manager on, which the slave refuses
        master.state = pysoem.SAFEOP_STATE
        master.write_state()
        if not all(
            len(slave.output) or not entries_of(rig_slave, True)
            for slave, rig_slave in zip(master.slaves, self.rig.slaves, strict=False)
        ):
            raise SystemExit("outputs are missing")
        assert master.state_check(pysoem.SAFEOP_STATE, 500_000) == pysoem.SAFEOP_STATE, [
            hex(s.al_status) for s in master.slaves
        ]
        self.exchange(bytes(self.outputs.size))
        master.state = pysoem.OP_STATE
        master.write_state()
        for _ in range(500):
            self.exchange(bytes(self.outputs.size))
            if master.state_check(pysoem.OP_STATE, 1000) == pysoem.OP_STATE:
                break
        return found, has_clock

    def exchange(self, outputs_raw):
        """Image out, image and counter in."""
        for slave, rig_slave in zip(self.master.slaves, self.rig.slaves, strict=False):
            start, size = self.outputs.slices[rig_slave.name]
            if size:
                assert len(slave.output) == size, (rig_slave.name, len(slave.output), size)
                slave.output = outputs_raw[start : start + size]
        self.master.send_overlap_processdata()
        counter = self.master.receive_processdata(100_000)
        parts = [
            slave.input[: self.inputs.slices[rig_slave.name][1]]
            for slave, rig_slave in zip(self.master.slaves, self.rig.slaves, strict=False)
        ]
        return b"".join(parts), counter


def report(soem, found, has_clock):
    master = soem.master
    counters = [soem.exchange(bytes(soem.outputs.size))[1] for _ in range(50)]
    return {
        "found": found,
        "has_clock": bool(has_clock),
        "state": master.state_check(pysoem.OP_STATE, 1000),
        "expected": master.expected_wkc,
        "counters": counters,
        "names": [slave.name for slave in master.slaves],
        "identity": [(slave.man, slave.id, slave.rev) for slave in master.slaves],
        "sizes": [(len(slave.output), len(slave.input)) for slave in master.slaves],
        "inputs": soem.exchange(bytes(soem.outputs.size))[0].hex(),
    }


def compare(soem, cycles):
    """In lock step, cycle by cycle beside the simulated backend. Returns the first cycle that
    differs, or None.
    """
    from pathlib import Path

    from epa_rt.models.plant_file import load_plant
    from sim_backend.backend import SimBackend

    reference = SimBackend(soem.rig, load_plant(Path(sys.argv[1]).parent / soem.rig.plant), 1)
    reference.open()
    with ControlClient(os.environ["EPA_BUS_CONTROL"]) as control:
        control.ask("rewind")
    choice = random.Random(4)
    for cycle in range(cycles):
        if cycle % 5 == 0:
            outputs = bytearray(choice.randbytes(soem.outputs.size))
            outputs[soem.outputs.slices["valves"][0]] &= 0x0F
        inputs, counter = soem.exchange(bytes(outputs))
        if (
            counter != soem.master.expected_wkc
            or inputs != reference.exchange(bytes(outputs)).inputs_raw
        ):
            return cycle
    return None


def main():
    rig = load_rig(sys.argv[1])
    soem = Soem(rig)
    try:
        found, has_clock = soem.bring_up()
        if sys.argv[2:] == ["die"]:
            for _ in range(20):
                soem.exchange(bytes([3]) + bytes(soem.outputs.size - 1))
            print(json.dumps({"state": soem.master.state_check(pysoem.OP_STATE, 1000)}), flush=True)
            os.kill(os.getpid(), signal.SIGKILL)
        if sys.argv[2:3] == ["compare"]:
            print(json.dumps({"differs": compare(soem, int(sys.argv[3]))}))
        else:
            print(json.dumps(report(soem, found, has_clock)))
    finally:
        soem.master.close()


if __name__ == "__main__":
    main()
