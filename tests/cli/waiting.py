"""Work for a process beside, which imports it by name."""

import os
import time


def its_number(wait_s: float) -> int:
    """Its process id, after a wait."""
    time.sleep(wait_s)
    return os.getpid()


def diagnoser(rig, plant, logs, holdout, leave_out):
    """A diagnosis that says its number in place of a rig file and takes a minute."""
    rig.write_text(str(os.getpid()), encoding="utf-8")
    time.sleep(60.0)
    return {}
