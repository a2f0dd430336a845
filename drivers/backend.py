"""EtherCAT as a backend: pysoem in front of real slaves, or of emulated ones. It does not know which."""

import time

from epa_rt.backend import BackendError, Exchange
from epa_rt.config.rig import Rig
from epa_rt.control.cia402 import DriveState, decode
from epa_rt.signals.image import image_of

from drivers.bring_up import configure, identify, reached, stop_clocks
from drivers.bus import LOST, Bus
from drivers.clock import Edges, ReferenceClock
from drivers.interface import choose
from drivers.mailbox import Mailbox
from drivers.states import StateWatch
from drivers.wire import WireImage
from drivers.words import INIT, OP, SAFEOP, ERROR

_LOCK_S, _OP_S = 10.0, 5.0
_FIRST_FRAMES = 10  # with safe outputs, before OP is asked for
_CLOSING_CYCLES = 50  # with safe outputs, at most, until the drive says that it is off
_LOCK_STEP_TIMEOUT_S = 2.0
_POWERED = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION)


class EthercatBackend:
    """A Backend on a network interface (a name, or None for the only candidate).

    ``lock_step``: no pace, no clocks; exchanges as fast as the bus answers, stamps and times as the simulation gives
    them, for a bus whose plant moves once per frame. ``events`` are (kind, text, data) for the log; ``drive_off`` is
    what the drive said of itself at the end (None: nobody heard it).
    """

    def __init__(self, rig: Rig, interface: str | None = None, lock_step: bool = False):
        self.period_s = rig.period_s
        self.events: list[tuple[str, str, dict]] = []
        self.drive_off: bool | None = None
        self.clock: ReferenceClock | None = None
        self._rig, self._wanted, self._lock_step = rig, interface, lock_step
        self._period_ns = round(rig.period_s * 1e9)
        self._wire = WireImage(rig)
        self._safe = bytes(self._wire.output_size)  # de-energised is zero, which the rig check holds
        self._edges = Edges(self._period_ns)
        self._every = max(1, round(rig.master.states_every / rig.period_s))
        self._allowed = rig.safety.lost_cycles
        self._status_byte = next((p.byte for p in image_of(rig, outputs=False).places.values() if p.entry.name == "status_word"), None)
        self._bus: Bus | None = None
        self._watch: StateWatch | None = None
        self._mailboxes: dict[int, Mailbox] = {}
        self._inputs = bytes(self._wire.input_size)
        self._cycle, self._bad, self._lost, self._epoch_ns = -1, 0, 0, 0

    @property
    def expected_working_counter(self) -> int:
        """What every frame must bring back, from the rig file alone."""
        return self._wire.working_counter

    def open(self) -> None:
        """Takes the bus from whatever state to OP with safe outputs. Raises BackendError: one sentence, slave and cause."""
        if self._bus is not None:
            raise BackendError("found an open bus, expected a closed one")
        interface = choose(self._wanted)
        self._bus = Bus(interface, _LOCK_STEP_TIMEOUT_S if self._lock_step else frame_timeout_s(self._rig))
        try:
            identify(self._bus, self._rig)
            synchronise = not self._lock_step and self._rig.master.clock == "distributed"
            self._mailboxes, has_clock, notes = configure(self._bus, self._rig, self._wire, synchronise)
            self.events += [("bus", note, {}) for note in notes]
            self.clock = ReferenceClock(self._period_ns) if has_clock else None
            self._to_op()
        except BaseException:
            self.close()
            raise
        self._watch = StateWatch(self._bus, self._rig, self._wire, self._mailboxes, self.events)
        self._edges.mark()
        self.events.append(("bus", f"{len(self._rig.slaves)} slaves in OP on {interface}, working counter {self._wire.working_counter}", {}))

    def exchange(self, outputs_raw: bytes) -> Exchange:
        """Raises BackendError where it is not open, the image has the wrong size, or the bus is lost, naming the slave."""
        if self._watch is None or len(outputs_raw) != len(self._safe):
            found = f"{len(outputs_raw)} bytes" if self._watch is not None else "a closed backend"
            raise BackendError(f"found {found}, expected an open backend and {len(self._safe)} bytes of outputs")
        self._cycle += 1
        busy_ns = self._edges.busy_ns()
        if self._cycle % self._every == 0 or self._bad > 1 or self._watch.is_busy:
            self._watch.look()  # before the edge: it costs time that the cycle has left, not latency
        ok, edge_ns, lateness_ns = self._turn(outputs_raw)
        self._judge(ok)
        self._edges.mark()
        if self._lock_step:
            return Exchange(self._cycle, (self._cycle + 1) * self._period_ns, self._inputs, ok, 0, 0)
        return Exchange(self._cycle, self._epoch_ns + edge_ns, self._inputs, ok, lateness_ns, busy_ns)

    def close(self) -> None:
        """Safe outputs until the drive is off, then SAFEOP and INIT. Never raises; may be called twice and before open."""
        bus, self._bus, self._watch = self._bus, None, None
        if bus is None:
            return
        try:
            self._go_safe(bus)
        except Exception as error:  # nothing may keep the socket open
            self.events.append(("bus", f"closing: {type(error).__name__} {error}", {}))
        finally:
            bus.close()

    def _turn(self, outputs_raw: bytes) -> tuple[bool, int, int]:
        """One cycle: edge, frame, clock. Inputs of a frame that did not count in full are not believed."""
        edge_ns, lateness_ns = (0, 0) if self._lock_step else self._edges.wait()
        counter, inputs_raw = self._bus.swap(outputs_raw)
        ok = counter == self._wire.working_counter
        self._lost = self._lost + 1 if counter == LOST else 0
        if ok and self.clock is not None:
            dc_time_ns = self._bus.master.dc_time
            ok = self.clock.is_new(dc_time_ns)
            if ok:
                bus = self._bus
                self._edges.steer(self.clock.step(dc_time_ns, bus.sent_ns - edge_ns, bus.round_trip_ns))
        if ok:
            self._inputs = inputs_raw
        return ok, edge_ns, lateness_ns

    def _judge(self, ok: bool) -> None:
        self._bad = 0 if ok else self._bad + 1
        if self._lost >= self._allowed:
            raise BackendError(f"no frame came back from {self._bus.interface} in {self._lost} cycles in a row: "
                               f"its cable, its link, or the supply of {self._rig.slaves[0].name}")

    def _to_op(self) -> None:
        """Frames with safe outputs from SAFEOP on, until the clock is locked; then OP, with frames all the while."""
        self._epoch_ns = time.time_ns() - time.monotonic_ns()
        self._edges.start()
        for _ in range(_FIRST_FRAMES):
            self._turn(self._safe)
        if self._lock_step:
            self._bus.ask(OP)
            reached(self._bus.wait_for(OP, _OP_S), OP, self._wire.labels)
            return
        self._lock_clock()
        self._bus.ask(OP)
        cycles = round(_OP_S / self.period_s)
        for cycle in range(cycles):
            self._turn(self._safe)
            if cycle % self._every == 0:
                states = self._bus.states()
                if all(s.state == OP for s in states) or any(s.state & ERROR for s in states):
                    break
        reached(self._bus.states(), OP, self._wire.labels)

    def _lock_clock(self) -> None:
        if self.clock is None:
            return
        for cycle in range(round(_LOCK_S / self.period_s)):
            self._turn(self._safe)
            if self.clock.locked:
                self.events.append(("bus", f"locked to the reference clock after {cycle + 1} cycles", {}))
                return
        raise BackendError(f"the cycle did not lock to the bus's reference clock within {_LOCK_S:g} s: it stands "
                           f"{self.clock.offset_ns / 1e3:.0f} us off")

    def _go_safe(self, bus: Bus) -> None:
        self._bus = bus
        try:
            if self._wire_is_up(bus):
                for _ in range(_CLOSING_CYCLES):
                    ok, _edge, _late = self._turn(self._safe)
                    self.drive_off = not self._powered() if ok else None
                    if self._lost >= self._allowed or self.drive_off:
                        break
                self._turn(self._safe)
                bus.ask(SAFEOP)
                stop_clocks(bus, self._rig)
                self._collect_emergencies(bus)
        finally:
            self._bus = None
            bus.ask(INIT)

    def _wire_is_up(self, bus: Bus) -> bool:
        return bus._wire is not None

    def _powered(self) -> bool:
        if self._status_byte is None:
            return False
        return decode(int.from_bytes(self._inputs[self._status_byte: self._status_byte + 2], "little")) in _POWERED

    def _collect_emergencies(self, bus: Bus) -> None:
        """What the slaves said of themselves while nobody asked; mailboxes are never polled in the cycle."""
        for index, mailbox in self._mailboxes.items():
            for _ in range(8):
                if bus.slaves[index].mbx_receive() <= 0:
                    break
            self.events += [("emergency", text, {}) for text in mailbox.emergencies]
            mailbox.emergencies.clear()


def frame_timeout_s(rig: Rig) -> float:
    """When a frame counts as lost: as the rig file says, or so that the allowed number of them fits into the reaction time."""
    if rig.master.frame_timeout is not None:
        return rig.master.frame_timeout
    return max(rig.period_s, rig.safety.reaction / (rig.safety.lost_cycles + 1))
