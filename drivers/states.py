"""The slaves' states while the bus runs: read at a lower rate than the cycle, every drop named, terminals taken back.

A slave that falls to SAFEOP still counts in the working counter, so the counter alone would miss it.
"""

import pysoem

from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig

from drivers.bring_up import set_up_slave
from drivers.bus import Bus, State
from drivers.mailbox import Mailbox
from drivers.wire import WireImage
from drivers.words import ERROR, OP, SAFEOP

GIVE_UP_S = 2.0
_ACKNOWLEDGE = 0x10  # pysoem.STATE_ACK
_RECOVER_US = 500


class StateWatch:
    """``look`` reads all states and either finds all well, takes a recovery one step on, or raises BackendError.

    ``events`` are (kind, text, data) for the log.
    """

    def __init__(self, bus: Bus, rig: Rig, wire: WireImage, mailboxes: dict[int, Mailbox], events: list[tuple[str, str, dict]]):
        self._bus, self._rig, self._wire, self._mailboxes, self._events = bus, rig, wire, mailboxes, events
        self._recovering: dict[int, int] = {}
        self._most_looks = max(1, round(GIVE_UP_S / rig.master.states_every))
        self._failure: BackendError | None = None

    def look(self) -> bool:
        """True where every slave is in OP. Raises BackendError naming the slave that left it, unless it is taken back."""
        states = self._bus.states()
        if all(state.state == OP for state in states):
            for index in self._recovering:
                self._events.append(("recovery", f"{self._wire.labels[index]} is in OP again", {"slave": index + 1}))
            self._recovering.clear()
            return True
        if any(state.state for state in states):  # none at all: frames are being lost, which the cycle sees by itself
            for index, state in enumerate(states):
                if state.state != OP:
                    self._take_back(index, state)
        return False

    def trouble(self, index: int, state: State) -> str:
        """What happened to a slave, in one sentence."""
        name = self._wire.labels[index]
        if state.state == 0:
            before = f"the cable behind {self._rig.slaves[index - 1].name}" if index else "the first cable"
            return f"{name} does not answer any more: its supply, or {before}"
        return f"{name} left OP: it is in {state.words()}"

    def _take_back(self, index: int, state: State) -> None:
        slave = self._rig.slaves[index]
        text = self.trouble(index, state)
        if self._rig.master.recovery == "stop":
            raise BackendError(text)
        if slave.device == "EPOS4":
            raise BackendError(f"{text}; a drive is not taken back within a run, it has to be enabled from scratch")
        looks = self._recovering[index] = self._recovering.get(index, -1) + 1
        if looks == 0:
            self._events.append(("recovery", text, {"slave": index + 1, "state": state.state, "al_status": state.al_status}))
        if looks > self._most_looks:
            raise BackendError(f"{text}; it could not be taken back within {GIVE_UP_S:g} s")
        self._step(self._bus.slaves[index], index, state.state)

    def _step(self, slave: "pysoem.CdefSlave", index: int, state: int) -> None:
        """One datagram for a slave in SAFEOP; a slave below it is set up again, which takes a few cycles."""
        if state == SAFEOP | ERROR:
            slave.state = SAFEOP | _ACKNOWLEDGE
            slave.write_state()
        elif state == SAFEOP:
            slave.state = OP
            slave.write_state()
        elif state == 0:
            slave.recover(_RECOVER_US)
        else:
            slave.setup_func = lambda _slave: self._set_up_again(index)
            slave.reconfig(_RECOVER_US)
            slave.setup_func = None
            if self._failure is not None:
                raise self._failure

    def _set_up_again(self, index: int) -> None:
        """Called by ``reconfig`` in PREOP, which itself restores only sync managers and FMMUs."""
        try:
            set_up_slave(self._bus, self._rig, index, self._mailboxes.get(index))
        except BackendError as error:  # must not pass through the C code
            self._failure = error
