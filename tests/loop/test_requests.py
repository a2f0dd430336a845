"""Signals as requests: who stops, who escalates, who is ignored, and what is put back."""

import os
import signal

import pytest

from epa_rt.loop.requests import AGAIN_S, NONE, STOP, STOP_AT_ONCE, OperatorRequests
from epa_rt.realtime.signal_sets import IGNORED, MACHINE_STOPS, OPERATOR_STOPS, SUSPENDS

ALL = (*OPERATOR_STOPS, *MACHINE_STOPS, *SUSPENDS, *IGNORED)


@pytest.mark.parametrize("period_s", [0.002, 0.001, 0.00025])
@pytest.mark.parametrize("number", OPERATOR_STOPS)
def test_the_second_signal_of_an_operator_counts_after_a_while(number, period_s):
    again = round(AGAIN_S / period_s)
    with OperatorRequests(period_s).listening() as requests:
        assert requests.poll(0) == NONE
        os.kill(os.getpid(), number)
        assert requests.poll(1) == STOP
        os.kill(os.getpid(), number)
        assert requests.poll(again) == STOP  # too early: one key press passed on twice
        os.kill(os.getpid(), number)
        assert requests.poll(1 + again) == STOP_AT_ONCE


@pytest.mark.parametrize("number", MACHINE_STOPS)
def test_what_the_machine_sends_every_second_never_takes_the_torque_off_at_once(number):
    with OperatorRequests().listening() as requests:
        for cycle in range(1, 5000, 1000):
            os.kill(os.getpid(), number)
            assert requests.poll(cycle) == STOP
        os.kill(os.getpid(), signal.SIGINT)
        assert requests.poll(6000) == STOP_AT_ONCE


def test_the_rest_asks_for_nothing_and_ctrl_z_is_answered(capfd):
    with OperatorRequests().listening() as requests:
        for number in (*SUSPENDS, *IGNORED):
            if signal.getsignal(number) is signal.SIG_IGN or number in SUSPENDS:
                os.kill(os.getpid(), number)
        assert requests.poll(0) == NONE
    assert "Ctrl-Z is refused" in capfd.readouterr().err


def test_former_handlers_are_back_afterwards_and_a_handler_of_others_is_kept():
    signal.signal(signal.SIGUSR1, lambda *_: None)  # a profiler's, say
    try:
        before = [signal.getsignal(number) for number in ALL]
        with OperatorRequests().listening():
            assert signal.getsignal(signal.SIGUSR1) is before[ALL.index(signal.SIGUSR1)]
            assert signal.SIG_DFL not in [signal.getsignal(number) for number in ALL]
        assert [signal.getsignal(number) for number in ALL] == before
    finally:
        signal.signal(signal.SIGUSR1, signal.SIG_DFL)


def test_no_signal_that_ends_or_freezes_a_process_is_forgotten():
    broken_program = {"SIGABRT", "SIGBUS", "SIGFPE", "SIGILL", "SIGSEGV", "SIGSYS", "SIGTRAP"}
    never_caught = {"SIGKILL", "SIGSTOP"}
    harmless = {"SIGCHLD", "SIGCONT", "SIGURG", "SIGWINCH"}
    python_ignores = {"SIGPIPE", "SIGXFSZ"}
    others = broken_program | never_caught | harmless | python_ignores
    known = {signal.Signals(number) for number in ALL if number in set(signal.Signals)}
    assert {one.name for one in signal.valid_signals() if isinstance(one, signal.Signals)} == (
        {one.name for one in known} | others
    )
