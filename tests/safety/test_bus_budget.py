"""How much of the process data may be missing, in a row and over time, before a trip."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_bench import Bench, edited, rig

from epa_rt.safety.bus_budget import LOST_TIME_SHARE, BusBudget

REACTION_S = 20e-3


def at_period(period_ms: float, safety: str = ""):
    return edited(
        "bench",
        ("period: 1 ms", f"period: {period_ms:g} ms"),
        ("lost_cycles: 3", f"lost_cycles: 3\n{safety}" if safety else "lost_cycles: 3"),
    )


def ended_after_s(budget: BusBudget, cycles, for_s: float) -> float | None:
    """Time of the cycle that answered; ``cycles`` gives (sound, seconds that it takes) for ever."""
    t, turns = 0.0, iter(cycles)
    while t < for_s:
        sound, takes_s = next(turns)
        if budget.step(sound, 1_000_000_000 + round(1e9 * t)):
            return t
        t += takes_s
    return None


def again(pattern):
    while True:
        yield from pattern


@pytest.mark.parametrize("period_ms", [2, 1, 0.5, 0.25])
@pytest.mark.parametrize("first", [0, 1, 2])
@pytest.mark.parametrize("lost_s", [0.0, 5e-3])
def test_two_of_three_lost_for_good_trip_within_the_reaction_time(period_ms, first, lost_s):
    """Counted wrongly, or not come back, which the driver waits 5 ms for."""
    period_s = 1e-3 * period_ms
    three = [(False, max(period_s, lost_s)), (False, max(period_s, lost_s)), (True, period_s)]
    pattern = again(three[first:] + three[:first])
    ended = ended_after_s(BusBudget(at_period(period_ms)), pattern, 1.0)
    began_s = period_s if first == 2 else 0.0
    assert ended is not None and ended - began_s <= REACTION_S


@pytest.mark.parametrize("period_ms", [2, 1, 0.5, 0.25])
@settings(deadline=None, max_examples=20)
@given(st.integers(1, 2), st.integers(0, 30))
def test_losses_below_the_share_go_on_for_ever(period_ms, together, more):
    """One or two of at least eleven times as many."""
    period_s = 1e-3 * period_ms
    pattern = [(False, period_s)] * together + [(True, period_s)] * (10 * together + more)
    assert ended_after_s(BusBudget(at_period(period_ms)), again(pattern), 2.0) is None


@given(st.floats(6.1e-3, 0.5))
def test_what_the_machine_stood_still_is_not_the_bus(stall_s):
    """One lost frame, and the loop that does not run for long: nothing to trip for; a second and
    third one in a row are, and the stall is said.
    """
    budget = BusBudget(rig("bench"))
    assert ended_after_s(budget, again([(False, stall_s)] + [(True, 1e-3)] * 200), 1.0) is None
    budget, at = BusBudget(rig("bench")), 10_000_000_000
    assert not budget.step(False, at) and not budget.step(False, at + round(1e9 * stall_s))
    said = budget.step(False, at + round(2e9 * stall_s))
    assert said.endswith(f"stand still for {2e3 * (stall_s - 6e-3):.3g} ms")


def test_a_row_is_judged_by_its_length_alone():
    for frame_timeout, takes_s in (("", 1e-3), ("master: {frame_timeout: 90 ms}\n", 90e-3)):
        on = edited("bench", ("safety:\n", f"{frame_timeout}safety:\n"))
        budget = BusBudget(on)
        assert not budget.step(False, 1) and not budget.step(False, 1 + round(takes_s * 1e9))
        assert budget.step(False, 1 + round(2e9 * takes_s)) == (
            "the working counter was wrong in 3 cycles in a row"
        )


def test_it_is_clear_once_the_time_is_paid_back():
    budget = BusBudget(rig("bench"))
    assert budget.clear and budget.step(False, 0) == "" and not budget.clear
    for _ in range(8):
        assert budget.step(True, 0) == "" and not budget.clear
    budget.step(True, 0)
    assert budget.clear


def test_what_may_gather_and_for_how_long_is_the_rigs():
    tight = at_period(1, "  lost_time: 4 ms\n  lost_share: 0")
    budget = BusBudget(tight)
    for k in range(4):
        assert budget.step(False, 0) == "" and budget.step(True, 0) == "", k
    assert budget.step(False, 0) == (
        "the working counter was wrong for 5 ms more than 0 % of the time, of 4 ms allowed"
    )
    assert LOST_TIME_SHARE == 0.6


def test_a_lost_frame_counts_for_as_long_as_it_was_waited_for():
    budget = BusBudget(at_period(1, "  lost_time: 9 ms"))
    assert budget.step(False, 1_000_000) == ""
    assert budget.step(True, 6_000_000) == ""  # 5 ms, and one sound cycle
    assert budget.step(False, 7_000_000) == ""
    assert "for 9.78 ms more" in budget.step(True, 12_000_000)  # 10 ms, and two sound cycles


def test_the_envelope_trips_on_it():
    bench = Bench()
    for k in range(20):
        bench.check(bus_ok=k % 3 == 2)
    assert bench.trip.cause == "lost working counter" and bench.trip.cycle < 20
    assert bench.trip.text == (
        "the working counter was wrong for 12.3 ms more than 10 % of the time, of 12 ms allowed"
    )
