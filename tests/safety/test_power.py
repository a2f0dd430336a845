"""Power comes on at rest, in a chosen mode, where the rig is; and the mode stays while it is on."""

import math

import pytest
from safety_bench import Bench, edited, rig

TRAVEL, SPEED, TORQUE = "cmd_motor_travel_m", "cmd_motor_speed_m_s", "cmd_motor_torque_nm"
CONTROL, MODE = "cmd_drive_control_raw", "cmd_drive_mode_raw"
ON = {CONTROL: 0x0F, MODE: 8}
JUMP = 0.010 * 0.150  # ten milliseconds at 150 mm/s


@pytest.mark.parametrize("name", ["bench", "knee", "mass"])
def test_the_jump_allowed_is_ten_milliseconds_at_full_slew(name):
    bench = Bench(name)
    assert bench.gate.jump_si == pytest.approx(0.010 * rig(name).row(TRAVEL).slew)


def test_it_hangs_on_seconds_not_on_cycles():
    on = edited("bench", ("period: 1 ms", "period: 4 ms"))
    assert Bench(on).gate.jump_si == pytest.approx(JUMP)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_position_target_away_from_the_rig_is_a_jump(side):
    for distance, trips in ((0.0, False), (0.99 * JUMP, False), (1.01 * JUMP, True), (0.012, True)):
        bench = Bench()
        bench.measured["motor_travel_m"] = 0.010
        bench.check(command={TRAVEL: 0.010})
        out = bench.check(command=ON | {TRAVEL: 0.010 + side * distance})
        assert (bench.trip is not None) == trips, distance
        if trips:
            assert out == bench.safe and bench.trip[:2] == ("jump at enable", TRAVEL)
            far = f"{distance * 1e3:.4g} mm"
            assert (
                bench.trip.text == f"{TRAVEL} stands {far} from motor_travel_m when power comes on"
            )


def test_exactly_as_far_as_allowed_is_allowed():
    bench = Bench()
    bench.check(command={TRAVEL: bench.gate.jump_si})
    bench.check(command=ON | {TRAVEL: bench.gate.jump_si})
    assert bench.trip is None


def test_an_output_that_lags_behind_its_target_is_a_jump_too():
    bench = Bench()
    bench.check(command={TRAVEL: 0.030})  # follows at once, unpowered
    out = bench.check(
        {"motor_travel_m": 0.0}, ON | {TRAVEL: 0.0}
    )  # the target is right, but slew holds the output back
    assert (
        out == bench.safe
        and bench.trip.cause == "jump at enable"
        and "stands 29.85 mm from" in bench.trip.text
    )


@pytest.mark.parametrize("mode", [8, 9, 10])
def test_in_every_mode_the_position_target_stands_where_the_rig_is(mode):
    bench = Bench()
    bench.check(command={CONTROL: 0x0F, MODE: mode, TRAVEL: 0.02})
    assert bench.trip.cause == "jump at enable"


@pytest.mark.parametrize(("row", "value"), [(SPEED, 0.00123456), (SPEED, -0.001), (TORQUE, 0.01)])
@pytest.mark.parametrize("mode", [8, 9, 10])
def test_speed_and_torque_are_at_rest_when_power_comes_on(row, value, mode):
    bench = Bench()
    out = bench.check(command={CONTROL: 0x0F, MODE: mode, row: value})
    assert out == bench.safe and bench.trip[:2] == ("jump at enable", row)
    said = f"{value * 1e3:.4g} mm/s" if row == SPEED else f"{value:g} N*m"
    assert bench.trip.text == f"{row} = {said} when power comes on"


def test_a_speed_that_is_still_being_slewed_down_is_a_jump():
    bench = Bench()
    for _ in range(10):
        bench.check(command={SPEED: 0.08})
    assert bench.check(command={SPEED: 0.0})[SPEED] > 0.0
    out = bench.check(command=ON | {SPEED: 0.0})
    assert out == bench.safe and bench.trip[:2] == ("jump at enable", SPEED)


