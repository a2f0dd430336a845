"""The hall, the watchmen and the rule by which a run is repeated: what they may do, and what they
must not.
"""

import os
import signal
import time

import pytest

from tests.bus import own_network
from tests.bus.own_network import REAL_TIME, STALL_S, STALLS, CallFailed, call, repeated
from tests.bus.watchmen import Watchmen


@REAL_TIME
def test_a_group_stays_together(request):
    assert request.node.nodeid.endswith("@real time") == bool(
        getattr(request.config.option, "loadgroup", False)
    )


@pytest.mark.network
def test_a_call_gives_its_result_or_what_it_raised():
    assert call("tests.bus.test_own_network:doubled", value=21) == 42
    with pytest.raises(CallFailed, match="(?s)ZeroDivisionError.*printed before"):
        call("tests.bus.test_own_network:broken")
    with pytest.raises(CallFailed, match="died"):
        call("tests.bus.test_own_network:dead")
    assert call("tests.bus.test_own_network:doubled", value=1) == 2


def doubled(value):
    return 2 * value


def broken():
    print("printed before")
    return 1 / 0


def dead():
    os.kill(os.getpid(), signal.SIGKILL)


class Told:
    """A hall whose watchmen tell stalls from a list."""

    def __init__(self, monkeypatch, *stalls_s):
        self.left = list(stalls_s)
        monkeypatch.setattr(own_network, "_hall", lambda: self)

    def ask(self, request):
        return {"stall_s": self.left.pop(0)}


def failing(times):
    """A run that fails so often, then gives 7."""
    left = [times]

    def run():
        left[0] -= 1
        assert left[0] < 0, "not seven"
        return 7

    return run


def test_a_failure_without_a_stall_stays_a_failure(monkeypatch):
    Told(monkeypatch, 0.8 * STALL_S)
    with pytest.raises(AssertionError, match="not seven"):
        repeated("something", failing(1), STALL_S)
    assert STALLS == []


def test_a_failure_beside_a_stall_is_run_again_and_told(monkeypatch):
    Told(monkeypatch, 0.3, 0.2)
    assert repeated("something", failing(2), STALL_S) == 7
    told, STALLS[:] = list(STALLS), []
    assert len(told) == 2 and "not seven" in told[0] and "0.30 s" in told[0]


def test_it_is_not_run_for_ever(monkeypatch):
    told = Told(monkeypatch, 0.3, 0.3, 0.3, 0.3)
    with pytest.raises(AssertionError):
        repeated("something", failing(4), STALL_S)
    STALLS.clear()
    assert len(told.left) == 1


def test_watchmen_see_a_core_that_lets_nobody_run():
    """Stopping a watchman is what it looks like to it when its core does other things."""
    watchmen = Watchmen()
    try:
        began_s = time.monotonic()
        time.sleep(0.1)
        os.kill(watchmen.numbers[0], signal.SIGSTOP)
        time.sleep(0.4)
        os.kill(watchmen.numbers[0], signal.SIGCONT)
        time.sleep(0.1)
        assert watchmen.longest_s(began_s) >= 0.39
    finally:
        watchmen.close()
