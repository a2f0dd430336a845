"""Each fault of the list, mid-motion, through the pysoem driver: the rig stopped in time by its
category and the fault said by name, or survived and counted.
"""

import pytest

from tests.bus.faults.runs import facts_of_run
from tests.bus.faults.scenarios import ALONE, BRAKES, OFF, Scenario, all_scenarios
from tests.bus.own_network import REAL_TIME

ALL = all_scenarios()
SLOW_M_S = 0.002  # a motor that stands
BRAKING_CYCLES = 100  # from 50 mm/s by the wired drive's slew, until its speed loop has settled
STOP_GIVES_M = 0.002  # the end stops of the drive train are springs
# a lost frame at 50 mm/s is 0.05 mm; the position loop takes some milliseconds to make it good
DEPARTS_M = 0.25e-3

pytestmark = [pytest.mark.network, pytest.mark.timeout(900)]


def cases(goes_on: bool) -> list:
    """Parameters; those in real time in their group, those that share the undisturbed run
    together.
    """
    found = []
    for name, scenario in ALL.items():
        if scenario.goes_on != goes_on:
            continue
        marks = (
            [REAL_TIME]
            if scenario.real_time
            else (
                [pytest.mark.xdist_group(f"beside the undisturbed {scenario.rig}")]
                if scenario.compares
                else []
            )
        )
        if scenario.gap and not goes_on:
            marks += [pytest.mark.xfail(strict=True, reason=f"not noticed yet: {scenario.gap}")]
        found.append(pytest.param(name, marks=marks, id=name))
    return found


def assert_log_whole(facts: dict) -> None:
    assert facts["missing"] == [] and facts["injected_at"] is not None
    assert facts["sentence"] == facts["outcome"] + (f": {facts['cause']}" if facts["cause"] else "")


@pytest.mark.parametrize("name", cases(goes_on=False))
def test_a_fault_that_ends_the_run_stops_the_rig_in_time(name):
    scenario, facts = ALL[name], facts_of_run(name)
    assert_log_whole(facts)
    assert facts["code"] == scenario.code and scenario.says in facts["sentence"]
    assert any(
        kind in ("trip", "error") and text in facts["cause"]
        for _cycle, kind, text in facts["events"]
    )
    if scenario.when == "start":
        assert not facts["had_power"]
        return
    assert facts["was_moving"] or scenario.when != "moving"
    first_bad = (
        facts["noticed_at"] if scenario.visible is None else facts["injected_at"] + scenario.visible
    )
    assert facts["air_out_at"] - first_bad <= scenario.within
    STOPS[scenario.stop](scenario, facts, first_bad)
    if scenario.again:
        code, said = facts["again"]
        assert code == 0 and said.startswith("completed"), said


def brakes_and_holds(scenario: Scenario, facts: dict, first_bad: int) -> None:
    """Under power until the motor stands and the muscles are vented, within the rig's limits."""
    if scenario.rig == "bench_analog":  # nothing on its wires says that it stops
        assert facts["rest_at"] - first_bad <= BRAKING_CYCLES
    else:
        assert facts["stopping_at"] - first_bad <= scenario.within
    assert facts["power_never_left"] and facts["beyond"] == []
    assert facts["speed_at_power_off_m_s"] < SLOW_M_S
    assert scenario.stuck or facts["gauge_at_power_off_pa"] < facts["vented_pa"]


def goes_off(scenario: Scenario, facts: dict, first_bad: int) -> None:
    """Without torque in time; the muscle may throw the motor, no further than to its stops."""
    assert facts["power_gone_at"] - first_bad <= scenario.within
    assert facts["residual_torque_nm"] < 0.01
    assert "stored then: nothing measured" not in facts["said"]
    low_m, high_m = facts["stops_m"]
    assert low_m - STOP_GIVES_M < facts["travel_range_m"][0]
    assert facts["travel_range_m"][1] < high_m + STOP_GIVES_M


def holds_alone(scenario: Scenario, facts: dict, first_bad: int) -> None:
    """Nobody is left to take its power away: it stands still under power, the muscles vented."""
    assert facts["stopping_at"] - first_bad <= scenario.within
    assert facts["holds_at_end"] and facts["beyond"] == [] and facts["power_gone_at"] is None
    assert facts["rest_at"] is not None
    assert scenario.real_time or facts["vented_at"] is not None  # nobody waits for it in real time


STOPS = {BRAKES: brakes_and_holds, OFF: goes_off, ALONE: holds_alone}


@pytest.mark.parametrize("name", cases(goes_on=True))
def test_a_fault_that_can_be_survived_is_counted_and_nothing_jumps(name):
    scenario, facts = ALL[name], facts_of_run(name)
    assert_log_whole(facts)
    assert (facts["code"], facts["outcome"]) == (0, "completed")
    bad = facts["bad"]
    assert (
        len(bad) == scenario.bad_cycles
        if not scenario.real_time
        else len(bad) >= scenario.bad_cycles
    )
    if bad:
        cycles = "1 cycle" if len(bad) == 1 else f"{len(bad)} cycles"
        assert f"{cycles} without sound process data" in facts["said"]
        assert any(kind == "gap" for _cycle, kind, _text in facts["events"])
    assert any(scenario.says in text for _cycle, _kind, text in facts["events"])
    if not scenario.real_time:
        assert facts["departs_m"] < DEPARTS_M


def test_every_kind_that_the_emulator_offers_is_put_into_a_run():
    from sim_backend.bus.fault_kinds import ALL_FAULTS

    assert set().union(*(scenario.kinds for scenario in ALL.values())) == set(ALL_FAULTS)
