"""kill -9 of the master at speed: drive and valves make the rig safe by themselves, the recorder
closes the log.
"""

import pytest

from tests.bus.faults.scenarios import WATCHDOG_CYCLES
from tests.bus.own_network import REAL_TIME, STALL_S, call, repeated

pytestmark = [REAL_TIME, pytest.mark.network, pytest.mark.timeout(900)]


def killed(rig: str) -> dict:
    """Facts of a kill, with a muscle that fills soon; what is true of every rig."""
    facts = repeated(
        f"kill -9 on {rig}",
        lambda: call("tests.bus.faults.killed:kill_the_master", rig=rig, pressure="120 kPa gauge"),
        STALL_S,
    )
    assert facts["was_on"] and facts["was_holding"] and facts["speed_m_s"] > 0.03
    reaction = facts["air_out_at"] - facts["last_frame_cycle"]  # in the emulator's own time
    assert 95 <= reaction <= WATCHDOG_CYCLES
    assert facts["vented_at"] is not None and facts["rest_at"] is not None
    assert facts["missing"] == []
    assert "died" in " ".join([facts["cause"], *facts["texts"]])
    return facts


def test_a_drive_on_the_bus_whose_master_is_killed_brakes_and_holds_by_itself():
    facts = killed("bench")
    assert 95 <= facts["stopping_at"] - facts["last_frame_cycle"] <= WATCHDOG_CYCLES
    assert facts["holds_at_end"] and facts["power_gone_at"] is None and facts["beyond"] == []


def test_a_wired_drive_whose_master_is_killed_loses_its_enable_with_its_terminal():
    facts = killed("bench_analog")
    assert 95 <= facts["power_gone_at"] - facts["last_frame_cycle"] <= WATCHDOG_CYCLES
    assert facts["residual_torque_nm"] < 0.01
