"""The slaves' states while the bus runs: read at a lower rate than the cycle, every drop named,
terminals taken back.

A slave that falls to SAFEOP still counts in the working counter, so the counter alone would miss
it.
"""

from collections.abc import Iterator

import pysoem

from drivers.bring_up import set_up_again
from drivers.bus import Bus, State
from drivers.diagnosis import Events
from drivers.mailbox import Mailbox
from drivers.recovery import Shape, take_back
from drivers.wire import WireImage
from drivers.words import OP
from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig

GIVE_UP_S = 2.0


class StateWatch:
    """``look`` reads all states and either finds all well, takes a recovery one step on, or raises
    BackendError.

    ``events`` are (kind, text, data) for the log. Look in every cycle while ``is_busy``.
    """

    def __init__(
        self, bus: Bus, rig: Rig, wire: WireImage, mailboxes: dict[int, Mailbox], events: Events
    ):
        self._bus, self._rig, self._wire, self._mailboxes, self._events = (
            bus,
            rig,
            wire,
            mailboxes,
            events,
        )
        self._recoveries: dict[int, Iterator[None]] = {}
        self._looks: dict[int, int] = {}
        self._most_looks = round(GIVE_UP_S / rig.period_s)
        self._may_recover = rig.master.recovery == "continue"
        moves = _move_the_drive(rig)
        self._shapes = {
            i: Shape(bus.slaves[i], wire.labels[i])
            for i, slave in enumerate(rig.slaves)
            if self._may_recover and slave.name not in moves
        }

    @property
    def is_busy(self) -> bool:
        """True while a terminal is being taken back."""
        return bool(self._looks)

    def look(self) -> bool:
        """True where every slave is in OP. Raises BackendError naming the slave that left it,
        unless it is taken back.
        """
        states = self._bus.states()
        if len({state.state for state in states} | {OP}) > 1 and any(
            state.state for state in states
        ):
            states = self._twice(states)
        if all(state.state == OP for state in states):
            for index in self._looks:
                self._events.append(
                    ("recovery", f"{self._wire.labels[index]} is in OP again", {"slave": index + 1})
                )
            self._recoveries.clear()
            self._looks.clear()
            return True
        if any(
            state.state for state in states
        ):  # none at all: frames are being lost, which the cycle sees by itself
            for index, state in enumerate(states):
                if state.state != OP:
                    self._take_back(index, state)
        return False

    def _twice(self, states: list[State]) -> list[State]:
        """A state counts once it has been read a second time: SOEM knows an answer by its index
        alone, of sixteen, and a late one may carry that of a question that came after it.
        """
        return [
            first if first.state == OP else second
            for first, second in zip(states, self._bus.states(), strict=True)
        ]

    def trouble(self, index: int, state: State) -> str:
        """What happened to a slave, in one sentence."""
        name = self._wire.labels[index]
        if state.state == 0:
            before = (
                f"the cable behind {self._rig.slaves[index - 1].name}"
                if index
                else "the first cable"
            )
            return f"{name} does not answer any more: its supply, or {before}"
        return f"{name} left OP: it is in {state.words()}"

    def _on_wires(self, index: int) -> str:
        return (
            ""
            if self._rig.slaves[index].device == "EPOS4"
            else ", whose enable or target comes from there,"
        )

    def _take_back(self, index: int, state: State) -> None:
        text = self.trouble(index, state)
        if not self._may_recover:
            raise BackendError(text)
        if index not in self._shapes:
            raise BackendError(
                f"{text}; a drive{self._on_wires(index)} is not taken back within a run, it has to"
                " be enabled from scratch"
            )
        looks = self._looks[index] = self._looks.get(index, -1) + 1
        if looks == 0:
            self._events.append(
                (
                    "recovery",
                    text,
                    {"slave": index + 1, "state": state.state, "al_status": state.al_status},
                )
            )
        if looks > self._most_looks:
            raise BackendError(f"{text}; it could not be taken back within {GIVE_UP_S:g} s")
        if index not in self._recoveries:
            steps = set_up_again(self._bus, self._rig, index, self._mailboxes.get(index))
            self._recoveries[index] = take_back(self._bus.slaves[index], self._shapes[index], steps)
        try:
            next(self._recoveries[index], None)
        except pysoem.WkcError:  # gone again: from the beginning
            del self._recoveries[index]


def _move_the_drive(rig: Rig) -> set[str]:
    """The drive, and where it hangs on wires the terminals that carry its enable and its targets:
    back in OP they would give it both at once, unasked.
    """
    names = {slave.name for slave in rig.slaves if slave.device == "EPOS4"}
    if rig.drive.interface == "analog":
        rows = (
            rig.drive.enable,
            rig.motor.position_target,
            rig.motor.speed_target,
            rig.motor.torque_target,
        )
        names |= {rig.row(name).entry.split(".")[0] for name in rows if name}
    return names
