"""For all tests: groups that xdist keeps together, and what the machine did to tests that run by
the clock.
"""

import os
import signal

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


def pytest_collection_modifyitems(config, items):
    """xdist 3.8 writes the group behind a test's name into a field that pytest 9 no longer reads;
    without this every `xdist_group` is ignored.
    """
    if not getattr(config.option, "loadgroup", False):
        return
    for item in items:
        mark = item.get_closest_marker("xdist_group")
        if mark is not None and not item.nodeid.endswith(f"@{mark.args[0]}"):
            item._id = type(item.id).parse(f"{item.nodeid}@{mark.args[0]}")


def pytest_terminal_summary(terminalreporter):
    """One line per run that was repeated; the properties come along from the processes that ran the
    tests.
    """
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
