"""Faults of the bus: frames, working counter, slaves, cable, clock. Those of the plant:
sim_backend/faults.py.

Frame faults count frames (process data, unless ``frames`` is "all"), the others count plant cycles.
"""

import random
from collections.abc import Callable
from typing import TYPE_CHECKING

from sim_backend.bus import registers as reg
from sim_backend.bus.fault_kinds import ALL_FAULTS, BUS_FAULTS, FRAME_FAULTS
from sim_backend.bus.frame import LRD, LRW
from sim_backend.faults import PLANT_FAULTS, Fault, FaultKind, make_fault

if TYPE_CHECKING:
    from sim_backend.bus.emulated_bus import EmulatedBus
    from sim_backend.bus.slave import Slave

_OPTIONS = {"leg": ("out", "back"), "frames": ("process", "all"), "alone": (False, True)}


class BusFaults:
    """The faults of one emulated bus; those of the plant are passed on to it."""

    def __init__(self, bus: "EmulatedBus", seed: int):
        self._bus = bus
        self._random = random.Random(seed)
        self._waiting: list[Fault] = []
        self._frame_faults: list[Fault] = []
        self._left: dict[int, int] = {}
        self._slave_faults: list[Fault] = []
        self._held: list[bytes] = []
        self.is_dark = False  # no slave is reached: nobody sends a frame back

    def add(
        self,
        kind: str,
        where: str = "",
        value: float | None = None,
        at_cycle: int | None = None,
        at_s: float | None = None,
        cycles: int | None = None,
        **options: object,
    ) -> Fault:
        """Takes up a fault, from now or from a cycle or time of the plant on. Raises ValueError."""
        for name, choice in options.items():
            if name not in _OPTIONS or choice not in _OPTIONS[name]:
                raise ValueError(
                    f"found {name}={choice!r}, expected "
                    + ", ".join(
                        f"{key}={'|'.join(map(str, words))}" for key, words in _OPTIONS.items()
                    )
                )
        if at_s is not None:
            at_cycle = round(at_s / self._bus.rig.period_s)
        if kind == "drive_supply_lost" and self._bus.drive is not None:
            # on a bus its slave goes with it, and the frames pass it by
            cycles = PLANT_FAULTS[kind].cycles if cycles is None else cycles
            kind, where, options = "slave_lost", self._bus.drive.name, {"alone": True}
        fault = make_fault(
            ALL_FAULTS,
            kind,
            where,
            value,
            self._bus.cycle if at_cycle is None else at_cycle,
            cycles,
            **options,
        )
        if kind in PLANT_FAULTS:
            self._bus.plant.faults.add(fault)
            return fault
        self._check_place(BUS_FAULTS[kind], where)
        self._waiting.append(fault)
        self.start_due(self._bus.cycle)
        return fault

    def _check_place(self, kind: FaultKind, where: str) -> None:
        slaves = self._bus.slaves
        able = {
            "": [where],
            "slave": list(slaves),
            "slave with a mailbox": [
                name for name, slave in slaves.items() if slave.coe is not None
            ],
            "slave with a clock": [
                "",
                *(name for name, slave in slaves.items() if slave.clock is not None),
            ],
        }[kind.where]
        if where not in able:
            raise ValueError(
                f"found the slave {where!r}, expected a {kind.where}:"
                f" {', '.join(filter(None, able))}"
            )

    def listed(self) -> list[Fault]:
        """All that are at work or still to come."""
        return (
            self._frame_faults
            + self._slave_faults
            + self._waiting
            + self._bus.plant.faults.listed()
        )

    def clear(self) -> None:
        """Ends every fault; slaves that were lost come back in INIT."""
        for fault in self._slave_faults:
            self._end(fault)
        self._waiting, self._frame_faults, self._slave_faults = [], [], []
        self._left.clear()
        for frame in self._held:
            self._bus.transmit(frame)
        self._held = []
        self._bus.plant.faults.clear(self._bus.plant)

    @property
    def is_idle(self) -> bool:
        """Nothing at work or to come, on the bus itself."""
        return not (self._waiting or self._frame_faults or self._slave_faults or self._held)

    @property
    def is_quiet(self) -> bool:
        """Nothing touches frames now."""
        return not self._frame_faults and not self._held and not self.is_dark

    def start_due(self, cycle: int) -> None:
        """Called at every plant cycle: begins and ends faults."""
        if self._waiting:
            for fault in [fault for fault in self._waiting if fault.at_cycle <= cycle]:
                self._waiting.remove(fault)
                fault.at_cycle = cycle
                if fault.kind in FRAME_FAULTS:
                    self._frame_faults.append(fault)
                    self._left[id(fault)] = -1 if fault.cycles is None else fault.cycles
                else:
                    self._slave_faults.append(fault)
                    self._begin(fault)
        if self._slave_faults:
            for fault in [fault for fault in self._slave_faults if fault.is_over(cycle)]:
                self._slave_faults.remove(fault)
                self._end(fault)

    def _clocked(self, where: str) -> "Slave | None":
        found = (
            slave
            for slave in self._bus.slaves.values()
            if slave.clock is not None and where in ("", slave.name)
        )
        return next(found, None)

    def _begin(self, fault: Fault) -> None:
        bus = self._bus
        if fault.kind == "clock_drift":
            clock = self._clocked(fault.where).clock
            fault.options["before_ppm"] = clock.drift_ppm
            clock.set_drift(fault.value, bus.agenda.now_ns)
            return
        slave = bus.slaves[fault.where]
        if fault.kind in ("sdo_refused", "sdo_forgotten"):
            (slave.coe.refused if fault.kind == "sdo_refused" else slave.coe.forgotten).add(
                int(fault.value)
            )
            return
        if fault.kind == "slave_falls":
            slave.al.fail(reg.SAFEOP, int(fault.value))
        else:
            slave.is_present, slave.is_bypassed = False, bool(fault.options.get("alone"))
            bus.rewire()

    def _end(self, fault: Fault) -> None:
        if fault.kind == "slave_lost":
            slave = self._bus.slaves[fault.where]
            slave.is_present, slave.is_bypassed = True, False
            slave.power_up()
            self._bus.rewire()
        elif fault.kind == "clock_drift":
            self._clocked(fault.where).clock.set_drift(
                fault.options["before_ppm"], self._bus.agenda.now_ns
            )
        elif fault.kind in ("sdo_refused", "sdo_forgotten"):
            coe = self._bus.slaves[fault.where].coe
            (coe.refused if fault.kind == "sdo_refused" else coe.forgotten).discard(
                int(fault.value)
            )

    def pass_frame(self, frame: bytearray, datagrams: list[tuple[int, int, int, int, int]]) -> None:
        """A frame while frame faults are at work: runs it, or not, and sends what comes back of
        it.
        """
        is_process = any(LRD <= datagram[0] <= LRW for datagram in datagrams)
        chosen = {
            fault.kind: fault for fault in self._frame_faults if self._takes(fault, is_process)
        }
        if (
            self.is_dark
            or "cable_pulled" in chosen
            or "frames_lost" in chosen
            and chosen["frames_lost"].options.get("leg", "out") == "out"
        ):
            self._bus.pass_time(datagrams)
            return
        self._bus.segment.run(frame, datagrams)
        if "frames_lost" in chosen:
            return
        if "wrong_working_counter" in chosen:
            self._miscount(frame, datagrams, int(chosen["wrong_working_counter"].value))
        answer = bytes(frame)
        if "frames_damaged" in chosen:
            answer = self._damaged(frame, datagrams)
        send: Callable[[], None] = lambda: self._send(answer, "frames_repeated" in chosen)  # noqa: E731
        if "frames_late" in chosen:
            self._bus.agenda.after(round(chosen["frames_late"].value * 1e9), send)
        elif "frames_reordered" in chosen:
            self._held.append(answer)
        else:
            send()

    def _takes(self, fault: Fault, is_process: bool) -> bool:
        """Does a fault hit this frame? Counts it down."""
        if not is_process and fault.kind != "cable_pulled" and fault.options.get("frames") != "all":
            return False
        left = self._left[id(fault)]
        if left == 0:
            self._frame_faults = [other for other in self._frame_faults if other is not fault]
            return False
        if left > 0:
            self._left[id(fault)] = left - 1
            if left == 1:
                self._frame_faults = [other for other in self._frame_faults if other is not fault]
        return True

    def _send(self, answer: bytes, twice: bool) -> None:
        for _ in range(2 if twice else 1):
            self._bus.transmit(answer)
        held, self._held = self._held, []
        for frame in held:
            self._bus.transmit(frame)

    @staticmethod
    def _miscount(
        frame: bytearray, datagrams: list[tuple[int, int, int, int, int]], more: int
    ) -> None:
        for command, _, _, start, length in datagrams:
            if LRD <= command <= LRW:
                place = start + length
                total = ((frame[place] | frame[place + 1] << 8) + more) & 0xFFFF
                frame[place : place + 2] = total.to_bytes(2, "little")

    def _damaged(self, frame: bytearray, datagrams: list[tuple[int, int, int, int, int]]) -> bytes:
        """A frame that a checksum would have caught: never only the data, always something that a
        master can see.
        """
        way = self._random.randrange(5)
        _, _, _, start, length = datagrams[0]
        if way == 0:
            return bytes(frame[: self._random.randrange(15, start + length)])
        if way == 1:
            frame[start - 9] ^= 1 << self._random.randrange(8)  # index
        elif way == 2:
            frame[start - 4] ^= 1 << self._random.randrange(8)  # length
        elif way == 3:
            frame[15] ^= 0x10 << self._random.randrange(4)  # type of EtherCAT frame
        frame[start + length : start + length + 2] = (
            b"\0\0" if way == 4 else frame[start + length : start + length + 2]
        )
        return bytes(frame)
