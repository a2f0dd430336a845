"""Which laws of motion a rig is asked, each once in its round and never two in one cycle."""

from collections.abc import Sequence

import pytest

from epa_rt.config.rig import Rig
from epa_rt.safety.in_motion import InMotion
from tests.safety.safety_bench import edited, rig

ONE = {"VolumeWatch", "LawWatch", "FillWatch", "CurrentWatch", "TorqueWatch"}
TWO = {"ExchangeWatch", "HoseWatch"}
EXPECTED = {
    "bench": ["GasWatch", *ONE],
    "bench_analog": ["GasWatch", *ONE],
    "mass": ["GasWatch", *ONE, "JointWatch"],
    "knee": ["GasWatch", "GasWatch", *ONE, "VolumeWatch", *TWO, "JointWatch"],
}


def names(turns: Sequence[Sequence[object]]) -> list[str]:
    return [type(law.__self__).__name__ for laws in turns for law in laws]


def asked(on: Rig) -> set[str]:
    return set(names(InMotion(on)._turns))


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_every_law_is_asked_once_in_its_round_and_the_gas_three_times(name):
    turns = InMotion(rig(name))._turns
    found, third = names(turns), names(turns[: len(turns) // 3])
    assert sorted(set(found)) == sorted(set(EXPECTED[name]))
    for law in set(found):
        times = 3 if law == "GasWatch" else 1
        assert found.count(law) == times * EXPECTED[name].count(law), law
    assert third.count("GasWatch") == EXPECTED[name].count("GasWatch")


@pytest.mark.parametrize("name", sorted(EXPECTED))
def test_no_cycle_is_asked_two_laws(name):
    assert max(len(laws) for laws in InMotion(rig(name))._turns) == 1


@pytest.mark.parametrize(("period_s", "turns"), [(1e-3, 24), (4e-3, 6), (8e-3, 3), (0.05, 3)])
def test_a_round_is_as_long_at_any_period_and_a_slow_loop_asks_the_gas_each_time(period_s, turns):
    check = InMotion(rig("bench").model_copy(update={"period": period_s}))
    assert len(check._turns) == turns
    if period_s >= 8e-3:
        assert all("GasWatch" in names([laws]) for laws in check._turns)


def test_turn_follows_turn_and_the_first_refusal_of_a_turn_is_the_answer():
    check, told = InMotion(rig("bench")), []

    def law(turn: int, answer: tuple[str, str, str] | None = None):
        return lambda measured, outputs: told.append(turn) or answer

    count = len(check._turns)
    check._turns = tuple((law(turn),) for turn in range(count))
    assert [check.step({}, {}, True) for _ in range(2 * count)] == [None] * 2 * count
    assert told == [*range(count)] * 2
    answer = ("implausible sensor", "x", "y")
    check._turns = ((law(0), law(1, answer), law(2)),) * count
    told.clear()
    assert check.step({}, {}, True) == answer and told == [0, 1]


@pytest.mark.parametrize(
    ("edit", "less"),
    [
        (("  current: motor_current_a\n", ""), {"CurrentWatch", "TorqueWatch"}),
        (("  sensors: {torque_constant: 44.8 mNm/A}", ""), {"TorqueWatch"}),
        (("force: muscle_force_n}", "per_travel: 0}"), {"LawWatch", "FillWatch", "TorqueWatch"}),
        (("force: muscle_force_n}", "force: muscle_force_n, per_travel: 0}"), {"TorqueWatch"}),
        (("force: muscle_force_n}", "force: muscle_force_n, per_travel: -1}"), {"TorqueWatch"}),
        (("    law: {", "    # law: {"), ONE - {"CurrentWatch"}),
    ],
)
def test_what_the_rig_file_does_not_say_is_not_asked(edit, less):
    assert asked(edited("bench", edit)) == {"GasWatch", *ONE} - less


def test_without_a_speed_no_current_and_no_torque_is_asked():
    motor = rig("bench").motor.model_copy(update={"speed": None})
    on = rig("bench").model_copy(update={"motor": motor})
    assert asked(on) == {"GasWatch", *ONE} - {"CurrentWatch", "TorqueWatch"}


def test_a_joint_without_muscles_is_moved_by_more_than_its_motor():
    assert asked(rig("knee").model_copy(update={"muscles": ()})) == {"CurrentWatch"}
