"""Sync managers: which stretches of the process RAM are buffers or mailboxes, and who may touch
them.

Sources: ETG.1000.4 (sync manager registers 0x0800+8n), Beckhoff ESC datasheet section I, chapter
SyncManager.
"""

from struct import Struct
from typing import NamedTuple

from sim_backend.bus.registers import SYNC_MANAGER

_SETTING = Struct("<HHBBBB")
MAILBOX_FULL = 0x08
WATCHDOG_TRIGGER = 0x40
ENABLE = 0x01
REPEAT = 0x02


class Area(NamedTuple):
    """An active sync manager: number, first byte, one past the last, mailbox or buffered, master
    writes or reads.
    """

    number: int
    start: int
    end: int
    is_mailbox: bool
    master_writes: bool
    triggers_watchdog: bool
    is_closed: bool


class SyncManagers:
    """The sync managers of one slave controller, on its memory."""

    def __init__(self, memory: bytearray, count: int):
        self.count = count
        self._memory = memory
        self.areas: tuple[Area, ...] = ()

    def settings(self, number: int) -> tuple[int, int, int, int, int, int]:
        """Start, length, control, status, activate, PDI control as they stand in the registers."""
        return _SETTING.unpack_from(self._memory, SYNC_MANAGER + 8 * number)

    def is_enabled(self, number: int) -> bool:
        return number < self.count and bool(self.settings(number)[4] & ENABLE)

    def reload(self) -> None:
        """Reads the registers again after any of them changed. A mailbox that is switched off
        forgets its content.
        """
        areas = []
        for number in range(self.count):
            start, length, control, _, activate, pdi = self.settings(number)
            if not activate & ENABLE:
                self.set_full(number, False)
                continue
            if length:
                areas.append(
                    Area(
                        number,
                        start,
                        start + length,
                        control & 0x03 == 0x02,
                        bool(control & 0x0C),
                        bool(control & 0x40),
                        bool(pdi & ENABLE),
                    )
                )
        self.areas = tuple(areas)

    def close(self, number: int, closed: bool) -> None:
        """The slave's own switch (PDI control): closed, a master's access is refused."""
        if number < self.count:
            place = SYNC_MANAGER + 8 * number + 7
            self._memory[place] = self._memory[place] & ~ENABLE | (ENABLE if closed else 0)
            self.reload()

    def is_full(self, number: int) -> bool:
        return bool(self._memory[SYNC_MANAGER + 8 * number + 5] & MAILBOX_FULL)

    def set_full(self, number: int, full: bool) -> None:
        place = SYNC_MANAGER + 8 * number + 5
        self._memory[place] = self._memory[place] & ~MAILBOX_FULL | (MAILBOX_FULL if full else 0)

    def over(self, start: int, end: int) -> list[Area]:
        """The active areas that a stretch of memory touches."""
        return [area for area in self.areas if area.start < end and start < area.end]

    def lets_through(self, start: int, end: int, writing: bool) -> bool:
        """May process data pass between master and this stretch? Not through mailboxes, nor against
        the direction.
        """
        return all(
            not area.is_mailbox and not area.is_closed and area.master_writes == writing
            for area in self.over(start, end)
        )
