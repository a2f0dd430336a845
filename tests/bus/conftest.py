"""Tests on a network of their own: skipped where there is none, repeated only where the machine
stood still.

`network` marks them (tests/bus/own_network.py). What was repeated goes along with the test's
report; tests/conftest.py shows it.
"""

import pytest

from tests.bus.own_network import LOCK_STEP_STALL_S, STALL_S, STALLS, repeated, why_not
from tests.conftest import STALLED


def pytest_runtest_setup(item):
    if item.get_closest_marker("network") and why_not() is not None:
        pytest.skip(f"no network of one's own: {why_not()}")


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem):
    if pyfuncitem.get_closest_marker("network") is None:
        return None
    arguments = {name: pyfuncitem.funcargs[name] for name in pyfuncitem._fixtureinfo.argnames}
    by_the_clock = any(
        mark.args == ("real time",) for mark in pyfuncitem.iter_markers("xdist_group")
    )
    repeated(
        pyfuncitem.name,
        lambda: pyfuncitem.obj(**arguments),
        STALL_S if by_the_clock else LOCK_STEP_STALL_S,
    )
    return True


@pytest.fixture(autouse=True)
def _tell_stalls(record_property):
    yield
    for text in STALLS:
        record_property(STALLED, text)
    STALLS.clear()
