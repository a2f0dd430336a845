"""For all tests: groups that xdist keeps together, in which order it hands them out, and what the
machine did to tests that run by the clock.
"""

import os
import signal
from pathlib import Path

import pytest

from tests import turns

os.environ.setdefault(
    "OPENBLAS_NUM_THREADS",
    "1",
    # before numpy, as `epa` has it: threads of a small product spin on the processors that the
    # tests run on
)

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # started in the background of a shell: what the tests start would inherit it, and never hear
    # the Ctrl-C that they send
    signal.signal(signal.SIGINT, signal.default_int_handler)

STALLED = "the machine stood still"  # tests/bus/own_network.py


# what a process records or diagnoses once serves every test of these folders
FOLDERS = ("benchmark", "gap/hygiene", "gap/house", "logs", "report", "runs")
# tests that share nothing: any process takes the next one
APART = (
    "benchmark/test_sealed_cases.py",
    "bus/driver/test_driver_bus.py",
    "bus/faults/test_faults.py",
    "test_scripts.py",
)
# groups that take longest, first: no process ends with one of them while another has no more
FIRST = (
    "real time",
    "gap/hygiene",
    "gap/house",
    "models/test_plant_second_simulator.py",
    "benchmark/test_sealed_cases.py",  # of two processes, which "real time" can do without
    "benchmark",
    "epa gap",
    "safety/test_coverage.py",
    "gap/foreign/test_shared_cases.py",
    "cli/test_run.py",
    "runs",
    "replay/test_replay.py",
    "test_scripts.py",
    "tune/test_tune_verb.py",
)
TESTS = Path(__file__).parent


def _group(item) -> str:
    """What is run by one process: a mark's group, else a folder's, a file's, or a test's own."""
    mark = item.get_closest_marker("xdist_group")
    if mark is not None:
        return mark.args[0]
    file = item.path.relative_to(TESTS).as_posix()
    if file in APART:
        return f"{file} {item.nodeid.partition('::')[2]}".replace("[", " ").replace("]", "")
    return next((folder for folder in FOLDERS if file.startswith(f"{folder}/")), file)


def _rank(group: str) -> int:
    return next((i for i, first in enumerate(FIRST) if group.startswith(first)), len(FIRST))


def pytest_configure(config):
    """The order is that of ``FIRST``, not that of how many tests a group has."""
    config.option.loadscopereorder = False
    turns.decide(config)


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node):
    turns.hand_on(node)


def pytest_collection_modifyitems(config, items):
    """xdist 3.8 writes the group behind a test's name into a field that pytest 9 no longer reads;
    without this every `xdist_group` is ignored. Tests without one go by file.
    """
    turns.take_turns(config, items)
    if not getattr(config.option, "loadgroup", False):
        return
    items.sort(key=lambda item: _rank(_group(item)))
    for item in items:
        group = _group(item)
        if not item.nodeid.endswith(f"@{group}"):
            item._id = type(item.id).parse(f"{item.nodeid}@{group}")


def pytest_terminal_summary(terminalreporter, config):
    """Whose turn it was, and one line per run that was repeated; the properties come along from the
    processes that ran the tests.
    """
    terminalreporter.line(turns.told(config))
    told = [
        (report.nodeid, text)
        for reports in terminalreporter.stats.values()
        for report in reports
        if getattr(report, "when", "") == "teardown"
        for name, text in report.user_properties
        if name == STALLED
    ]
    if told:
        terminalreporter.section("runs repeated, because this machine stood still")
        for nodeid, text in told:
            terminalreporter.line(f"{nodeid}: {text}")
