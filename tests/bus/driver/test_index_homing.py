"""On the emulated bus: the drive seeks its index pulse, and every fault ends as the rig shows."""

import pytest

from sim_backend.drive_machine import RETURNING, SEEKING
from tests.bus.driver.index_homing import MOVING
from tests.bus.own_network import call

pytestmark = pytest.mark.network
STOPPING_M = 0.0002  # 20 ms at 4 mm/s with the ramp: the reaction time of the rig
WATCHDOG_S = 0.1


def run_with(**given):
    return call("tests.bus.driver.index_homing:homes_with", **given)


def is_at_rest(facts) -> bool:
    return (
        abs(facts["speeds_m_s"][-1]) < 1e-4
        and facts["exhaust_open"]
        and facts["gauge_pa"] < 8e3
        and facts["homing"] not in (SEEKING, RETURNING)
    )


def is_off(facts) -> bool:
    """Without power, and out of its homing mode, which is 6."""
    return is_at_rest(facts) and not facts["powered"] and facts["off"] and facts["mode"] == 9


def was_moving(facts) -> bool:
    return abs(facts["speeds_m_s"][MOVING - 1]) > 0.8 * facts["way"]["speed"]


def after_the_fault_m(facts) -> float:
    before = facts["travels_m"][MOVING - 1]
    return max(abs(travel - before) for travel in facts["travels_m"][MOVING:])


def test_it_is_homed_with_the_speeds_of_the_rig_file_and_none_that_was_left():
    facts = call("tests.bus.driver.index_homing:homes")
    assert facts["outcome"] == "completed", facts["cause"]
    assert facts["objects"] == {
        "method": 33,
        "switch": 72,
        "zero": 72,
        "acceleration": 720,
        "home": 12720,
        "move": 0,
    }
    assert any("homes by method 33 at 72 rpm and 720 rpm/s" in text for text in facts["said"])
    assert facts["referenced"] and is_off(facts)
    assert abs(facts["measured"]["motor_travel_m"] - 10.27e-3) < 1e-5
    assert facts["measured"]["drive_status_raw"] >= 0x8000
    assert facts["furthest_m"] < facts["way"]["turn"] + facts["way"]["landing"]
    assert facts["fastest_m_s"] < 1.1 * facts["way"]["speed"]


def test_an_index_that_never_comes():
    facts = run_with(kind="index")
    assert facts["outcome"] == "tripped" and "no index pulse within" in facts["cause"]
    assert facts["category"].startswith("stop category 1") and is_off(facts)
    assert 0.0 < facts["furthest_m"] - facts["way"]["most"] < STOPPING_M
    assert facts["fastest_m_s"] < 1.1 * facts["way"]["speed"] and not facts["referenced"]


@pytest.mark.parametrize("code", [0x8611, 0x2310])
def test_the_drive_faults_under_way(code):
    facts = run_with(kind="drive_fault", value=code)
    assert facts["outcome"] == "tripped" and "the drive was lost" in facts["cause"]
    assert was_moving(facts) and after_the_fault_m(facts) < STOPPING_M
    assert is_off(facts) and facts["again"] == "completed"


def test_the_cable_is_pulled_under_way():
    facts = run_with(kind="cable_pulled")
    assert facts["outcome"] == "failed" and "no frame came back" in facts["cause"]
    assert was_moving(facts)
    assert after_the_fault_m(facts) < facts["way"]["speed"] * WATCHDOG_S + STOPPING_M
    assert is_at_rest(facts) and facts["powered"]  # the drive holds by itself, and homes no more
    assert facts["again"] == "completed"


def test_the_drive_falls_out_of_operation_under_way():
    facts = run_with(kind="slave_falls", place="drive", value=0x2C)
    assert facts["outcome"] in ("tripped", "failed")
    assert was_moving(facts) and after_the_fault_m(facts) < STOPPING_M
    assert is_at_rest(facts) and facts["again"] == "completed"


def test_the_operator_stops_it_under_way():
    facts = run_with(stop_at=MOVING)
    assert facts["outcome"] == "stopped" and was_moving(facts)
    assert after_the_fault_m(facts) < STOPPING_M
    assert is_off(facts) and not facts["referenced"] and facts["again"] == "completed"


@pytest.mark.parametrize(
    ("value", "said"), [(30.0, "more than 20 N: something is in the way"), (400.0, "over-force")]
)
def test_the_force_reaches_its_limit_under_way(value, said):
    facts = run_with(kind="sensor_offset", place="muscle_force_n", value=value)
    assert facts["outcome"] == "tripped" and said in facts["cause"]
    assert facts["category"].startswith("stop category 1")
    assert was_moving(facts) and after_the_fault_m(facts) < 2.0 * STOPPING_M
    assert is_off(facts) and facts["again"] == "completed"


@pytest.mark.parametrize(
    ("kind", "index"),
    [
        ("sdo_forgotten", 0x6098),
        ("sdo_forgotten", 0x6099),
        ("sdo_forgotten", 0x609A),
        ("sdo_refused", 0x30B1),
    ],
)
def test_a_drive_that_does_not_keep_what_it_is_told_moves_nothing(kind, index):
    facts = call("tests.bus.driver.index_homing:refuses", kind=kind, index=index)
    assert facts["outcome"] == "failed" and f"0x{index:04X}" in facts["cause"], facts["cause"]
    assert facts["rows"] == 0


def test_the_next_run_finds_a_homing_that_moves_nothing():
    objects = call("tests.bus.driver.index_homing:leaves_nothing_that_moves")
    assert objects["method"] == 37
