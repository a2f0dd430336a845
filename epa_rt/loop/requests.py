"""What comes into a run from outside the bus: the operator's stop, recorded in every sample, so
that replay has it, and marks, which are events of the log.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from epa_rt.realtime.screen import Notice
from epa_rt.realtime.signal_sets import OPERATOR_STOPS, caught

NONE, STOP, STOP_AT_ONCE = 0, 1, 2

LoggedEvent = tuple[str, str, dict[str, object]]  # kind, text, data


AGAIN_S = (
    0.3  # a wrapper may pass one Ctrl-C on twice at once; only a later one is meant as a second
)

STOPPING = "{name}: stopping; again after 0.3 s: power off at once"
NOT_SUSPENDED = "Ctrl-Z is refused while a run is on: a frozen loop leaves the rig in motion"


class OperatorRequests:
    """Ctrl-C, Ctrl-\\, SIGTERM or SIGHUP once: brake and stop. Again, at least AGAIN_S later:
    torque off at once. What comes before is dropped. SIGXCPU and SIGPWR stop and never escalate.

    ``period_s`` turns that time into cycles, which a replay knows too. ``log``: where `say` puts
    its events; the list that the loop drains.
    """

    def __init__(self, period_s: float = 0.001) -> None:
        self._again_cycles = max(1, round(AGAIN_S / period_s))
        self._level, self._since, self._pending = NONE, 0, False
        self._stop_asked = self._at_once_asked = False
        self._said: list[LoggedEvent] = []
        self.log: list[LoggedEvent] = []
        self.last_signal = ""

    def poll(self, cycle: int) -> int:
        """The request that holds in this cycle: NONE, STOP or STOP_AT_ONCE."""
        if self._pending:
            self._pending = False
            self._take_up(cycle)
        return self._level

    def ask(self, name: str = "operator") -> None:
        """A request to stop; taken up by the next poll."""
        self._stop_asked = self._pending = True
        self.last_signal = name

    @property
    def is_stopping(self) -> bool:
        """Whether a stop has been asked for already."""
        return self._level != NONE or self._stop_asked or self._at_once_asked

    def ask_at_once(self, name: str) -> None:
        """A request for power off at once, without a first one; taken up by the next poll."""
        self._at_once_asked = self._pending = True
        self.last_signal = name

    def say(self, kind: str, text: str, **data: object) -> None:
        """An event for the log, at the cycle of the next poll."""
        self._said.append((kind, text, data))
        self._pending = True

    def _take_up(self, cycle: int) -> None:
        """What signal handlers left since the last poll; one may come between any two lines."""
        if self._at_once_asked:
            self._level = STOP_AT_ONCE
        elif self._stop_asked:
            self._stop_asked = False
            if self._level == NONE:
                self._level, self._since = STOP, cycle
            elif cycle - self._since >= self._again_cycles:
                self._level = STOP_AT_ONCE
        said, self._said = self._said, []
        self.log += said

    @contextmanager
    def listening(self, notice: Notice | None = None) -> Iterator["OperatorRequests"]:
        """Catches what would end or freeze the process while inside (epa_rt.realtime.signal_sets);
        puts the former handlers back after. ``notice``: where the operator is told of it.
        """
        notice = notice or Notice()

        def stop(number: int, _frame: FrameType | None) -> None:
            name = signal.Signals(number).name
            is_first = self._level == NONE and not self._stop_asked
            if is_first:
                notice.say(STOPPING.format(name=name))
            if is_first or number in OPERATOR_STOPS:
                self.ask(name)

        def suspend(number: int, _frame: FrameType | None) -> None:
            notice.say(NOT_SUSPENDED)

        try:
            with caught(stop, suspend):
                yield self
        finally:
            notice.close()
