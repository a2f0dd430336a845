"""A viewer's process leaves the processors to the loop and to the recorder."""

from __future__ import annotations

import contextlib
import os

NICE = 15  # the recorder's is 10: the log goes before a view


def step_aside(loop_core: int | None) -> None:
    """Lower this process's share, and keep it off the core that the rig's loop asks for."""
    with contextlib.suppress(OSError):
        os.nice(max(NICE - os.nice(0), 0))
    if loop_core is not None:
        others = os.sched_getaffinity(0) - {loop_core}
        if others:
            with contextlib.suppress(OSError):
                os.sched_setaffinity(0, others)
