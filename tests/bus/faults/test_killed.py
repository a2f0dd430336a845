"""kill -9 of the master mid-motion: the slaves' own watchdogs make the rig safe, the recorder closes the log."""

import pytest

from tests.bus.faults.scenarios import WATCHDOG_CYCLES
from tests.bus.own_network import REAL_TIME, checked, why_not


@REAL_TIME
@pytest.mark.skipif(why_not() is not None, reason=f"no network of one's own: {why_not()}")
@pytest.mark.timeout(300)
def test_a_master_that_is_killed_leaves_the_rig_to_the_watchdogs_and_the_log_to_the_recorder():
    def check(facts):
        assert facts["was_on"] and facts["was_moving"] and facts["was_holding"]
        assert 95 <= facts["safe_at"] - facts["last_frame_cycle"] <= WATCHDOG_CYCLES  # in the emulator's own time
        assert facts["missing"] == []
        assert "died" in " ".join([facts["cause"], *facts["texts"]])

    checked(check, "tests.bus.faults.killed:kill_the_master")
