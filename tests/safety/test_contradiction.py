"""A motor whose position and speed do not agree trips; one that moves as motors do never does."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_bench import NAMES, Bench, edited, rig

from epa_rt.safety.contradiction import APART_S, FORGET_S, JUMP_SHARE, MotionCheck

FASTEST = 0.15  # the bench's limit of motor_speed_m_s
STEP_S = 1e-3


def moved(check: MotionCheck, travel: float, speed: float, bus_ok: bool = True):
    return check.step({"motor_travel_m": travel, "motor_speed_m_s": speed}, bus_ok)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jump_trips_beyond_what_the_limit_of_speed_allows_and_not_at_it(sign):
    allowed = JUMP_SHARE * FASTEST * STEP_S
    for step, trips in ((allowed * 0.999, False), (allowed * 1.001, True)):
        check = MotionCheck(rig("bench"))
        assert moved(check, 0.01, 0.0) is None
        refusal = moved(check, 0.01 + sign * step, 0.0)
        assert (refusal is not None) == trips
        if trips:
            assert refusal == (
                "position jump",
                "motor_travel_m",
                f"motor_travel_m jumped by {sign * step:.4g} in 1 ms",
            )


def test_the_first_position_is_no_jump_wherever_it_stands():
    assert moved(MotionCheck(rig("bench")), 123.0, 0.0) is None


@pytest.mark.parametrize(
    ("travel_per_cycle", "speed"), [(0.0, 0.05), (0.05e-3, 0.0), (-0.05e-3, 0.05)]
)
def test_a_position_or_a_speed_that_stands_trips_after_what_the_law_says(travel_per_cycle, speed):
    check, travel, apart = MotionCheck(rig("bench")), 0.0, 0.0
    moved(check, 0.0, 0.0)
    for _ in range(200):
        travel += travel_per_cycle
        apart = (1.0 - STEP_S / FORGET_S) * apart + travel_per_cycle - speed * STEP_S
        refusal = moved(check, travel, speed)
        if abs(apart) > APART_S * FASTEST:
            assert refusal == (
                "contradiction",
                "motor_travel_m",
                f"motor_travel_m and motor_speed_m_s contradict each other by {apart:.4g}",
            )
            return
        assert refusal is None
    raise AssertionError("it never tripped")


@settings(deadline=None, max_examples=50)
@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=50), st.floats(0.97, 1.03))
def test_sound_motion_within_the_limits_never_trips(shares, scale):
    """Speed as the drive says it, travel as it integrates, the scale of one a few per cent off."""
    check, travel, speed = MotionCheck(rig("bench")), 0.0, 0.0
    for share in shares:
        for _ in range(20):
            speed += 0.2 * (share * FASTEST - speed)
            travel += scale * speed * STEP_S
            assert moved(check, travel, speed) is None


def test_lost_cycles_only_let_the_time_go_on():
    check = MotionCheck(rig("bench"))
    moved(check, 0.0, 0.1)
    assert moved(check, math.nan, math.nan, bus_ok=False) is None
    assert moved(check, 0.0, 0.1, bus_ok=False) is None
    assert moved(check, 0.3e-3, 0.1) is None  # three cycles at 0.1 m/s
    check = MotionCheck(rig("bench"))
    moved(check, 0.0, 0.0)
    moved(check, 0.0, 0.0, bus_ok=False)
    refusal = moved(check, 1.5e-3, 0.0)
    assert refusal[0] == "position jump" and refusal[2].endswith("in 2 ms")
    assert (
        moved(check, 1.5e-3, 0.0)[0] == "contradiction"
    )  # the jump is remembered, the time begins anew


def test_nan_is_refused():
    check = MotionCheck(rig("bench"))
    moved(check, 0.0, 0.0)
    assert moved(check, math.nan, 0.0)[0] == "position jump"
    check = MotionCheck(rig("bench"))
    moved(check, 0.0, 0.0)
    assert moved(check, 0.0, math.nan)[0] == "contradiction"


def test_without_a_speed_row_or_its_limits_it_is_silent():
    for on in (
        edited("bench", ("  speed: motor_speed_m_s\n", "")),
        edited("bench", ("    limits: [-150 mm/s, 150 mm/s]\n", "")),
    ):
        check = MotionCheck(on)
        assert moved(check, 0.0, 0.0) is None and moved(check, 5.0, 0.0) is None


@pytest.mark.parametrize("limits", ["[-300 mm/s, 150 mm/s]", "[-150 mm/s, 300 mm/s]"])
def test_the_larger_of_two_limits_counts(limits):
    check = MotionCheck(edited("bench", ("limits: [-150 mm/s, 150 mm/s]", f"limits: {limits}")))
    moved(check, 0.0, 0.0)
    assert moved(check, 0.4e-3, 0.3) is None


def test_what_it_allows_is_what_the_page_says():
    """Recorded: a change here changes what trips on every rig."""
    assert (JUMP_SHARE, APART_S, FORGET_S) == (1.5, 0.004, 0.050)


@pytest.mark.parametrize("name", NAMES)
def test_the_envelope_trips_on_it_and_a_motor_at_rest_passes(name):
    bench = Bench(name)
    for _ in range(3):
        bench.check()
    assert bench.trip is None
    assert bench.check({"motor_travel_m": 0.02}) == bench.safe
    assert bench.trip[:2] == ("position jump", "motor_travel_m") and bench.trip.cycle == 3
    lost = Bench(name)
    lost.check()
    lost.check({"motor_travel_m": 0.02}, bus_ok=False)
    assert lost.trip is None


def test_a_late_cycle_may_find_the_motor_further_on():
    check = MotionCheck(rig("bench"))
    measured = {"motor_travel_m": 0.0, "motor_speed_m_s": 0.1}
    assert check.step(measured, True, 1_000_000) is None
    assert (
        check.step(measured | {"motor_travel_m": 0.4e-3}, True, 5_000_000) is None
    )  # 4 ms late at 0.1 m/s
    refusal = check.step(measured | {"motor_travel_m": 0.8e-3}, True, 6_000_000)
    assert refusal == ("position jump", "motor_travel_m", "motor_travel_m jumped by 0.0004 in 1 ms")
    again = MotionCheck(rig("bench"))
    again.step(measured, True, 0)
    assert again.step(measured | {"motor_travel_m": 1.1e-3}, True, 4_000_000)[2].endswith("in 4 ms")
