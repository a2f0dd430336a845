"""One EtherCAT slave controller: 64 KiB of registers and process RAM, with the side effects that
accesses have.

Sources: ETG.1000.4, Beckhoff ESC datasheet section II.
"""

from collections.abc import Callable

from sim_backend.bus import registers as reg
from sim_backend.bus.sync_manager import SyncManagers

Reaction = Callable[[int, int], None]  # called with address and length after a write


class Esc:
    """Memory of a slave and what happens on access. ``None``/False from an access means: no working
    counter.

    ``on_write`` lists (start, end, reaction): reactions run after a master has written there;
    ``before_read`` the same before a read (clocks). ``on_mailbox`` is told (sync manager, written):
    a mailbox has been filled or emptied.
    """

    def __init__(self, fmmus: int, sync_managers: int, has_clock: bool = False):
        self.memory = bytearray(reg.MEMORY_SIZE)
        self.fmmu_count = fmmus
        self.sync_managers = SyncManagers(self.memory, sync_managers)
        self.on_write: list[tuple[int, int, Reaction]] = []
        self.before_read: list[tuple[int, int, Reaction]] = []
        self.on_mailbox: Callable[[int, bool], None] = lambda number, written: None
        self.on_mapping: Callable[[], None] = lambda: None
        self.on_data: Callable[[], None] = lambda: (
            None
        )  # process data written by a physical command
        self._writable = reg.writable_map(sync_managers, has_clock)

    def read(self, address: int, length: int) -> bytes | None:
        """What a master's read command finds."""
        end = address + length
        if end > reg.MEMORY_SIZE:
            return None
        if end <= reg.DIGITAL_OUTPUTS:
            for start, stop, reaction in self.before_read:
                if address < stop and start < end:
                    reaction(address, length)
            return bytes(self.memory[address:end])
        filled = self.sync_managers.over(address, end)
        for area in filled:
            if (
                area.is_closed
                or area.master_writes
                or area.is_mailbox
                and not self.sync_managers.is_full(area.number)
            ):
                return None
        data = bytes(self.memory[address:end])
        for area in filled:
            if area.is_mailbox and end >= area.end:
                self.sync_managers.set_full(area.number, False)
                self.on_mailbox(area.number, False)
        return data

    def write(self, address: int, data: bytes | bytearray) -> bool:
        """A master's write. Read-only bytes are left as they are; False where nothing could be
        written.
        """
        end = address + len(data)
        if end > reg.MEMORY_SIZE:
            return False
        if address >= reg.DIGITAL_OUTPUTS:
            return self._write_process(address, end, data)
        memory, writable = self.memory, self._writable
        if end > reg.PROCESS_RAM:
            return False
        mask = writable[address:end]
        if not any(mask):
            return False
        if all(mask):
            memory[address:end] = data
        else:
            for i, flag in enumerate(mask):
                if flag:
                    memory[address + i] = data[i]
        for start, stop, reaction in self.on_write:
            if address < stop and start < end:
                reaction(address, len(data))
        if reg.FMMU <= address < 0x0900 or address < reg.FMMU < end:
            self.sync_managers.reload()
            self.on_mapping()
        return True

    def _write_process(self, address: int, end: int, data: bytes | bytearray) -> bool:
        areas = self.sync_managers.over(address, end)
        for area in areas:
            if (
                area.is_closed
                or not area.master_writes
                or area.is_mailbox
                and self.sync_managers.is_full(area.number)
            ):
                return False
        self.memory[address:end] = data
        for area in areas:
            if end >= area.end:
                if area.is_mailbox:
                    self.sync_managers.set_full(area.number, True)
                    self.on_mailbox(area.number, True)
                elif area.triggers_watchdog:
                    self.on_data()
        return True

    def get(self, address: int, size: int) -> int:
        """An unsigned number out of the memory, without side effects."""
        return int.from_bytes(self.memory[address : address + size], "little")

    def put(self, address: int, size: int, value: int) -> None:
        """Writes an unsigned number as the slave itself does: no protection, no side effects."""
        self.memory[address : address + size] = (value & ((1 << 8 * size) - 1)).to_bytes(
            size, "little"
        )
