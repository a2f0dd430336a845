"""One cycle of a bus: edge, frame, clock. The same turn serves bring-up, run and closing."""

import time

from drivers.bring_up import reached
from drivers.bus import LOST, Bus
from drivers.clock import Edges, ReferenceClock
from drivers.wire import WireImage
from drivers.words import ERROR, OP
from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig

_LOCK_S, _OP_S = 10.0, 5.0
_FIRST_FRAMES = 10  # with safe outputs, before OP is asked for


class Cycle:
    """``turn`` is one exchange of process data. ``inputs`` are the last that came in full, ``seen``
    the last at all; ``lost`` frames in a row stayed away. Without ``paced`` turns follow each other
    as fast as the bus answers. ``heard_ns`` (monotonic clock) is just before the last frame that is
    known to have reached the slaves.
    """

    def __init__(self, bus: Bus, rig: Rig, wire: WireImage, paced: bool, has_clock: bool):
        period_ns = round(rig.period_s * 1e9)
        self.bus, self.edges = bus, Edges(period_ns)
        self.clock = ReferenceClock(period_ns) if has_clock else None
        self.inputs = self.seen = bytes(wire.input_size)
        self.lost = 0
        self.safe = bytes(wire.output_size)  # de-energised is zero, which the rig check holds
        self._wire, self._paced, self._period_s = wire, paced, rig.period_s
        self._every = max(1, round(rig.master.states_every / rig.period_s))
        self._watchdog_ns = round(rig.safety.watchdog * 1e9)
        self._recovers = rig.master.recovery == "continue"
        self._first = rig.slaves[0].name
        self.heard_ns = time.monotonic_ns()
        self._epoch_ns = time.time_ns() - self.heard_ns
        self.edges.start()

    def turn(self, outputs_raw: bytes, live: bool = False) -> tuple[bool, int, int]:
        """Whether the frame came back counted in full, its edge (ns since 1970), and how late after
        it the frame went out, in ns.

        Inputs of a frame that did not are not believed: the overlapping map shows our own outputs
        in the place of a slave that is not there. ``live`` outputs move something: where the slaves
        have dropped theirs meanwhile BackendError is raised and nothing is sent, for the next frame
        would give all of it back at once.
        """
        bus, clock = self.bus, self.clock
        edge_ns, lateness_ns = self.edges.wait() if self._paced else (0, 0)
        now_ns = time.monotonic_ns()
        if live and self._paced and now_ns - self.heard_ns > self._watchdog_ns:
            raise BackendError(self._silence(now_ns - self.heard_ns, lateness_ns))
        counter, self.seen = bus.swap(outputs_raw)
        if self._paced:
            lateness_ns = max(lateness_ns, bus.sent_ns - edge_ns)
        ok = counter == self._wire.working_counter
        self.lost = self.lost + 1 if counter == LOST else 0
        if ok and clock is not None:
            dc_time_ns = bus.master.dc_time
            ok = clock.is_new(dc_time_ns)
            if ok:
                self.edges.steer(clock.step(dc_time_ns, bus.sent_ns - edge_ns, bus.round_trip_ns))
        if ok:
            self.inputs = self.seen
        if (
            ok or self._recovers and counter > 0
        ):  # a terminal that is being taken back does not count; the others hear all the same
            self.heard_ns = now_ns
        return ok, self._epoch_ns + edge_ns, lateness_ns

    def no_frame(self) -> str:
        """A sentence on the frames that stayed away."""
        return (
            f"no frame came back from {self.bus.interface} in {self.lost} cycles in a row: its"
            f" cable, its link, or the supply of {self._first}"
        )

    def _silence(self, silent_ns: int, lateness_ns: int) -> str:
        why = f"; {self.no_frame()}" if self.lost else ""
        if 2 * lateness_ns > silent_ns:  # most of it
            why += f"; this machine let the loop stand still for {lateness_ns / 1e6:.1f} ms of it"
        return (
            f"no process data reached the slaves for {silent_ns / 1e6:.1f} ms, longer than their"
            f" watchdog of {self._watchdog_ns / 1e6:g} ms: they have dropped their outputs{why}"
        )

    def to_op(self) -> list[str]:
        """From SAFEOP: safe outputs until the clock is locked, then OP with frames all the while.
        Gives what to log.

        Raises BackendError: which slave refused and why, or how far off the clock stayed.
        """
        for _ in range(_FIRST_FRAMES):
            self.turn(self.safe)
        notes = self._lock(self.clock) if self.clock is not None else []
        self.bus.ask(OP)
        if (
            not self._paced
        ):  # a frame moves the plant of a bus in lock step: none may go out on the way
            reached(self.bus.wait_for(OP, _OP_S), OP, self._wire.labels)
            return notes
        for turn in range(round(_OP_S / self._period_s)):
            self.turn(self.safe)
            if turn % self._every == 0:
                states = self.bus.states()
                if all(s.state == OP for s in states) or any(s.state & ERROR for s in states):
                    break
        reached(self.bus.states(), OP, self._wire.labels)
        return notes

    def _lock(self, clock: ReferenceClock) -> list[str]:
        for turn in range(round(_LOCK_S / self._period_s)):
            self.turn(self.safe)
            if clock.locked:
                return [f"locked to the reference clock after {turn + 1} cycles"]
        raise BackendError(
            f"the cycle did not lock to the bus's reference clock within {_LOCK_S:g} s: it stands "
            f"{clock.offset_ns / 1e3:.0f} us off"
        )
