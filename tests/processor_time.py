"""Processor time of every test, with the processes that it starts: what CI spends its minutes on.

Wall time says little of it where tests share two processors. Linux only.

  scripts/test.sh -p tests.processor_time
  EPA_TEST_TURN=all scripts/test.sh -p tests.processor_time --write-costs   # tests/costs.json anew
"""

import json
from collections import Counter, defaultdict
from os import getpid, sysconf
from pathlib import Path

import pytest

from tests import turns

SHOWN = 40  # tests in the table at the end, the parameters of one counted together
PROPERTY = "processor_s"
BEGUN = pytest.StashKey[float]()
_TICKS_PER_S = sysconf("SC_CLK_TCK")
_PARENT, _TIMES = 1, slice(11, 15)  # of /proc/PID/stat behind the name: own time, and of children


def used_s() -> float:
    """Processor time of this process and all below it, of those that have ended too, s."""
    time_of, below = {}, defaultdict(list)
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
        except OSError:  # it has ended
            continue
        pid = int(path.parent.name)
        time_of[pid] = sum(map(int, fields[_TIMES])) / _TICKS_PER_S
        below[int(fields[_PARENT])].append(pid)
    total, waiting = 0.0, [getpid()]
    while waiting:
        pid = waiting.pop()
        total += time_of.get(pid, 0.0)
        waiting += below[pid]
    return total


def pytest_addoption(parser):
    parser.addoption("--write-costs", action="store_true", help="what takes turns, anew")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item):
    """What a test's fixtures take is the test's."""
    item.stash[BEGUN] = used_s()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item):
    found = yield
    item.user_properties.append((PROPERTY, round(used_s() - item.stash[BEGUN], 2)))
    return found


def pytest_terminal_summary(terminalreporter, config):
    """A table, the largest first; where it is asked for, the file of what takes turns."""
    of_test = [
        (report.nodeid, dict(report.user_properties).get(PROPERTY, 0.0))
        for reports in terminalreporter.stats.values()
        for report in reports
        if getattr(report, "when", "") == "teardown"
    ]
    total: Counter[str] = Counter()
    for nodeid, seconds in of_test:
        total[turns.function_of(nodeid)] += seconds
    if config.option.write_costs:
        turns.COSTS.write_text(json.dumps(turns.costs(of_test), indent=1) + "\n", encoding="utf-8")
    terminalreporter.section(f"processor time: {sum(total.values()):.0f} s")
    for name, seconds in total.most_common(SHOWN):
        terminalreporter.line(f"{seconds:7.1f} s  {name}")
