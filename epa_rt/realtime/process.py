"""What the loop's process asks of kernel and interpreter so that a cycle is not held up, and gives
back afterwards.
"""

import ctypes
import gc
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from epa_rt.config.rig import Realtime

Undo = Callable[[], object]

_MCL_CURRENT, _MCL_FUTURE = 1, 2


@contextmanager
def undisturbed(realtime: Realtime | None) -> Iterator[list[str]]:
    """Garbage collection frozen; with ``realtime`` also memory lock, core and SCHED_FIFO, each
    where permitted.

    Yields one sentence per thing asked for, granted or not, for the log. On leaving, all of it is
    undone.
    """
    gc.collect()
    gc.freeze()
    was_enabled = gc.isenabled()
    gc.disable()
    interval = sys.getswitchinterval()
    undo: list[Undo] = []
    sentences = ["garbage collection frozen"]
    try:
        if realtime is not None:
            sentences += [
                _lock_memory(undo),
                _pin_core(realtime.core, undo),
                _prioritise(realtime.priority, undo),
            ]
        yield sentences
    finally:
        for step in reversed(undo):
            step()
        sys.setswitchinterval(interval)
        if was_enabled:
            gc.enable()
        gc.unfreeze()


def _lock_memory(undo: list[Undo]) -> str:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE) != 0:
        return (
            f"memory not locked ({os.strerror(ctypes.get_errno())}): raise 'memlock' in"
            " /etc/security/limits.conf"
        )
    undo.append(libc.munlockall)
    return "memory locked"


def _pin_core(core: int | None, undo: list[Undo]) -> str:
    if core is None:
        return "no core asked for"
    before = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {core})
    except OSError as error:
        return f"core {core} not taken ({error.strerror})"
    undo.append(lambda: os.sched_setaffinity(0, before))
    return f"running on core {core}"


def _prioritise(priority: int, undo: list[Undo]) -> str:
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        return (
            f"SCHED_FIFO not granted ({error.strerror}): raise 'rtprio' in"
            " /etc/security/limits.conf"
        )
    undo.append(lambda: os.sched_setscheduler(0, policy, parameters))
    return f"SCHED_FIFO priority {priority}"
