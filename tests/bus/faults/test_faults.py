"""Each fault of the list, mid-motion, through the pysoem driver: safe in time and said by name, or
survived and counted.
"""

import pytest

from tests.bus.faults.runs import facts_of_run
from tests.bus.faults.scenarios import all_scenarios
from tests.bus.own_network import REAL_TIME

ALL = all_scenarios()
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
def test_a_fault_that_ends_the_run_leaves_the_rig_safe_in_time(name):
    scenario, facts = ALL[name], facts_of_run(name)
    assert_log_whole(facts)
    assert facts["code"] == scenario.code and scenario.says in facts["sentence"]
    first_bad = (
        facts["noticed_at"] if scenario.visible is None else facts["injected_at"] + scenario.visible
    )
    assert facts["safe_at"] - first_bad <= scenario.within
    assert facts["residual_torque_nm"] < 0.01
    assert facts["was_moving"] or scenario.when != "moving"
    assert any(
        kind in ("trip", "error") and text in facts["cause"]
        for _cycle, kind, text in facts["events"]
    )
    if scenario.again:
        code, said = facts["again"]
        assert code == 0 and said.startswith("completed"), said


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
        assert f"{len(bad)} cycles without sound process data" in facts["said"]
        assert any(kind == "gap" for _cycle, kind, _text in facts["events"])
    assert any(scenario.says in text for _cycle, _kind, text in facts["events"])
    if not scenario.real_time:
        assert facts["departs_m"] < DEPARTS_M


def test_every_kind_that_the_emulator_offers_is_put_into_a_run():
    from sim_backend.bus.fault_kinds import ALL_FAULTS

    assert set().union(*(scenario.kinds for scenario in ALL.values())) == set(ALL_FAULTS)
