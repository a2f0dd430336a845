"""Any rig from INIT to OP with the small master, every slave at logical addresses of its own."""

import struct

from drivers.mapping import described_pdos
from epa_rt.config.rig_checks import entries_of
from epa_rt.config.terminal import OUTPUTS
from epa_rt.signals.drive_options import drive_options
from tests.bus.emulator.small_master import LRW, OP, PREOP, SAFEOP, SmallMaster

LOGICAL = 0x10000
DRIVE_MAILBOX, TERMINAL_MAILBOX = (48, 0x1000, 0x1030), (128, 0x1000, 0x1080)


def settings_of(rig, slave):
    """Objects that the simulated backend takes as written: (index, subindex, bytes)."""
    sampling = slave.description.sampling
    if sampling is not None and sampling.has_filter:
        return [(0x8000, 0x06, b"\0")]
    if slave.device != "EPOS4" or slave.analog_command is not None:
        return []
    options = drive_options(rig)
    return [
        *(
            (index, 0, struct.pack("<h", value))
            for index, value in zip((0x6007, 0x605A, 0x605B, 0x605C, 0x605E), options, strict=False)
        ),
        (0x6084, 0, struct.pack("<I", options.deceleration_rpm_s)),
        (0x6085, 0, struct.pack("<I", options.quick_stop_rpm_s)),
    ]


class Wire:
    """Master, addresses by slave name, and one process data frame: outputs in rig order, then
    inputs.
    """

    def __init__(self, bus, states=(PREOP, SAFEOP, OP)):
        self.bus, self.master, self.rig = bus, SmallMaster(bus), bus.rig
        addresses = self.master.number_slaves()
        self.at = {
            slave.name: address for slave, address in zip(bus.rig.slaves, addresses, strict=False)
        }
        self.logical = LOGICAL
        self.cuts = []
        self.expected_counter = 0
        for state in states:
            if state == SAFEOP:
                self.configure()
            if state == OP:
                self.exchange(bytes(self.output_size))
            for slave in self.rig.slaves:
                if state == PREOP:
                    self.request_preop(slave)
                status, code = self.master.request(self.at[slave.name], state)
                assert (status, code) == (state, 0), (slave.name, hex(status), hex(code))

    def request_preop(self, slave):
        if slave.description.serves_objects:
            mailbox = DRIVE_MAILBOX if slave.description.is_drive else TERMINAL_MAILBOX
            self.master.mailbox(self.at[slave.name], *mailbox)

    def configure(self):
        outputs, inputs = [], []
        for slave in self.rig.slaves:
            at = self.at[slave.name]
            if slave.device == "EPOS4":
                self.map_drive(slave)
            for index, subindex, data in settings_of(self.rig, slave):
                self.master.download(at, index, subindex, data)
            out_bits = sum(entry.bits for entry in entries_of(slave, True))
            in_bits = sum(entry.bits for entry in entries_of(slave, False))
            if not slave.description.serves_objects:
                for number, manager in enumerate(slave.description.sync_managers):
                    is_out = manager.use == OUTPUTS
                    rows, bits = (outputs, out_bits) if is_out else (inputs, in_bits)
                    size = (bits + 7) // 8
                    self.master.sync_manager(
                        at, number, manager.start, size, manager.control, manager.enable
                    )
                    rows.append((slave, at, bits, manager.start))
            elif not slave.description.is_drive:
                self.assign(slave)
                if in_bits:
                    self.master.sync_manager(at, 3, 0x1180, (in_bits + 7) // 8, 0x20)
                    inputs.append((slave, at, in_bits, 0x1180))
                if out_bits:
                    self.master.sync_manager(at, 2, 0x1100, (out_bits + 7) // 8, 0x64)
                    outputs.append((slave, at, out_bits, 0x1100))
            else:
                for bits, number, start, control, rows in (
                    (out_bits, 2, 0x1060, 0x64, outputs),
                    (in_bits, 3, 0x10F0, 0x20, inputs),
                ):
                    self.master.sync_manager(
                        at, number, start, bits // 8, control, 1 if bits else 0
                    )
                    if bits:
                        rows.append((slave, at, bits, start))
        self.output_size = self.place(outputs, 0, 2)
        self.input_size = self.place(inputs, self.output_size, 1)
        self.expected_counter = 2 * len(outputs) + len(inputs)

    def place(self, rows, start, kind):
        """FMMUs for one direction, byte aligned; returns the bytes."""
        size = 0
        for _, at, bits, physical in rows:
            count = (bits + 7) // 8
            self.master.fmmu(
                at,
                0 if kind == 2 else 1,
                self.logical + start + size,
                count,
                0,
                (bits - 1) % 8,
                physical,
                0,
                kind,
            )
            size += count
        return size

    def assign(self, slave):
        """The PDOs of a terminal whose description lists more of them than travel by default."""
        described = slave.description
        if not described.chooses or described.neutral:
            return
        for index, outputs in ((0x1C12, True), (0x1C13, False)):
            pdos = [pdo.index for pdo in described_pdos(slave, outputs)]
            if pdos:
                self.master.download(self.at[slave.name], index, 0, b"\0")
                for n, pdo in enumerate(pdos, 1):
                    self.master.download(self.at[slave.name], index, n, struct.pack("<H", pdo))
                self.master.download(self.at[slave.name], index, 0, bytes([len(pdos)]))

    def map_drive(self, slave):
        at, master = self.at[slave.name], self.master
        for index, pdo, outputs in ((0x1C12, 0x1600, True), (0x1C13, 0x1A00, False)):
            entries = entries_of(slave, outputs)
            master.download(at, index, 0, b"\0")
            master.download(at, pdo, 0, b"\0")
            for n, entry in enumerate(entries):
                master.download(
                    at,
                    pdo,
                    n + 1,
                    struct.pack("<I", entry.index << 16 | entry.subindex << 8 | entry.bits),
                )
            master.download(at, pdo, 0, bytes([len(entries)]))
            if entries:
                master.download(at, index, 1, struct.pack("<H", pdo))
                master.download(at, index, 0, b"\1")

    def exchange(self, outputs):
        """One frame; returns (inputs, working counter), or None where it did not come back."""
        answer = self.master.one(LRW, self.logical, outputs + bytes(self.input_size))
        return None if answer is None else (answer[0][self.output_size :], answer[1])
