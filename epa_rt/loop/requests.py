"""What comes into a run from outside the bus: the operator's stop. Recorded in every sample, so
that replay has it.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NONE, STOP, STOP_AT_ONCE = 0, 1, 2


AGAIN_S = (
    0.3  # a wrapper may pass one Ctrl-C on twice at once; only a later one is meant as a second
)


class OperatorRequests:
    """Ctrl-C or SIGTERM once: brake and stop. Again, at least AGAIN_S later: torque off at once.

    ``period_s`` turns that time into cycles, which a replay knows too.
    """

    def __init__(self, period_s: float = 0.001) -> None:
        self._again_cycles = max(1, round(AGAIN_S / period_s))
        self._level, self._since, self._pending = NONE, 0, False
        self.last_signal = ""

    def poll(self, cycle: int) -> int:
        """The request that holds in this cycle: NONE, STOP or STOP_AT_ONCE."""
        if self._pending:
            self._pending = False
            if self._level == NONE:
                self._level, self._since = STOP, cycle
            elif cycle - self._since >= self._again_cycles:
                self._level = STOP_AT_ONCE
        return self._level

    def ask(self, name: str = "operator") -> None:
        """A request to stop; taken up by the next poll."""
        self._pending = True
        self.last_signal = name

    @contextmanager
    def listening(self) -> Iterator["OperatorRequests"]:
        """Catches SIGINT, SIGTERM and SIGHUP while inside; puts the former handlers back after."""

        def catch(number: int, _frame: FrameType | None) -> None:
            self.ask(signal.Signals(number).name)

        numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        before = {number: signal.signal(number, catch) for number in numbers}
        try:
            yield self
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
