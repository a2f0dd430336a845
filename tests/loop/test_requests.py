"""A second Ctrl-C counts by the time between, whatever the period."""

import pytest

from epa_rt.loop.requests import AGAIN_S, NONE, STOP, STOP_AT_ONCE, OperatorRequests


@pytest.mark.parametrize("period_s", [0.002, 0.001, 0.00025])
def test_a_second_request_counts_from_a_time_on(period_s):
    requests = OperatorRequests(period_s)
    assert requests.poll(0) == NONE
    again = 10 + round(AGAIN_S / period_s)
    requests.ask()
    assert requests.poll(10) == STOP
    requests.ask()
    assert requests.poll(again - 1) == STOP
    assert requests.poll(again + 5) == STOP  # the early one was passed on twice, and is gone
    requests.ask()
    assert requests.poll(again + 6) == STOP_AT_ONCE
