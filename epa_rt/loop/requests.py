"""What comes into a run from outside the bus: the operator's stop. Recorded in every sample, so that replay has it."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NONE, STOP, STOP_AT_ONCE = 0, 1, 2


class OperatorRequests:
    """Ctrl-C or SIGTERM once: brake and stop. A second time: torque off at once."""

    def __init__(self) -> None:
        self._level = NONE
        self.last_signal = ""

    def poll(self, cycle: int) -> int:
        """The request that holds in this cycle: NONE, STOP or STOP_AT_ONCE."""
        return self._level

    def ask(self, name: str = "operator") -> None:
        """One more request to stop."""
        self._level = min(self._level + 1, STOP_AT_ONCE)
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
