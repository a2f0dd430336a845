"""What slaves tell of themselves beside the process data, while the bus runs: emergencies, and how
far each clock stands from the reference clock. One datagram or two at a time, ten times a second.

Sources: ETG.1000.4 (0x092C system time difference, 0x0805 + 8n sync manager status), ETG.1000.6
(emergencies), ETG.1020 (0x1C32, synchronisation of outputs).
"""

from collections.abc import Callable

import pysoem

from drivers.bus import Bus
from drivers.mailbox import Mailbox
from epa_rt.backend import BackendError

EVERY_S = 0.1
FAR_NS = 10_000  # said at once: a hundredth of a cycle at 1 kHz
_TIME_DIFFERENCE = 0x092C
_MAILBOX_STATUS, _IS_FULL = 0x080D, 0x08  # of the sync manager that slaves send through
_MOST_EMERGENCIES = 8
_MISSED, _TOO_SHORT, _SYNC_ERROR = 0x0B, 0x0C, 0x20  # of 0x1C32

Events = list[tuple[str, str, dict[str, object]]]


class Diagnosis:
    """``step`` does one thing of its round. Where a slave does not answer, the look at the states
    says so; here nothing is raised. ``clocks``: slaves with a distributed clock, by index.
    """

    def __init__(
        self,
        bus: Bus,
        mailboxes: dict[int, Mailbox],
        clocks: list[int],
        labels: tuple[str, ...],
        events: Events,
    ):
        self._bus, self._mailboxes, self._labels, self._events = bus, mailboxes, labels, events
        self._clocks = {index: _Clock(labels[index]) for index in clocks}
        self._round: list[Callable[[], None]] = [
            *(lambda index=index: self._listen(index) for index in mailboxes),
            *(lambda index=index: self._compare(index) for index in clocks),
        ]
        self._next = 0

    def step(self) -> None:
        """At most one question about one slave."""
        if not self._round:
            return
        ask, self._next = self._round[self._next], (self._next + 1) % len(self._round)
        try:
            ask()
        except (pysoem.WkcError, pysoem.PacketError):
            pass  # the states tell who is gone

    def finish(self) -> None:
        """Everything once more, with what a drive says of its synchronisation; SDOs are used here,
        so not while targets are live.
        """
        for _ in self._round:
            self.step()
        for clock in self._clocks.values():
            if clock.count:
                self._events.append(("clock", clock.words(), clock.data()))
        for index in self._clocks:
            if index in self._mailboxes:
                self._synchronisation(self._mailboxes[index])

    def _listen(self, index: int) -> None:
        slave = self._bus.slaves[index]
        for _ in range(_MOST_EMERGENCIES):
            if not slave._fprd(_MAILBOX_STATUS, 1)[0] & _IS_FULL or slave.mbx_receive() <= 0:
                break
        self.pass_on(index)

    def pass_on(self, index: int) -> None:
        """What has gathered of a slave's emergencies, as events."""
        mailbox = self._mailboxes[index]
        self._events += [("emergency", text, data) for text, data in mailbox.emergencies]
        mailbox.emergencies.clear()

    def _compare(self, index: int) -> None:
        clock = self._clocks[index]
        raw = int.from_bytes(self._bus.slaves[index]._fprd(_TIME_DIFFERENCE, 4), "little")
        if clock.is_far_now(difference_ns(raw)):
            self._events.append(("clock", clock.words(), clock.data()))

    def _synchronisation(self, mailbox: Mailbox) -> None:
        try:
            missed, short, wrong = (
                mailbox.number_if_there(0x1C32, at) for at in (_MISSED, _TOO_SHORT, _SYNC_ERROR)
            )
        except BackendError:
            return
        if missed or short or wrong:
            self._events.append(
                (
                    "clock",
                    f"{mailbox.label} counted {missed or 0} missed and {short or 0} too short"
                    f" cycles{', and says that it is not synchronous' if wrong else ''} (0x1C32)",
                    {
                        "missed": missed or 0,
                        "too_short": short or 0,
                        "not_synchronous": bool(wrong),
                    },
                )
            )


class _Clock:
    """Readings of one slave's clock against the reference, in ns."""

    def __init__(self, label: str):
        self.label = label
        self.count = self.last_ns = self.worst_ns = 0
        self._was_far = False

    def is_far_now(self, difference: int) -> bool:
        """Takes one reading; True the first time that it is far off."""
        self.count, self.last_ns = self.count + 1, difference
        if abs(difference) > abs(self.worst_ns):
            self.worst_ns = difference
        was_far, self._was_far = self._was_far, abs(difference) > FAR_NS
        return self._was_far and not was_far

    def words(self) -> str:
        return (
            f"the clock of {self.label} stands {self.last_ns} ns from the reference clock, at worst"
            f" {self.worst_ns} ns in {self.count} readings (0x092C)"
        )

    def data(self) -> dict[str, object]:
        return {"last_ns": self.last_ns, "worst_ns": self.worst_ns, "readings": self.count}


def difference_ns(raw: int) -> int:
    """0x092C: the size in 31 bits, and a sign bit."""
    size = raw & 0x7FFFFFFF
    return -size if raw >> 31 else size
