"""A motor whose position and speed do not agree trips; one that moves as motors do never does."""

import math
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_bench import NAMES, Bench, edited, rig

from epa_rt.safety.contradiction import APART_S, FORGET_S, JUMP_SHARE, MotionCheck

FASTEST = 0.15  # the bench's limit of motor_speed_m_s
STEP_S = 1e-3
HOLD_S = 0.002  # safety.position_hold of the rig file


def moved(check: MotionCheck, travel: float, speed: float, bus_ok: bool = True):
    return check.step({"motor_travel_m": travel, "motor_speed_m_s": speed}, bus_ok)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_jump_trips_beyond_what_the_limit_of_speed_allows_and_not_at_it(sign):
    allowed = JUMP_SHARE * FASTEST * HOLD_S  # the first position may have been held so long
    for step, trips in ((allowed * 0.999, False), (allowed * 1.001, True)):
        check = MotionCheck(rig("bench"))
        assert moved(check, 0.01, 0.0) is None
        refusal = moved(check, 0.01 + sign * step, 0.0)
        assert (refusal is not None) == trips
        if trips:
            assert refusal == (
                "position jump",
                "motor_travel_m",
                f"motor_travel_m jumped by {sign * step * 1e3:.4g} mm in 2 ms",
            )


def test_the_first_position_is_no_jump_wherever_it_stands():
    assert moved(MotionCheck(rig("bench")), 123.0, 0.0) is None


