"""Distributed clocks of one slave: a drifting local clock, its system time, and the loop that
follows the reference.

Sources: ETG.1000.4 (DC registers 0x0900 to 0x09FF), Beckhoff ESC datasheet section I, chapter
Distributed Clocks. The real controller changes its clock's speed by one tick in ten at most; so
does this one.
"""

from struct import pack_into, unpack_from

from sim_backend.bus import registers as reg
from sim_backend.bus.agenda import Agenda
from sim_backend.bus.esc import Esc

_MAX_SLEW = 0.1  # of the time since the last correction
_MASK = (1 << 64) - 1


class Clock:
    """Local clock of a slave. ``drift_ppm`` against the emulator's clock, ``offset_ns`` at its time
    zero.

    ``port_delays_ns``: when a frame that enters the first slave at time zero passes port 0 to 3
    here (None: no link).
    """

    def __init__(self, esc: Esc, agenda: Agenda, drift_ppm: float, offset_ns: int):
        self._esc, self._agenda = esc, agenda
        self._base_ns, self._base_local = 0, float(offset_ns)
        self._rate = 1.0 + drift_ppm * 1e-6
        self._correction, self._corrected_ns = 0.0, 0
        self.port_delays_ns: tuple[int | None, ...] = (0, None, None, None)
        esc.before_read.append((reg.DC_SYSTEM_TIME, reg.DC_SYSTEM_TIME + 8, self._show))
        esc.on_write.append((reg.DC_PORT_TIMES, reg.DC_PORT_TIMES + 4, self._latch))
        esc.on_write.append((reg.DC_SYSTEM_TIME, reg.DC_SYSTEM_TIME + 8, self._follow))
        esc.on_write.append((reg.DC_SPEED_START, reg.DC_SPEED_START + 2, self._restart))
        esc.put(reg.DC_SPEED_START, 2, 0x1000)

    def local_ns(self, now_ns: int) -> float:
        """Free-running local time at a time of the emulator's clock."""
        return self._base_local + (now_ns - self._base_ns) * self._rate

    @property
    def drift_ppm(self) -> float:
        return (self._rate - 1.0) * 1e6

    def set_drift(self, drift_ppm: float, now_ns: int) -> None:
        """From now on another speed, without a jump."""
        self._base_local, self._base_ns = self.local_ns(now_ns), now_ns
        self._rate = 1.0 + drift_ppm * 1e-6

    def offset_ns(self) -> int:
        """What the master has written as the difference between system time and local time."""
        return int.from_bytes(
            self._esc.memory[reg.DC_OFFSET : reg.DC_OFFSET + 8], "little", signed=True
        )

    def ahead_ns(self) -> int:
        """System time less local time: the master's offset, and what following another clock has
        added.
        """
        return self.offset_ns() + int(self._correction)

    def system_ns(self) -> int:
        """Copy of the system time when a frame that enters the bus now passes this slave."""
        now_ns = self._agenda.now_ns + (self.port_delays_ns[0] or 0)
        return (
            int(self.local_ns(now_ns) + self._correction) + self.offset_ns()
        )  # nanoseconds since 2000 need 60 bits

    def _show(self, address: int, length: int) -> None:
        pack_into("<Q", self._esc.memory, reg.DC_SYSTEM_TIME, self.system_ns() & _MASK)

    def _latch(self, address: int, length: int) -> None:
        """A write to 0x0900 stores when this frame has passed each port, in local time."""
        now_ns = self._agenda.now_ns
        for port, delay_ns in enumerate(self.port_delays_ns):
            if delay_ns is not None:
                pack_into(
                    "<I",
                    self._esc.memory,
                    reg.DC_PORT_TIMES + 4 * port,
                    int(self.local_ns(now_ns + delay_ns)) & 0xFFFFFFFF,
                )
        entered = int(self.local_ns(now_ns + (self.port_delays_ns[0] or 0)))
        pack_into("<Q", self._esc.memory, reg.DC_RECEIVE_TIME, entered & _MASK)

    def _restart(self, address: int, length: int) -> None:
        self._corrected_ns = self._agenda.now_ns

    def _follow(self, address: int, length: int) -> None:
        """A write to 0x0910 brings the reference's time; the local copy slews towards it."""
        memory = self._esc.memory
        received, delay = (
            unpack_from("<Q", memory, reg.DC_SYSTEM_TIME)[0],
            self._esc.get(reg.DC_DELAY, 4),
        )
        if length < 8:  # 32-bit time: the upper half is the slave's own
            received = self.system_ns() & ~0xFFFFFFFF | received & 0xFFFFFFFF
        ahead = self.system_ns() - (received + delay)
        if abs(ahead) >= 2**31:
            ahead = (ahead + 2**31) % 2**32 - 2**31
        now_ns = self._agenda.now_ns
        step = _MAX_SLEW * max(0, now_ns - self._corrected_ns)
        self._correction -= min(max(ahead, -step), step)
        self._corrected_ns = now_ns
        magnitude = min(abs(ahead), 0x7FFFFFFF)
        self._esc.put(reg.DC_DIFFERENCE, 4, magnitude | (0x80000000 if ahead > 0 else 0))
