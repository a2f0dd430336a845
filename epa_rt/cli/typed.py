"""What is typed on the operator's terminal, looked at within the loop without ever waiting."""

import os
import sys
from collections.abc import Callable

READ_S = 0.02  # a key waits for this long at most
MOST_BYTES = 256  # of one look


class Typed:
    """``read`` once per cycle. ``gone``: told once, in words, where the terminal cannot be read any
    more, for then nobody holds the rig.
    """

    def __init__(self, period_s: float, gone: Callable[[str], None]):
        self._every = max(1, round(READ_S / period_s))
        self._from, self._is_gone, self._gone = sys.stdin.fileno(), False, gone

    def read(self, cycle: int) -> bytes:
        """What was typed since the last look; nothing between two looks."""
        if cycle % self._every:
            return b""
        try:
            return os.read(self._from, MOST_BYTES)
        except OSError:
            if not self._is_gone:  # once: it must not count as the operator's second stop
                self._gone("the terminal is gone")
            self._is_gone = True
            return b""