@pytest.mark.parametrize(
    ("travel_per_cycle", "speed"), [(0.0, 0.05), (0.05e-3, 0.0), (-0.05e-3, 0.05)]
)
def test_a_position_or_a_speed_that_stands_trips_after_what_the_law_says(travel_per_cycle, speed):
    check, travel, apart = MotionCheck(rig("bench")), 0.0, 0.0
    moved(check, 0.0, speed)
    for _ in range(200):
        travel += travel_per_cycle
        apart = (1.0 - STEP_S / FORGET_S) * apart + travel_per_cycle - speed * STEP_S
        refusal = moved(check, travel, speed)
        if abs(apart) > APART_S * FASTEST:
            assert refusal == (
                "contradiction",
                "motor_travel_m",
                f"motor_travel_m and motor_speed_m_s contradict each other by {apart * 1e3:.4g} mm",
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
    assert check.step(measured | {"motor_travel_m": 0.8e-3}, True, 6_000_000) is None  # held 2 ms
    refusal = check.step(measured | {"motor_travel_m": 1.3e-3}, True, 7_000_000)
    assert refusal == ("position jump", "motor_travel_m", "motor_travel_m jumped by 0.5 mm in 2 ms")
    again = MotionCheck(rig("bench"))
    again.step(measured, True, 0)
    assert again.step(measured | {"motor_travel_m": 1.1e-3}, True, 4_000_000)[2].endswith("in 4 ms")


# any period, late wake-ups, an encoder that is held: what is sound stays so

PERIODS_S = (2e-3, 1e-3, 0.5e-3, 0.25e-3)
SPEED = 0.07
COUNT_M = 0.06283185307 / 77824


@cache
def at_period(period_s: float):
    return edited("bench", ("period: 1 ms", f"period: {1e3 * period_s:g} ms"))


def reads(period_s: float, lateness_s: list[float], for_s: float) -> list[float]:
    """When the loop reads, edges missed whole left out; the lateness comes again and again."""
    times, edge = [], 0
    while edge * period_s < for_s:
        late_s = lateness_s[len(times) % len(lateness_s)]
        times.append(edge * period_s + late_s)
        edge += 1 + int(late_s / period_s)
    return times


def first_refusal(period_s, times, position, speed):
    """The first refusal and its time, of a motor whose position and speed are functions of time."""
    check = MotionCheck(at_period(period_s))
    for t in times:
        measured = {"motor_travel_m": position(t), "motor_speed_m_s": speed(t)}
        refusal = check.step(measured, True, 1_000_000_000 + round(1e9 * t))
        if refusal is not None:
            return t, refusal
    return None


def encoder(t: float, held_s: float) -> float:
    seen = t if held_s == 0.0 else held_s * math.floor(t / held_s + 1e-9)
    return COUNT_M * math.floor(SPEED * seen / COUNT_M)


LATENESS = st.lists(st.floats(0.0, 6e-3), min_size=1, max_size=8)


@pytest.mark.parametrize("period_s", PERIODS_S)
@settings(deadline=None, max_examples=30)
@given(LATENESS, st.sampled_from([0.0, 1e-3, 2e-3]))
def test_perfect_motion_is_silent_however_late_the_loop_wakes(period_s, lateness_s, held_s):
    times = reads(period_s, lateness_s, 0.3)
    assert first_refusal(period_s, times, lambda t: encoder(t, held_s), lambda t: SPEED) is None


@pytest.mark.parametrize("period_s", PERIODS_S)
def test_every_second_wake_up_late_is_silent_in_a_minute(period_s):
    times = reads(period_s, [0.0, 0.4e-3], 20.0)
    assert first_refusal(period_s, times, lambda t: encoder(t, 0.0), lambda t: SPEED) is None


@pytest.mark.parametrize("period_s", PERIODS_S)
@settings(deadline=None, max_examples=15)
@given(LATENESS, st.floats(0.02, 0.15), st.floats(1.0, 20.0))
def test_a_motor_that_swings_is_silent_however_late_the_loop_wakes(
    period_s, lateness_s, top_m_s, rate_rad_s
):
    """The speed changes between the reads, by up to the rig's 2 m/s^2 and more."""
    times = reads(period_s, lateness_s, 0.3)
    position = lambda t: top_m_s / rate_rad_s * math.sin(rate_rad_s * t)  # noqa: E731
    assert (
        first_refusal(period_s, times, position, lambda t: top_m_s * math.cos(rate_rad_s * t))
        is None
    )


def found_after_s(off_m_s: float) -> float:
    """As the page says."""
    return -FORGET_S * math.log(1.0 - APART_S * FASTEST / (FORGET_S * abs(off_m_s)))


@pytest.mark.parametrize("period_s", PERIODS_S)
@settings(deadline=None, max_examples=10)
@given(st.lists(st.floats(0.0, 1e-3), min_size=1, max_size=8))
def test_what_is_wrong_is_found_within_the_time_that_is_said(period_s, lateness_s):
    times = reads(period_s, lateness_s, 0.4)
    began_s = times[len(times) // 2]
    slack_s = 2.0 * (period_s + 1e-3) + 2e-3  # cycles, lateness, and an encoder that is held
    true = lambda t: encoder(t, 0.0)  # noqa: E731
    for what, position, speed, off in (
        ("frozen position", lambda t: true(min(t, began_s)), lambda t: SPEED, SPEED),
        (
            "frozen speed",  # the motor turns round, and its speed does not say so
            lambda t: true(t) if t < began_s else true(began_s) - SPEED * (t - began_s),
            lambda t: SPEED,
            2.0 * SPEED,
        ),
        (
            "scale of two",
            lambda t: true(t) + (true(t) - true(began_s) if t > began_s else 0.0),
            lambda t: SPEED,
            SPEED,
        ),
        ("wrong sign", true, lambda t: SPEED if t < began_s else -SPEED, 2.0 * SPEED),
    ):
        found = first_refusal(period_s, times, position, speed)
        assert found is not None, what
        assert found[0] >= began_s and found[1][0] == "contradiction", what
        assert found[0] - began_s <= found_after_s(off) + slack_s, what


@pytest.mark.parametrize("period_s", PERIODS_S)
def test_a_jump_is_found_at_once_at_rest_and_in_motion(period_s):
    """One of 2000 counts, 1.6 mm."""
    times = reads(period_s, [0.0], 0.1)
    for speed in (0.0, SPEED):
        motion = lambda t, v=speed: v * t + (1.6e-3 if t > 0.05 else 0.0)  # noqa: E731
        found = first_refusal(period_s, times, motion, lambda t, v=speed: v)
        assert found is not None and found[1][0] == "position jump"
        assert found[0] - 0.05 <= period_s + 1e-9


def test_an_encoder_that_is_renewed_every_cycle_may_be_watched_more_closely():
    strict = edited("bench", ("lost_cycles: 3", "lost_cycles: 3\n  position_hold: 0 ms"))
    check = MotionCheck(strict)
    for k in range(5):
        assert check.step({"motor_travel_m": 0.0, "motor_speed_m_s": 0.0}, True, k) is None
    assert moved(check, 0.3e-3, 0.0)[0] == "position jump"


@pytest.mark.parametrize(
    ("gap_s", "more_m", "trips"),
    [
        (40e-3, 0.11e-3, True),
        (50e-3, 0.11e-3, False),
        (70e-3, 0.11e-3, False),
        (70e-3, -0.11e-3, False),
        (90e-3, -0.11e-3, False),
    ],
)
def test_a_gap_as_long_as_the_memory_forgets_all(gap_s, more_m, trips):
    """0.5 mm apart, then a gap in which the motor moved as it says, then 0.55 mm apart again."""
    check, speed, t, travel = MotionCheck(rig("bench")), 0.01, 1_000_000_000, 0.0

    def read(after_s: float, more_m: float):
        nonlocal t, travel
        t, travel = t + round(1e9 * after_s), travel + speed * after_s + more_m
        return check.step({"motor_travel_m": travel, "motor_speed_m_s": speed}, True, t)

    assert read(1e-3, 0.0) is None
    for _ in range(5):
        assert read(1e-3, 0.1e-3) is None
    assert read(gap_s, 0.0) is None
    refusals = [read(1e-3, more_m) for _ in range(5)]
    assert (refusals[-1] is not None) == trips


@pytest.mark.parametrize("speeds", [(0.0, 0.1), (0.1, 0.0), (0.02, 0.1), (-0.1, 0.1)])
@pytest.mark.parametrize("beyond_m", [0.0, 0.3e-3, 0.5e-3, -0.3e-3, -0.5e-3])
@pytest.mark.parametrize("share", [-1.0, 0.0, 1.0])
def test_between_two_reads_the_speed_is_known_by_half_its_change(speeds, beyond_m, share):
    """20 ms with the mean of both speeds, and as far from it as they let it: all within is nothing,
    and what is beyond stays. The next read, 10 ms later, tells how much that is.
    """
    before, after = speeds
    room_m = 0.5 * abs(after - before) * 20e-3
    edge_m = math.copysign(room_m, beyond_m) if beyond_m else share * room_m
    travel = 0.5 * (before + after) * 20e-3 + edge_m + beyond_m
    most_m = APART_S * FASTEST
    for sign in (1.0, -1.0):
        for part, trips in ((0.99, False), (1.01, True)):
            check = MotionCheck(rig("bench"))
            read = lambda at_m, v, t_s, on=check: on.step(  # noqa: E731
                {"motor_travel_m": at_m, "motor_speed_m_s": v}, True, 1 + round(1e9 * t_s)
            )
            assert read(0.0, before, 1.0) is None and read(travel, after, 1.02) is None
            probe_m = sign * part * most_m - 0.8 * beyond_m
            refusal = read(travel + after * 10e-3 + probe_m, after, 1.03)
            assert (refusal is not None) == trips
            if refusal is not None:
                assert refusal[2].endswith(f"by {sign * part * most_m * 1e3:.4g} mm")


def test_a_position_that_is_renewed_every_cycle_is_not_taken_for_a_held_one():
    """At 0.25 ms it has half a millisecond for its way, and not the two that it may be held."""
    check = MotionCheck(at_period(0.25e-3))
    for k in range(20):
        assert moved(check, 0.02e-3 * k, 0.08) is None
    allowed = JUMP_SHARE * FASTEST * 0.5e-3
    assert moved(check, 0.02e-3 * 19 + 1.01 * allowed, 0.08)[2].endswith("in 0.5 ms")
