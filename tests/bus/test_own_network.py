"""The hall, the watchmen and the rule by which a run is repeated: what they may do, and what they must not."""

import os
import signal
import time

import pytest

from tests.bus import own_network
from tests.bus.own_network import REAL_TIME, STALLS, CallFailed, call, checked, why_not
from tests.bus.watchmen import Watchmen

in_network = pytest.mark.skipif(why_not() is not None, reason=f"no network of one's own: {why_not()}")


@REAL_TIME
def test_a_group_stays_together(request):
    assert request.node.nodeid.endswith("@real time") == bool(getattr(request.config.option, "loadgroup", False))


@in_network
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


class Answers:
    """A hall that answers with values and stalls from a list."""

    def __init__(self, monkeypatch, *answers):
        self.left = list(answers)
        monkeypatch.setattr(own_network, "_hall", lambda: self)

    def ask(self, request):
        value, stall_s = self.left.pop(0)
        return {"ok": value is not None, "result": value, "error": "it raised", "said": "", "stall_s": stall_s}


def is_seven(value):
    assert value == 7, "not seven"


def test_a_failure_without_a_stall_stays_a_failure(monkeypatch):
    answers = Answers(monkeypatch, (6, 0.01), (7, 0.0))
    with pytest.raises(AssertionError, match="not seven"):
        checked(is_seven, "somewhere:something")
    assert len(answers.left) == 1 and STALLS == []


def test_a_failure_beside_a_stall_is_run_again_and_told(monkeypatch):
    Answers(monkeypatch, (6, 0.3), (None, 0.2), (7, 0.0))
    assert checked(is_seven, "somewhere:something") == 7
    assert len(STALLS) == 2 and "not seven" in STALLS[0] and "0.30 s" in STALLS[0] and "it raised" in STALLS[1]
    STALLS.clear()


def test_it_is_not_run_for_ever(monkeypatch):
    answers = Answers(monkeypatch, *[(6, 0.3)] * 4)
    with pytest.raises(AssertionError):
        checked(is_seven, "somewhere:something")
    assert len(answers.left) == 1
    STALLS.clear()


def test_watchmen_see_a_core_that_lets_nobody_run():
    """Stopping a watchman is what it looks like to it when its core does other things."""
    watchmen = Watchmen()
    try:
        watchmen.begin()
        time.sleep(0.1)
        os.kill(watchmen.numbers[0], signal.SIGSTOP)
        time.sleep(0.4)
        os.kill(watchmen.numbers[0], signal.SIGCONT)
        time.sleep(0.1)
        assert watchmen.longest_s() >= 0.39
    finally:
        watchmen.close()
