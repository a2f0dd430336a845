"""Which signals end a run in good order, and which must not end or freeze it.

The default action of all of them ends or freezes the process, and so the rig loses its master in
motion. Left alone are the signals of a broken program (SIGSEGV, SIGABRT and their like), SIGKILL
and SIGSTOP, which nobody can catch: there the drive's own reaction to a silent master applies.
"""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

Handler = Callable[[int, FrameType | None], None]

OPERATOR_STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""Somebody wants the run to end; the second one, some time later, at once."""

MACHINE_STOPS = (signal.SIGXCPU, signal.SIGPWR)
"""SIGKILL or the end of power will follow. They may come every second, so they never escalate."""

SUSPENDS = (signal.SIGTSTP,)
"""Ctrl-Z: a frozen loop leaves the rig in motion to its watchdogs."""

IGNORED = (
    signal.SIGUSR1,
    signal.SIGUSR2,
    signal.SIGALRM,
    signal.SIGVTALRM,
    signal.SIGPROF,
    signal.SIGIO,
    signal.SIGSTKFLT,
    signal.SIGTTIN,
    signal.SIGTTOU,
    *range(signal.SIGRTMIN, signal.SIGRTMAX + 1),
)
"""They have no meaning here: a stray one, a profiler's timer or a background job's terminal.

A run goes on as if they had not come: to stop for each would end a run because somebody profiles
it. A handler that somebody else has set for one of them is kept.
"""


@contextmanager
def caught(stop: Handler, suspend: Handler) -> Iterator[None]:
    """``stop`` gets the signals of both kinds of stops, ``suspend`` those of Ctrl-Z; afterwards the
    former handlers are back.
    """
    before = {number: signal.signal(number, stop) for number in (*OPERATOR_STOPS, *MACHINE_STOPS)}
    before |= {number: signal.signal(number, suspend) for number in SUSPENDS}
    for number in IGNORED:
        if signal.getsignal(number) is signal.SIG_DFL:
            before[number] = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def ignore_all() -> None:
    """For a process whose end is another's, such as the recorder: it sees that by its pipe."""
    for number in (*OPERATOR_STOPS, *MACHINE_STOPS, *SUSPENDS, *IGNORED):
        signal.signal(number, signal.SIG_IGN)
