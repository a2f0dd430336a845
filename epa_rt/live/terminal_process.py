"""The process of the terminal view of `epa run --live`, with the run's own terminal.

Arguments: the log, and a descriptor on which to say that the view is to be seen. WORDS in the
environment are shown at first: they hold a token, and arguments are for every user to see. It ends
with the run or when its user closes it.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from epa_rt.live.attach import NotOn, attach_soon
from epa_rt.live.step_aside import step_aside

WORDS = "EPA_VIEW_WORDS"
WAIT_S = 10.0
STAYS_S = 5.0
"""A view that belongs to a run closes so long after its end, so that the run's own words follow."""


def main() -> int:
    log, seen, words = Path(sys.argv[1]), int(sys.argv[2]), os.environ.pop(WORDS, "")
    # Read by Textual as it is loaded. Its other way to read keys takes Ctrl-C, Ctrl-\\ and Ctrl-Z
    # from the terminal, and the run would never hear of them.
    os.environ["TEXTUAL_DISABLE_KITTY_KEY"] = "1"
    try:
        attached = attach_soon(log, on_screen=True, wait_s=WAIT_S)
    except NotOn as error:
        print(f"no live view: {error}", file=sys.stderr)
        return 1
    from epa_rt.live.terminal import show_run
    from epa_rt.live.watched import WatchedRun

    step_aside(WatchedRun(attached.facts).rig.realtime.core)
    with attached:
        show_run(attached, STAYS_S, words, lambda: os.close(seen))
    if not attached.is_over:
        print(
            f"\nthe view is closed, the run goes on: Ctrl-C stops it, epa live"
            f" {os.path.relpath(attached.facts.log)} looks again",
            file=sys.stderr,
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
