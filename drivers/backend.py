"""EtherCAT as a backend: pysoem in front of real slaves, or of emulated ones. It does not know
which.
"""

from drivers.bring_up import Unclear, configure, driven, identify, stop_clocks
from drivers.bus import Bus
from drivers.claim import Claim
from drivers.cycle import Cycle
from drivers.diagnosis import EVERY_S, Diagnosis, Events
from drivers.interface import choose
from drivers.mailbox import Mailbox
from drivers.other_master import expect_no_master
from drivers.states import StateWatch
from drivers.wire import WireImage
from drivers.words import INIT, OP, SAFEOP
from epa_rt.backend import BackendError, Exchange
from epa_rt.config.rig import Rig
from epa_rt.config.rig_homing import HomingOptions
from epa_rt.control.cia402 import OFF, decode
from epa_rt.safety.bus_budget import BusBudget, frame_timeout_s
from epa_rt.signals.image import image_of

_CLOSING_CYCLES = 50  # with safe outputs, at most, until the drive says that it is off
# no time of the plant: longer than a busy machine keeps the emulated bus from its first answer
_LOCK_STEP_TIMEOUT_S = 10.0
_TRIES = 3


class EthercatBackend:
    """A Backend on a network interface (a name, or None for the only candidate).

    ``lock_step``: no pace, no clocks; exchanges as fast as the bus answers, stamps and times as the
    simulation gives them, for a bus whose plant moves once per frame. ``events`` are (kind, text,
    data) for the log; ``drive_off`` is what the drive said of itself at the end (None: nobody heard
    it). ``take_over``: opens a bus that another master seems to drive. ``homing``: what the drive's
    own homing is set to; None: to one that moves nothing.
    """

    def __init__(
        self,
        rig: Rig,
        interface: str | None = None,
        lock_step: bool = False,
        take_over: bool = False,
        homing: HomingOptions | None = None,
    ):
        self.period_s = rig.period_s
        self.events: Events = []
        self.drive_off: bool | None = None
        self.cycle: Cycle | None = None
        self._rig, self._wanted, self._lock_step = rig, interface, lock_step
        self._take_over, self._homing = take_over, homing
        self._claim: Claim | None = None
        self._period_ns = round(rig.period_s * 1e9)
        self._wire = WireImage(rig)
        self._every = max(1, round(rig.master.states_every / rig.period_s))
        self._allowed = rig.safety.lost_cycles
        self._status = next(
            (
                p
                for p in image_of(rig, outputs=False).places.values()
                if p.entry.name == "status_word"
            ),
            None,
        )
        self._bus: Bus | None = None
        self._watch: StateWatch | None = None
        self._diagnosis: Diagnosis | None = None
        self._diagnose_every = max(1, round(EVERY_S / rig.period_s))
        self._mailboxes: dict[int, Mailbox] = {}
        self._number, self._bad = -1, 0

    @property
    def expected_working_counter(self) -> int:
        """What every frame must bring back, from the rig file alone."""
        return self._wire.working_counter

    def open(self) -> None:
        """Takes the bus from whatever state to OP with safe outputs. Raises BackendError: one
        sentence, slave and cause.
        """
        if self._bus is not None:
            raise BackendError("found an open bus, expected a closed one")
        interface = choose(self._wanted, self._lock_step)
        waits_s = (
            (_LOCK_STEP_TIMEOUT_S, _LOCK_STEP_TIMEOUT_S)
            if self._lock_step
            else (frame_timeout_s(self._rig), answer_s(self._rig))
        )
        self._claim = Claim(interface)
        try:
            if not self._lock_step:  # a bus without time has no watchdog that tells who is dead
                expect_no_master(interface, self._rig.safety.watchdog, self._take_over)
            bus = self._bus = Bus(interface, *waits_s)
            has_clock, notes = self._configure_insisting(bus)
            self.cycle = Cycle(bus, self._rig, self._wire, not self._lock_step, has_clock)
            notes += [*slow_to_notice(self._rig), *self.cycle.to_op()]
            clocks = [i for i, _ in driven(self._rig)] if has_clock else []
            self._diagnosis = Diagnosis(
                bus, self._mailboxes, clocks, self._wire.labels, self.events
            )
            self._watch = StateWatch(bus, self._rig, self._wire, self._mailboxes, self.events)
        except BaseException:
            self.close()
            raise
        notes.append(
            f"{len(self._rig.slaves)} slaves in OP on {interface}, working counter"
            f" {self._wire.working_counter}"
        )
        self.events += [("bus", note, {}) for note in notes]
        self._number, self._bad = -1, 0
        self.cycle.edges.mark()

    def _configure(self, bus: Bus) -> tuple[bool, list[str]]:
        """To SAFEOP. Gives whether there is a reference clock, and notes for the log."""
        identify(bus, self._rig)
        synchronise = not self._lock_step and self._rig.master.clock == "distributed"
        self._mailboxes, has_clock, notes = configure(
            bus, self._rig, self._wire, synchronise, self._homing
        )
        return has_clock, notes

    def _configure_insisting(self, bus: Bus) -> tuple[bool, list[str]]:
        """The same, from the beginning again where answers got lost on the way."""
        for _ in range(_TRIES - 1):
            try:
                return self._configure(bus)
            except Unclear:
                pass
        return self._configure(bus)

    def exchange(self, outputs_raw: bytes) -> Exchange:
        """Raises BackendError where it is not open, the image has the wrong size, or the bus is
        lost, naming the slave; and where the slaves have dropped their outputs meanwhile.
        """
        cycle, watch = self.cycle, self._watch
        if cycle is None or watch is None or len(outputs_raw) != self._wire.output_size:
            found = f"{len(outputs_raw)} bytes" if watch is not None else "a closed backend"
            raise BackendError(
                f"found {found}, expected an open backend and {self._wire.output_size} bytes of"
                " outputs"
            )
        self._number += 1
        busy_ns = cycle.edges.busy_ns()
        if self._number % self._every == 0 or self._bad > 1 or watch.is_busy:
            watch.look()  # before the edge: it costs time that the cycle has left, not latency
        if self._number % self._diagnose_every == self._diagnose_every - 1:
            self._diagnose(watch)
        ok, edge_ns, lateness_ns = cycle.turn(outputs_raw, live=True)
        self._bad = 0 if ok else self._bad + 1
        if cycle.lost >= self._allowed:
            raise BackendError(cycle.no_frame())
        cycle.edges.mark()
        if self._lock_step:
            t_ns = (self._number + 1) * self._period_ns
            return Exchange(self._number, t_ns, cycle.inputs, ok, 0, 0, t_ns)
        read_ns = edge_ns + lateness_ns
        return Exchange(self._number, edge_ns, cycle.inputs, ok, lateness_ns, busy_ns, read_ns)

    def _diagnose(self, watch: StateWatch) -> None:
        """One question beside the process data; none while something is wrong, for an answer that
        stays away takes time.
        """
        if self._diagnosis is not None and not self._bad and not watch.is_busy:
            self._diagnosis.step()

    def close(self) -> None:
        """Safe outputs until the drive is off, then SAFEOP and INIT. Never raises; may be called
        twice and before open.
        """
        bus, cycle, claim, diagnosis = self._bus, self.cycle, self._claim, self._diagnosis
        self._bus = self._watch = self.cycle = self._claim = self._diagnosis = None
        if bus is None:
            if claim is not None:
                claim.release()
            return
        try:
            if cycle is not None:
                self._go_safe(bus, cycle, diagnosis)
            bus.ask(INIT)
        except Exception as error:  # nothing may keep the socket open
            self.events.append(("bus", f"closing: {type(error).__name__} {error}", {}))
        finally:
            bus.close()
            if claim is not None:
                claim.release()

    def _go_safe(self, bus: Bus, cycle: Cycle, diagnosis: Diagnosis | None) -> None:
        self.drive_off = None
        for _ in range(_CLOSING_CYCLES):
            ok = cycle.turn(cycle.safe)[0]
            if cycle.lost >= self._allowed:
                break
            if ok or cycle.lost == 0 and self._drive_answers(bus):
                self.drive_off = self._is_off(cycle.seen)
            if self.drive_off or self._status is None:
                break
        cycle.turn(cycle.safe)
        bus.ask(SAFEOP)
        if diagnosis is not None and not cycle.lost:
            diagnosis.finish()
        stop_clocks(bus, self._rig)
        self._collect_emergencies(bus)

    def _drive_answers(self, bus: Bus) -> bool:
        """Where another slave is lost, the drive's own inputs are to be believed only if it is
        there itself.
        """
        index = next(
            (
                i
                for i, slave in enumerate(self._rig.slaves)
                if self._status and slave.name == self._status.slave
            ),
            None,
        )
        return index is not None and bus.states()[index].state & 0x0F in (SAFEOP, OP)

    def _is_off(self, inputs_raw: bytes) -> bool | None:
        if self._status is None:
            return None
        return (
            decode(int.from_bytes(inputs_raw[self._status.byte : self._status.byte + 2], "little"))
            in OFF
        )

    def _collect_emergencies(self, bus: Bus) -> None:
        """What the slaves said of themselves while nobody asked; mailboxes are never polled in the
        cycle.
        """
        for index, mailbox in self._mailboxes.items():
            for _ in range(8):
                if bus.slaves[index].mbx_receive() <= 0:
                    break
            self.events += [("emergency", text, data) for text, data in mailbox.emergencies]
            mailbox.emergencies.clear()


