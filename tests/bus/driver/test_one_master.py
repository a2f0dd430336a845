"""One master on a bus: a second one on this machine is refused before it sends a frame, one on
another machine is seen by the slaves' states, and a bus whose master died is free.
"""

import socket

import pytest

from drivers.claim import Claim
from drivers.other_master import Seen, is_abandoned
from drivers.words import INIT, OP, PREOP, SAFEOP
from epa_rt.backend import BackendError
from tests.bus.driver.test_driver_bus import bus_case
from tests.bus.own_network import REAL_TIME

FELL = SAFEOP | 0x10


def test_an_interface_has_one_holder_at_a_time_who_is_named():
    (_number, name), *_ = socket.if_nameindex()
    claim = Claim(name)
    for _ in range(3):
        with pytest.raises(BackendError, match=rf"found the bus on {name} in the hands of this"):
            Claim(name)
    claim.release()
    claim.release()
    Claim(name).release()


@pytest.mark.parametrize(
    ("slaves", "abandoned"),
    [
        ([Seen(OP, False), Seen(OP, True)], False),
        ([Seen(OP, None), Seen(FELL, False)], True),
        ([Seen(OP, False), Seen(OP, False)], True),
        ([Seen(OP, True), Seen(FELL, False), Seen(OP, None)], False),  # one of theirs fell
        ([Seen(SAFEOP, True)], False),
        ([Seen(SAFEOP, None)], False),  # nobody can tell: only --take-over
    ],
)
def test_watchdogs_tell_a_dead_master_from_a_live_one(slaves, abandoned):
    assert is_abandoned(slaves) == abandoned


@pytest.mark.network
@pytest.mark.timeout(900)
def test_scan_and_a_second_run_beside_a_run_are_refused_and_cost_it_nothing():
    result = bus_case("second_masters", tries=4)
    assert result["bad"] == 0 and result["before"] == result["after"]
    assert set(result["before"].values()) == {OP}
    for k, (code, text) in enumerate(zip(result["codes"], result["said"], strict=True)):
        assert code == (2 if k % 2 == 0 else 1)
        assert f"found the bus on ve0 in the hands of process {result['pid']}" in text
        assert text.strip().count("\n") == 0


@pytest.mark.network
@pytest.mark.timeout(900)
@REAL_TIME
def test_a_master_on_another_machine_is_left_alone_and_what_a_dead_one_left_is_free():
    result = bus_case("another_machines_master")
    assert "another master drives this bus" in result["live"] and "--take-over" in result["live"]
    assert set(result["states"].values()) == {OP} and not {INIT, PREOP} & {*result["states"]}
    assert result["dead"] == "" and result["cycles"] > 0


@pytest.mark.network
@pytest.mark.timeout(900)
@REAL_TIME
def test_it_is_taken_over_where_that_is_asked_for():
    result = bus_case("another_machines_master", take_over=True)
    assert result["live"] == result["dead"] == "" and INIT in result["states"].values()
