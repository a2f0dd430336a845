"""The process data watchdog of a slave: expired when no output data have come for the time in the
registers.

Sources: ETG.1000.4, Beckhoff ESC datasheet section II (registers 0x0400, 0x0420, 0x0440, 0x0442).
"""

from sim_backend.bus import registers as reg
from sim_backend.bus.esc import Esc

_TICK_NS = 40


class Watchdog:
    """``time_ns`` of the divider and the counter; zero switches it off."""

    def __init__(self, esc: Esc):
        self._esc = esc
        self.fed_ns = 0
        self.expired = False
        self.timeout_ns = 0
        esc.on_write.append(
            (reg.WATCHDOG_DIVIDER, reg.WATCHDOG_DATA + 2, lambda address, length: self._set())
        )
        self.power_up()

    def power_up(self) -> None:
        self._esc.put(reg.WATCHDOG_DIVIDER, 2, 2498)
        self._esc.put(reg.WATCHDOG_PDI, 2, 1000)
        self._esc.put(reg.WATCHDOG_DATA, 2, 1000)
        self._esc.put(reg.WATCHDOG_STATUS, 2, 1)
        self._set()

    def _set(self) -> None:
        divider = self._esc.get(reg.WATCHDOG_DIVIDER, 2)
        self.timeout_ns = (divider + 2) * _TICK_NS * self._esc.get(reg.WATCHDOG_DATA, 2)

    def feed(self, now_ns: int) -> None:
        self.fed_ns = now_ns
        if self.expired:
            self.expired = False
            self._esc.put(reg.WATCHDOG_STATUS, 2, 1)

    def check(self, now_ns: int) -> bool:
        """True in the moment in which it expires."""
        if self.expired or not self.timeout_ns or now_ns - self.fed_ns <= self.timeout_ns:
            return False
        self.expired = True
        self._esc.put(reg.WATCHDOG_STATUS, 2, 0)
        self._esc.put(reg.WATCHDOG_COUNT, 1, min(255, self._esc.get(reg.WATCHDOG_COUNT, 1) + 1))
        return True
