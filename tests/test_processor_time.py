"""The plugin that says what tests cost counts the processes that they start."""

import resource
import subprocess
import sys

from tests.processor_time import used_s

BUSY = "sum(k * k for k in range(3_000_000)); print(flush=True); input()"
TICKS_S = 0.05  # of the kernel's count, for several processes


def children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_a_child_counts_while_it_lives_and_after_it():
    before, of_others = used_s(), children_s()
    with subprocess.Popen(
        [sys.executable, "-c", BUSY], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as child:
        child.stdout.readline()
        alive = used_s() - before
        child.communicate(b"\n")
    ended, own = used_s() - before, children_s() - of_others
    assert own > 2 * TICKS_S and 0.5 * own < alive
    assert ended > own - TICKS_S and ended >= alive - TICKS_S
