"""Ctrl-C while the program itself is still being loaded: one line, and nothing to clean up.

It imports next to nothing, so that this holds from as early on as can be. What the interpreter
does before it reaches this package answers by itself.
"""

import os
import signal
import sys
from types import FrameType

_STOPPED = 130  # exits.STOPPED, without loading it


def take_interrupts() -> None:
    """Until ``release_interrupts`` Ctrl-C ends the process with one line. One that whoever started
    it wants ignored stays ignored.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)


def release_interrupts() -> None:
    """From here on Ctrl-C is a KeyboardInterrupt again, for whoever has something to end."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def end_at_interrupts() -> None:
    """From here on Ctrl-C ends the process without a word: all is said, and what is left is to wait
    for what is ending.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)


def _end(_number: int, _frame: FrameType | None) -> None:
    verb = sys.argv[1] if len(sys.argv) > 1 and sys.argv[1].isalpha() else ""
    os.write(2, f"{f'epa {verb}'.rstrip()}: interrupted\n".encode())
    os._exit(_STOPPED)