def answer_s(rig: Rig) -> float:
    """How long a step of a recovery waits for a slave's mailbox to be free, and for its answer:
    both fit twice into the reaction time.
    """
    return float(max(1e-3, rig.safety.reaction / 4))


def slow_to_notice(rig: Rig) -> list[str]:
    """A sentence each where the rig file lets the bus be watched more slowly than the rig must
    react.
    """
    safety, master, reaction_ms = rig.safety, rig.master, 1e3 * rig.safety.reaction
    notes = []
    if (lost_s := safety.lost_cycles * frame_timeout_s(rig)) > safety.reaction:
        notes.append(
            f"{safety.lost_cycles} lost frames are noticed after {1e3 * lost_s:g} ms"
            f" (frame_timeout), later than the reaction time of {reaction_ms:g} ms"
        )
    if (two_of_three_s := _two_of_three_s(rig)) > 1.001 * safety.reaction:
        notes.append(
            f"two of three cycles lost are noticed after {1e3 * two_of_three_s:.3g} ms (lost_time,"
            f" lost_share), later than the reaction time of {reaction_ms:g} ms"
        )
    if master.states_every > safety.reaction:
        notes.append(
            f"a slave that left OP is noticed after up to {1e3 * master.states_every:g} ms"
            f" (states_every), later than the reaction time of {reaction_ms:g} ms"
        )
    return notes


def _two_of_three_s(rig: Rig) -> float:
    """When the budget over time is used up where two of three cycles are lost for good."""
    share = float(rig.safety.lost_share)
    if share >= 2.0 / 3.0:
        return float("inf")
    return BusBudget(rig).allowed_s * (1.0 - share) / (2.0 / 3.0 - share)
