"""Each fault of the list, mid-motion, through the pysoem driver: safe in time and said by name, or survived and counted."""

import pytest

from tests.bus.faults.runs import results, why_not
from tests.bus.faults.scenarios import Scenario, all_scenarios

ALL = all_scenarios()
AT_ONCE = 12  # scenarios that share a process; its results are kept, so tests of one group stay together
DEPARTS_M = 0.25e-3  # a lost frame at 50 mm/s is 0.05 mm; the position loop takes some milliseconds to make it good

pytestmark = [pytest.mark.skipif(why_not() is not None, reason=f"no network of one's own: {why_not()}"), pytest.mark.timeout(300)]


def groups() -> dict[str, tuple[str, ...]]:
    """The names that run together with a name: of one rig and one ending, so that they share the undisturbed run."""
    found = {}
    names = sorted(ALL, key=lambda name: (ALL[name].real_time, not ALL[name].goes_on, ALL[name].rig))
    paced = [name for name in names if ALL[name].real_time]
    quick = [name for name in names if not ALL[name].real_time]
    for together in [tuple(quick[start : start + AT_ONCE]) for start in range(0, len(quick), AT_ONCE)] + [tuple(paced)]:
        found |= dict.fromkeys(together, together)
    return found


GROUPS = groups()


def cases(goes_on: bool) -> list:
    """Parameters with their group; what the loop does not notice yet is expected to fail."""
    found = []
    for name, scenario in ALL.items():
        if scenario.goes_on == goes_on:
            marks = [pytest.mark.xdist_group(f"faults {GROUPS[name][0]}")]
            marks += [pytest.mark.xfail(strict=True, reason=f"not noticed yet: {scenario.gap}")] if scenario.gap and not goes_on else []
            found.append(pytest.param(name, marks=marks, id=name))
    return found


def result_of(name: str) -> tuple[Scenario, dict]:
    return ALL[name], results(GROUPS[name])[name]


def assert_log_whole(facts: dict) -> None:
    assert facts["missing"] == [] and facts["injected_at"] is not None
    assert facts["sentence"] == facts["outcome"] + (f": {facts['cause']}" if facts["cause"] else "")


@pytest.mark.parametrize("name", cases(goes_on=False))
def test_a_fault_that_ends_the_run_leaves_the_rig_safe_in_time(name):
    scenario, facts = result_of(name)
    assert_log_whole(facts)
    assert facts["code"] == scenario.code and scenario.says in facts["sentence"]
    first_bad = facts["noticed_at"] if scenario.visible is None else facts["injected_at"] + scenario.visible
    assert facts["safe_at"] - first_bad <= scenario.within
    assert facts["residual_torque_nm"] < 0.01
    assert facts["was_moving"] or scenario.when != "moving"
    assert any(kind in ("trip", "error") and text in facts["cause"] for _cycle, kind, text in facts["events"])
    if scenario.again:
        code, said = facts["again"]
        assert code == 0 and said.startswith("completed"), said


@pytest.mark.parametrize("name", cases(goes_on=True))
def test_a_fault_that_can_be_survived_is_counted_and_nothing_jumps(name):
    scenario, facts = result_of(name)
    assert_log_whole(facts)
    assert (facts["code"], facts["outcome"]) == (0, "completed")
    bad = facts["bad"]
    assert len(bad) == scenario.bad_cycles if not scenario.real_time else len(bad) >= scenario.bad_cycles
    if bad:
        assert f"{len(bad)} cycles without sound process data" in facts["said"]
        assert any(kind == "gap" for _cycle, kind, _text in facts["events"])
    assert any(scenario.says in text for _cycle, _kind, text in facts["events"])
    if not scenario.real_time:
        assert facts["departs_m"] < DEPARTS_M


def test_every_kind_that_the_emulator_offers_is_put_into_a_run():
    from sim_backend.bus.fault_kinds import ALL_FAULTS

    assert set().union(*(scenario.kinds for scenario in ALL.values())) == set(ALL_FAULTS)