def test_an_analog_drive_is_enabled_at_rest():
    bench = Bench("bench_analog").power_on()
    assert bench.check(command={SPEED: 0.001})[SPEED] == 0.001  # and may move afterwards
    bench = Bench("bench_analog")
    bench.check(command={"cmd_drive_enable": 1.0, SPEED: 0.001})
    assert bench.trip[:2] == ("jump at enable", SPEED)


def test_power_in_no_mode_is_refused():
    bench = Bench()
    assert bench.check(command={CONTROL: 0x0F, MODE: 0}) == bench.safe
    assert (
        bench.trip[:2] == ("bad command", MODE)
        and bench.trip.text == f"{MODE} = 0 when power comes on, expected a mode"
    )


@pytest.mark.parametrize(("before", "after"), [(8, 9), (9, 8), (9, 10), (10, 8), (8, 0), (10, 0)])
def test_the_mode_stays_while_power_is_on(before, after):
    bench = Bench().power_on(before)
    assert bench.check(command={MODE: after}) == bench.safe
    assert bench.trip[:2] == ("mode change", MODE)
    assert bench.trip.text == f"{MODE} = {after} under power, expected {before}"


def test_a_command_that_is_no_number_is_called_so_even_when_power_comes_on():
    bench = Bench()
    bench.check(command=ON | {SPEED: math.nan})
    assert bench.trip[:2] == ("NaN command", SPEED)


def test_the_mode_may_change_without_power_and_with_the_power_word_gone():
    bench = Bench().power_on(8)
    bench.command[CONTROL] = 0x07
    bench.check(command={MODE: 9})
    bench.command[CONTROL] = 0x0F
    bench.check(command={MODE: 9})
    assert bench.trip is None


def test_power_that_comes_on_again_is_checked_again():
    bench = Bench().power_on()
    bench.check(command={CONTROL: 0x07})
    bench.check(command={TRAVEL: 0.01})
    assert bench.trip.cause == "jump at enable"


def test_a_position_that_is_no_number_cannot_be_enabled_at():
    bench = Bench()
    refusal = bench.gate.pass_through(
        bench.measured | {"motor_travel_m": math.nan}, bench.command | ON
    )
    assert refusal[0] == "jump at enable"


@pytest.mark.parametrize(
    "power",
    [{}, {MODE: 8}, {CONTROL: 0x07, MODE: 8}, {CONTROL: 0x0F, MODE: 9}, {CONTROL: 0x0F, MODE: 10}],
)
def test_where_the_drive_does_not_listen_the_target_follows_however_fast(power):
    bench = Bench()
    bench.check(command=power)
    for travel in (
        0.00022,
        0.00044,
        0.00066,
    ):  # faster than the target's slew, not too fast for a motor
        out = bench.check(
            {"motor_travel_m": travel, "motor_speed_m_s": 0.15}, power | {TRAVEL: travel}
        )
        assert out[TRAVEL] == travel
    assert bench.gate.slewed[TRAVEL] == bench.gate.clamped[TRAVEL] == 0


@pytest.mark.parametrize(
    ("value", "sent"),
    [
        (0.05, 0.031),
        (-0.05, -0.010),
        (math.inf, 0.031),
        (-math.inf, -0.010),
        (0.031, 0.031),
        (-0.010, -0.010),
        (10**400, 0.031),
    ],
)
def test_a_target_that_follows_stays_within_its_limits(value, sent):
    bench = Bench()
    assert bench.check(command={TRAVEL: value})[TRAVEL] == sent and bench.trip is None
    assert bench.gate.clamped[TRAVEL] == 0  # the rig was moved there by hand; nobody asked for it


def test_a_drive_without_a_position_target_needs_none():
    on = edited("bench", ("  position_target: cmd_motor_travel_m\n", ""))
    bench = Bench(on).power_on(9)
    assert bench.gate.jump_si == 0.0
    assert bench.check(command={TRAVEL: 0.03})[TRAVEL] == pytest.approx(
        0.00015
    )  # an ordinary row, slewed


def test_a_drive_without_speed_and_torque_needs_none():
    on = edited(
        "bench", ("  speed_target: cmd_motor_speed_m_s\n  torque_target: cmd_motor_torque_nm\n", "")
    )
    bench = Bench(on)
    bench.check(command=ON | {SPEED: 0.002})
    assert bench.trip is None
