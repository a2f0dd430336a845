"""The envelope asks every law it has, and what it heard first is what is said."""

import pytest
from safety_bench import Bench, edited, rig

from epa_rt.safety.bus_budget import BusBudget
from epa_rt.safety.contradiction import MotionCheck

TRAVEL, SPEED = "motor_travel_m", "motor_speed_m_s"
ENABLED = 0x0237


def test_it_trips_on_sensors_in_motion():
    """A muscle that is filled and whose pressure stays."""
    bench = Bench()
    bench.command |= {"cmd_muscle_inlet_open": 1.0, "cmd_muscle_exhaust_open": 0.0}
    for _ in range(400):
        bench.check()
    assert bench.trip[:2] == ("implausible sensor", "muscle_pressure_pa")
    assert "while cmd_muscle_inlet_open is open" in bench.trip.text


def test_a_count_lost_while_it_brakes_is_said_in_a_sentence():
    bench = Bench().power_on(9, ENABLED)
    bench.envelope.trip("recorder", "", "the disk is full", 1)
    bench.check()
    assert not bench.envelope.position_lost
    assert bench.check({TRAVEL: 0.02}) == bench.safe and bench.envelope.position_lost
    assert bench.envelope.stopping.why == f"{TRAVEL} jumped by 20 mm in 2 ms"


def test_a_lost_bus_goes_before_the_jump_that_it_led_to():
    """The time that the last lost frame took shows in the sound cycle after it."""
    bench = Bench(edited("bench", ("lost_cycles: 3", "lost_cycles: 3\n  lost_time: 9 ms")))
    bench.power_on(9, ENABLED)

    def read(bus_ok: bool, at_ms: int, travel: float = 0.0) -> dict:
        row = bench.measured | {TRAVEL: travel}
        check = bench.envelope.check
        return check(at_ms, bus_ok, row, 0, 0, bench.command, 1_000_000 * at_ms)

    for bus_ok, at_ms in ((True, 0), (False, 1), (True, 6), (False, 7)):
        read(bus_ok, at_ms)
    assert bench.trip is None and read(True, 12, 0.02) == bench.safe
    assert bench.trip.cause == "lost working counter" and bench.envelope.position_lost
    assert bench.envelope.stopping.why == bench.trip.text


def test_a_stall_that_was_paid_back_is_not_said_again():
    budget, at = BusBudget(rig("bench")), 1_000_000_000
    assert not budget.step(False, at) and not budget.step(True, at + 500_000_000)
    for k in range(200):
        assert not budget.step(True, at + 501_000_000 + 1_000_000 * k)
    assert budget.clear
    began = at + 1_000_000_000
    said = [budget.step(False, began + 1_000_000 * k) for k in range(3)]
    assert said == ["", "", "the working counter was wrong in 3 cycles in a row"]


@pytest.mark.parametrize(
    ("limits", "sign"), [("[-300 mm/s, 150 mm/s]", 1.0), ("[-150 mm/s, 300 mm/s]", -1.0)]
)
def test_the_larger_limit_of_speed_says_what_is_a_jump_either_way(limits, sign):
    """1.5 times 300 mm/s in the 2 ms that a position may have been held."""
    on = edited("bench", ("limits: [-150 mm/s, 150 mm/s]", f"limits: {limits}"))
    for step, jumps in ((0.89e-3, False), (0.91e-3, True)):
        check = MotionCheck(on)
        row = {TRAVEL: 0.0, SPEED: 0.0}
        assert check.step(row, True) is None
        assert (check.step(row | {TRAVEL: sign * step}, True) is not None) is jumps


def test_without_a_clock_lost_cycles_count_for_how_far_the_motor_came():
    """150 mm/s for ten cycles is no jump, twice that is."""
    for way, jumps in ((1.5e-3, False), (1.9e-3, False), (2.3e-3, True)):
        check = MotionCheck(rig("bench"))
        check.step({TRAVEL: 0.0, SPEED: 0.15}, True)
        for _ in range(9):
            assert check.step({TRAVEL: 0.0, SPEED: 0.15}, False) is None
        refusal = check.step({TRAVEL: way, SPEED: 0.15}, True)
        assert (refusal is not None) is jumps
    assert refusal == ("position jump", TRAVEL, f"{TRAVEL} jumped by 2.3 mm in 10 ms")
