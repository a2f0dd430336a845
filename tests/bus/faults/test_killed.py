"""kill -9 of the master mid-motion: the slaves' own watchdogs make the rig safe, the recorder
closes the log.
"""

import pytest

from tests.bus.faults.scenarios import WATCHDOG_CYCLES
from tests.bus.own_network import REAL_TIME, call


@REAL_TIME
@pytest.mark.network
@pytest.mark.timeout(900)
def test_a_master_that_is_killed_leaves_the_rig_to_the_watchdogs_and_the_log_to_the_recorder():
    facts = call("tests.bus.faults.killed:kill_the_master")
    assert facts["was_on"] and facts["was_moving"] and facts["was_holding"]
    assert (
        95 <= facts["safe_at"] - facts["last_frame_cycle"] <= WATCHDOG_CYCLES
    )  # in the emulator's own time
    assert facts["missing"] == []
    assert "died" in " ".join([facts["cause"], *facts["texts"]])
