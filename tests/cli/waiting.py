"""Work for a process beside, which imports it by name."""

import os
import time


def its_number(wait_s: float) -> int:
    """Its process id, after a wait."""
    time.sleep(wait_s)
    return os.getpid()
